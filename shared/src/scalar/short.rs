//! The short number of the device: 32 bits, 28 of them behind the binary point, every operation
//! saturating.
//!
//! A hysteresis is integrated in several stages, and its state, its travel within a sample and its
//! exponent are all small. A product of two such numbers takes a Cortex-M4 a fifth of what it takes
//! with [`super::q::Q`], a power a fifth as well.
//!
//! A power brings its number exactly to a mantissa from 1 to 2 and its logarithm to whole halvings
//! and a rest, and evaluates a truncated Chebyshev series for each, whose coefficients the compiler
//! works out. What rests stays exact: a power of 1 is 1 and one of 0 is 0, to the last bit.
//!
//! | operation | over | largest error stated | measured, maximum and RMS |
//! |---|---|---|---|
//! | `power` | 0 to 1, exponents 1 to 4 | 5 units of 2⁻²⁸ ([`POWER_ERROR`]) | 4.4 and 0.51 |
//!
//! | `raised` | 0 to 8, exponents n of 0.1 to 7 in size, values up to 8 | 5 units and (1 + \|n\|)·aⁿ more ([`RAISED_ERROR`]) | 0.77 of what is stated, for n below 0 0.89 |
//!
//! Measured by `cargo test --release -p jointwatch-shared short -- --nocapture`. The stated error
//! is that against the exact function of the numbers that were given.

use super::{Number, Powers, ratio};
use crate::scalar::fixed::{mul_high_add, round_shift_32, round_to_i64, saturate};
use core::f64::consts::{FRAC_1_SQRT_2, LN_2, SQRT_2};
use core::ops::{Add, Mul, Neg, Sub};

/// A signed fixed-point number: `raw`/2²⁸, from −8 to 8 − 2⁻²⁸.
///
/// | operation | rounding | at the rails |
/// |---|---|---|
/// | `+`, `−`, negation, [`Number::abs`], [`Number::flip_sign`] | exact | saturates |
/// | [`Number::half`] | to nearest, half up | cannot leave the range |
/// | `·` | to nearest, half up | saturates, up to the last four places |
/// | [`Powers::power`] | [`POWER_ERROR`] | cannot leave the range |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Short {
    raw: i32,
}

/// Binary places behind the point.
pub const PLACES: u32 = 28;
/// The value of one unit: 2⁻²⁸.
pub const UNIT: f64 = 1.0 / (1_u64 << PLACES) as f64;
/// The most by which `power` is off: four times ln 2 of the logarithm's 1.2 units, and the half
/// units of the rest.
pub const POWER_ERROR: f64 = 5.0 * UNIT;

/// What `raised` is off by beside that, per unit of its value and of one more than its exponent: ln
/// 2 of the logarithm's 1.2 units, and the halving's own error, both as large as the value.
pub const RAISED_ERROR: f64 = UNIT;

/// Coefficients of log₂(1.5 + f) for f from −½ to ½, in 2⁻³⁰, from that of f on.
const LOG2: [i32; 10] = from(log2());
/// Those of 2^−(½ + f).
const HALVING: [i32; 6] = from(halving());

/// Σ c_k·f^k for f in 2⁻³². Written out: in a loop the device takes five instructions for a term
/// instead of two.
macro_rules! series {
    ($f:expr, $last:expr) => { $last };
    ($f:expr, $first:expr, $($rest:expr),+) => { mul_high_add(series!($f, $($rest),+), $f, $first) };
}

impl Short {
    /// The number whose bits are `raw`, saturated.
    #[inline]
    pub const fn saturated(raw: i64) -> Self {
        Self {
            raw: saturate(raw).0,
        }
    }

    /// The stored integer: the value in units of 2⁻²⁸.
    #[inline]
    pub const fn raw(self) -> i32 {
        self.raw
    }
}

impl Add for Short {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            raw: self.raw.saturating_add(other.raw),
        }
    }
}

impl Sub for Short {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self {
            raw: self.raw.saturating_sub(other.raw),
        }
    }
}

impl Neg for Short {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            raw: 0_i32.saturating_sub(self.raw),
        }
    }
}

