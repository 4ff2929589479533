//! Fixed-point numbers: fractions held as 32-bit integers, how products are rounded, and what
//! happens at the rails.
//!
//! A number is an `i32` (or an `i64` on the way) together with a count of binary places that is
//! written in the name of the function or of the variable, because a plain integer is what a timer,
//! an encoder and the multiplier know.
//!
//! | format | holds | value of one unit | range | used for |
//! |---|---|---|---|---|
//! | Q31 | `i32` | 2⁻³¹ | −1 to 1 − 2⁻³¹ | normalised inputs and their powers |
//! | Q30 | `i32` | 2⁻³⁰ | −2 to 2 − 2⁻³⁰ | products of powers, where 1 has to be exact |
//! | force | `i32` | `force_per_lsb`, an `f64` of the model | ±2³¹ units | predicted and measured force |
//!
//! | operation | rounding | at the rails |
//! |---|---|---|
//! | [`q31_from_f64`] | to nearest, half up | saturates: 1.0 and more become `i32::MAX`; NaN becomes 0 |
//! | [`q31_to_f64`] | exact | cannot leave the range |
//! | [`round_shift`], [`round_shift_32`] | to nearest, half up | cannot leave the range |
//! | [`mul_shift`] | to nearest, half up | cannot leave `i64` |
//! | [`mul_high_add`] | to nearest, half up | the caller proves that the sum fits; debug builds check it |
//! | [`saturate`] | none | saturates, and says so |
//!
//! *Half up* means ⌊x + ½⌋: half an addition and a shift, the rounding of the multiplier's own
//! `SMMLAR`. It shifts the mean by nothing but the ties, which are one case in 2³² here; rounding
//! half to even would cost three instructions.

use core::sync::atomic::{Ordering, compiler_fence};

/// Half of the divisor 2ⁿ; what is added before a shift by `n` so that it rounds half up.
#[inline(always)]
const fn half(n: u32) -> i64 {
    (1_i64 << n) >> 1
}

/// `⌊x/2ⁿ + ½⌋` for `n` from 0 to 62: a right shift that rounds half up.
///
/// No value of `x` overflows: the shift comes first, and the last bit that was shifted out is added
/// after it.
///
/// ```
/// use jointwatch_shared::scalar::fixed::round_shift;
/// assert_eq!([round_shift(5, 1), round_shift(-5, 1), round_shift(i64::MAX, 1)], [3, -2, 1 << 62]);
/// ```
#[inline(always)]
pub const fn round_shift(x: i64, n: u32) -> i64 {
    debug_assert!(n <= 62);
    // A shift of 64 bits by any number of places takes the device a dozen instructions, one within
    // 32 bits half of them; which of the two it is depends on the places alone.
    if n > 32 {
        round_shift_32((x >> 32) as i32, n - 32) as i64
    } else if n == 0 {
        x
    } else {
        let (high, low, places) = ((x >> 32) as i32, x as u32, (n - 1) & 31);
        let low = low >> places | (high as u32) << 1 << (places ^ 31);
        let twice = ((high >> places) as i64) << 32 | low as i64;
        (twice >> 1) + (twice & 1)
    }
}

/// [`round_shift`] of an `i32`, for `n` from 0 to 31.
#[inline(always)]
pub const fn round_shift_32(x: i32, n: u32) -> i32 {
    debug_assert!(n <= 31);
    if n == 0 {
        x
    } else {
        let twice = x >> ((n - 1) & 31);
        (twice >> 1) + (twice & 1)
    }
}

/// `⌊a·b/2ⁿ + ½⌋` for `n` from 0 to 62, of the exact 64-bit product.
///
/// The product of two `i32` is at most 2⁶² in size and half of the divisor at most 2⁶¹, so nothing
/// overflows.
#[inline(always)]
pub const fn mul_shift(a: i32, b: i32, n: u32) -> i64 {
    debug_assert!(n <= 62);
    (a as i64 * b as i64 + half(n)) >> n
}

/// `⌊a·b/2³² + ½⌋ + sum`: the rounded high word of a product, added to `sum`.
///
/// On a Cortex-M4 this is the single instruction `SMMLAR`, provided that the widening to `i64`
/// stands here, in the expression: widened outside a loop, the compiler keeps two registers per
/// factor and needs three instructions.
///
/// The caller proves that the sum fits an `i32`; builds with overflow checks panic when it does
/// not.
#[inline(always)]
pub const fn mul_high_add(a: i32, b: i32, sum: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32 + sum
}

/// What is loaded from memory before this is loaded before it, and what after it after it. No
/// instruction: a word to the compiler, which otherwise loads what a whole kernel needs at once and
/// then has no registers for it.
#[inline(always)]
pub fn in_order() {
    compiler_fence(Ordering::SeqCst);
}

/// The nearest `i32` to `x`, and whether `x` had to be cut to fit.
///
/// ```
/// use jointwatch_shared::scalar::fixed::saturate;
/// assert_eq!(saturate(-3), (-3, false));
/// assert_eq!(saturate(1 << 40), (i32::MAX, true));
/// ```
#[inline(always)]
pub const fn saturate(x: i64) -> (i32, bool) {
    let low = x as i32;
    if low as i64 == x {
        (low, false)
    } else {
        // All ones for a negative x, so this is i32::MIN below the range and i32::MAX above it.
        (i32::MAX ^ ((x >> 63) as i32), true)
    }
}

/// The nearest integer to `x`, half up, cut to the range of `i64`; 0 for NaN.
pub const fn round_to_i64(x: f64) -> i64 {
    let shifted = x + 0.5;
    let towards_zero = shifted as i64;
    // Conversion cuts towards zero; below zero the floor is one less unless the value was whole.
    if (towards_zero as f64) > shifted {
        towards_zero.saturating_sub(1)
    } else {
        towards_zero
    }
}

/// The Q31 number nearest to `x` (half up), saturated: everything from 1 − 2⁻³² upwards becomes
/// `i32::MAX`.
///
/// The error is at most 2⁻³², except next to 1, which is not a Q31 number and loses 2⁻³¹.
///
/// ```
/// use jointwatch_shared::scalar::fixed::q31_from_f64;
/// let stored = [-1.0, 0.5, 1.0].map(q31_from_f64);
/// assert_eq!(stored, [i32::MIN, 1 << 30, i32::MAX]);
/// ```
pub const fn q31_from_f64(x: f64) -> i32 {
    saturate(round_to_i64(x * 2_147_483_648.0)).0
}

/// The value of a Q31 number; exact.
pub const fn q31_to_f64(x: i32) -> f64 {
    x as f64 / 2_147_483_648.0
}

/// Square and cube of a Q31 number, in Q31.
///
/// The square of −1 is +1, which Q31 has not: it becomes 1 − 2⁻³¹, by an expression without a
/// branch. Errors are at most 2⁻³² for every other square and 2⁻³¹ for every cube.
#[inline(always)]
pub const fn q31_powers(x: i32) -> [i32; 3] {
    // 0 to 2³¹; only 2³¹ itself has bit 31 set.
    let square = mul_shift(x, x, 31) as u32;
    let square = (square - (square >> 31)) as i32;
    [x, square, mul_shift(square, x, 31) as i32]
}