impl Mul for Short {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = i64::from(self.raw) * i64::from(other.raw) + (1 << (PLACES - 1));
        // The high word held within 28 bits is one instruction of the device; four places behind it
        // come from the low word.
        const MOST: i32 = (1 << (PLACES - 1)) - 1;
        let high = ((product >> 32) as i32).clamp(-1 - MOST, MOST);
        Self {
            raw: high << (32 - PLACES) | (product as u32 >> PLACES) as i32,
        }
    }
}

impl Number for Short {
    #[inline]
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self::saturated(ratio(numerator, denominator, PLACES))
    }
    #[inline]
    fn abs(self) -> Self {
        Self {
            raw: self.raw.saturating_abs(),
        }
    }
    #[inline]
    fn min(self, other: Self) -> Self {
        Ord::min(self, other)
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        Ord::max(self, other)
    }
    #[inline]
    fn heaviside(self, threshold: Self) -> Self {
        Self {
            raw: i32::from(self.raw >= threshold.raw) << PLACES,
        }
    }
    #[inline]
    fn flip_sign(self, direction: Self) -> Self {
        if direction.raw < 0 { -self } else { self }
    }
    #[inline]
    fn half(self) -> Self {
        Self {
            raw: round_shift_32(self.raw, 1),
        }
    }
}

impl Powers for Short {
    fn power(self, exponent: Self) -> Self {
        let raw = self.raw.clamp(0, 1 << PLACES) as u32;
        let zeros = raw.leading_zeros();
        // Behind its leading 1, which goes; less a half, so that the sign goes to both sides of the
        // middle.
        let mantissa = (raw << (zeros & 31)) << 1;
        let fraction = log2_of((mantissa ^ 1 << 31) as i32);
        // −log₂ in 2⁻²⁷; of 0, which has a leading zero more than the smallest number, one halving
        // more than leaves nothing.
        let whole = (zeros + (zeros >> 5)) - (31 - PLACES);
        let halvings = (whole << 27).wrapping_sub(((fraction + (1 << 2)) >> 3) as u32);
        // Below 2⁶³ for any exponent that is not negative.
        let t = u64::from(halvings) * u64::from(exponent.raw as u32);
        // Whole halvings, and a rest.
        let rest = (t >> 23) as u32;
        let value = halved_by((rest ^ 1 << 31) as i32) as u32;
        let value = value >> (((t >> 32) as i32) >> 23).clamp(0, 31);
        Self {
            raw: ((value + (1 << 1)) >> 2) as i32,
        }
    }
    fn raised(self, exponent: Self) -> Self {
        let raw = self.raw.max(0) as u32;
        if raw == 0 {
            return Self { raw: 0 };
        }
        let zeros = raw.leading_zeros();
        let mantissa = (raw << (zeros & 31)) << 1;
        let fraction = log2_of((mantissa ^ 1 << 31) as i32);
        // −log₂ in 2⁻²⁷, below 0 for a number above 1.
        let whole = i64::from(zeros) - i64::from(31 - PLACES);
        let halvings = (whole << 27) - i64::from((fraction + (1 << 2)) >> 3);
        // Below 2⁶³: at most 28 halvings, and an exponent below 8.
        let t = halvings * i64::from(exponent.raw);
        let rest = (t >> 23) as u32;
        // In 2⁻³⁰, from ½ to 1.
        let value = i64::from(halved_by((rest ^ 1 << 31) as i32));
        let whole = (t >> 55) as i32;
        let value = if whole < 0 {
            value << (-whole).min(31)
        } else {
            value >> whole.min(31)
        };
        Self::saturated((value + (1 << 1)) >> 2)
    }
}

/// log₂(1.5 + f) in 2⁻³⁰ for f in 2⁻³², from −½ to ½.
#[inline(always)]
const fn log2_of(f: i32) -> i32 {
    /// 0 at −½ to the last bit.
    const START: i32 = -sum(i32::MIN, 0);
    #[inline(always)]
    const fn sum(f: i32, start: i32) -> i32 {
        let [a, b, c, d, e, g, h, i, j, k] = LOG2;
        series!(f, start, a, b, c, d, e, g, h, i, j, k)
    }
    sum(f, START)
}

/// 2^−(½ + f) in 2⁻³⁰ for f in 2⁻³², from −½ to ½.
#[inline(always)]
const fn halved_by(f: i32) -> i32 {
    /// 1 at −½ to the last bit.
    const START: i32 = (1 << 30) - sum(i32::MIN, 0);
    #[inline(always)]
    const fn sum(f: i32, start: i32) -> i32 {
        let [a, b, c, d, e, g] = HALVING;
        series!(f, start, a, b, c, d, e, g)
    }
    sum(f, START)
}

/// Coefficients in 2⁻³⁰ of the powers of f, from the first one on, from those of the Chebyshev
/// polynomials of 2·f.
const fn from<const N: usize>(chebyshev: [f64; N]) -> [i32; N] {
    // The polynomial T_k of 2·f without its constant, and that constant; the same of the one
    // before.
    let (mut last, mut last_constant) = ([0.0; N], 1.0);
    let (mut this, mut constant) = ([0.0; N], 0.0);
    this[0] = 2.0;
    let mut sums = [0.0; N];
    let mut k = 0;
    while k < N {
        let mut next = [0.0; N];
        let mut power = 0;
        while power < N {
            sums[power] += chebyshev[k] * this[power];
            let raised = if power == 0 {
                constant
            } else {
                this[power - 1]
            };
            next[power] = 4.0 * raised - last[power];
            power += 1;
        }
        (last, this) = (this, next);
        (last_constant, constant) = (constant, -last_constant);
        k += 1;
    }
    let mut coefficients = [0; N];
    let mut power = 0;
    while power < N {
        coefficients[power] = round_to_i64(sums[power] * (1_u64 << 30) as f64) as i32;
        power += 1;
    }
    coefficients
}

/// ln(1 + x/3) = −ln(1 + β²) + 2·Σ (−1)^(k+1)·β^k/k·T_k(x) with β = 3 − √8, where
/// 1.5 + f = 1.5·(1 + x/3).
const fn log2() -> [f64; 10] {
    let beta = 3.0 - 2.0 * SQRT_2;
    let mut series = [0.0; 10];
    let mut power = 2.0 / LN_2;
    let mut k = 0;
    while k < series.len() {
        power *= beta;
        series[k] = power / (k + 1) as f64;
        power = -power;
        k += 1;
    }
    series
}

/// e^−(a·x) = I₀(a) + 2·Σ (−1)^k·I_k(a)·T_k(x) with a = ½·ln 2 and Bessel's modified functions,
/// times √½.
const fn halving() -> [f64; 6] {
    let half = 0.25 * LN_2;
    let mut series = [0.0; 6];
    let mut first = 2.0 * FRAC_1_SQRT_2;
    let mut k = 0;
    while k < series.len() {
        first *= -half / (k + 1) as f64;
        // Σ half^(2j + k + 1)/(j!·(j + k + 1)!), signed.
        let mut term = first;
        let mut j = 0;
        while j < 6 {
            series[k] += term;
            j += 1;
            term *= half * half / (j * (j + k + 1)) as f64;
        }
        k += 1;
    }
    series
}

#[cfg(test)]
mod tests {
    use super::super::Scalar;
    use super::super::q::Q;
    use super::*;
    use proptest::prelude::*;
    extern crate std;
    use std::println;

    fn short(value: f64) -> Short {
        Short::saturated(round_to_i64(value / UNIT))
    }

    fn real(short: Short) -> f64 {
        f64::from(short.raw) * UNIT
    }

    #[test]
    fn a_power_is_as_near_as_stated() {
        let (mut most, mut squares, mut count) = (0.0_f64, 0.0, 0_u32);
        for quarter in 0..=12 {
            let n = 1.0 + f64::from(quarter) / 4.0;
            // Evenly, and evenly in the logarithm.
            let even = (0..=300_007).map(|step| f64::from(step) / 300_007.0);
            let small = (0..=100_003).map(|step| (-f64::from(step) / 5000.0).exp());
            for a in even.chain(small).map(short) {
                let off = (real(a.power(short(n))) - real(a).powf(n)) / UNIT;
                most = most.max(off.abs());
                squares += off * off;
                count += 1;
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("power: {most:.2} units at most, {rms:.2} RMS");
        assert!(most * UNIT <= POWER_ERROR && most <= 4.45 && rms <= 0.515);
    }

    #[test]
    fn a_number_is_raised_as_near_as_stated() {
        let mut fullest = [0.0_f64; 2];
        for n in [
            0.1, 0.3, 0.5, 0.9, 1.0, 1.7, 3.0, 5.0, 7.0, -0.3, -1.0, -1.7, -7.0,
        ]
        .map(short)
        {
            let even = (0..=100_003).map(|step| 7.99 * f64::from(step) / 100_003.0);
            let small = (0..=100_003).map(|step| (-f64::from(step) / 5200.0).exp());
            for a in even.chain(small).map(short) {
                let exact = real(a).powf(real(n));
                if real(n) < 0.0 && exact >= 8.0 {
                    continue;
                }
                let off = (real(a.raised(n)) - exact.min(8.0 - UNIT)).abs();
                let stated = POWER_ERROR + (1.0 + real(n).abs()) * exact.min(8.0) * RAISED_ERROR;
                let side = &mut fullest[usize::from(real(n) < 0.0)];
                *side = side.max(off / stated);
            }
        }
        println!("raised: {fullest:.2?} of what is stated");
        assert!(fullest[0] <= 0.78 && fullest[1] <= 0.9, "{fullest:?}");
    }

    #[test]
    fn a_power_does_not_jump_where_an_octave_ends() {
        // There the logarithm's fraction comes nearest to leaving 0 to 1.
        for octave in 0..=PLACES {
            let middle = 1_i32 << octave;
            let around = 1 << octave.min(14);
            for raw in (middle - around..=middle + around).filter(|raw| *raw <= 1 << PLACES) {
                for n in [1.0, 1.7, 4.0] {
                    let (a, n) = (Short { raw }, short(n));
                    let off = (real(a.power(n)) - real(a).powf(real(n))).abs();
                    assert!(off <= POWER_ERROR, "{raw}, {}: {off}", real(n));
                }
            }
        }
    }

    #[test]
    fn what_rests_stays_exact() {
        let (one, zero) = (short(1.0), short(0.0));
        for n in [1.0, 1.7, 2.0, 4.0].map(short) {
            assert_eq!((one.power(n), zero.power(n)), (one, zero));
            assert_eq!((short(8.0).power(n), (-one).power(n)), (one, zero));
        }
    }

    proptest! {
        #[test]
        fn operations_are_the_exact_ones_rounded_and_saturated(a: i32, b: i32, small in 0_u32..16) {
            for (a, b) in [(a, b), (a >> small, b >> (16 - small)), (i32::MIN, b), (a, i32::MIN)] {
                let (p, q) = (Short { raw: a }, Short { raw: b });
                let held = |exact: i64| exact.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
                let (a, b) = (i64::from(a), i64::from(b));
                let exact = (a * b + (1 << 27)) >> 28;
                if i64::from(held(exact)) == exact {
                    prop_assert_eq!((p * q).raw, exact as i32);
                } else {
                    prop_assert!((0..16).contains(&((p * q).raw ^ held(exact))));
                }
                prop_assert_eq!(((p + q).raw, (p - q).raw), (held(a + b), held(a - b)));
                prop_assert_eq!(((-p).raw, p.abs().raw), (held(-a), held(a.abs())));
                prop_assert_eq!((Number::min(p, q).raw, Number::max(p, q).raw), (a.min(b) as i32, a.max(b) as i32));
                prop_assert_eq!(real(p.heaviside(q)), f64::from(u8::from(a >= b)));
                prop_assert_eq!((p.flip_sign(q).raw, p.half().raw), (held(if b < 0 { -a } else { a }), ((a + 1) >> 1) as i32));
            }
        }

        #[test]
        fn a_long_number_is_rounded_and_comes_back(raw: i64, places in 0_u32..64) {
            let q = Q::from_raw(raw >> places);
            let held = q.to_f64().clamp(-8.0, 8.0 - UNIT);
            prop_assert!((real(q.short()) - held).abs() <= 0.500_001 * UNIT);
            prop_assert_eq!(Q::long(q.short()).short(), q.short());
        }

        #[test]
        fn no_argument_of_a_power_leaves_the_range(a: i32, n: i32) {
            let value = real(Short { raw: a }.power(Short { raw: n }));
            prop_assert!((0.0..=1.0).contains(&value));
        }

        #[test]
        fn a_ratio_is_the_nearest_number(numerator in -7_i32..8, denominator in 1_i32..1000) {
            let wanted = f64::from(numerator) / f64::from(denominator);
            prop_assert!((real(Short::ratio(numerator, denominator)) - wanted).abs() <= 0.500_001 * UNIT);
        }
    }
}
