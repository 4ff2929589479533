//! The hyperbolic tangent in integers: a cubic in every 32nd of the argument, from a table made by
//! the compiler.
//!
//! A neuron's output and the smooth switch of a friction law are both tanh(z). Here |z| is split
//! into the nearest node k/32 and the rest s, from −½ to ½ of a step, and
//!
//! tanh |z| ≈ (c₀ + c₁·s) + s²·(c₂ + c₃·s), with the sign of z put back at the end.
//!
//! In this order two coefficients at a time are needed at once, and loaded by one instruction.
//!
//! Each row of four is the cubic through tanh at the four Chebyshev points of its step, which
//! spreads the error evenly over the step. From the node 12 on, where 1 − tanh is less than a sixth
//! of a unit of Q31, the result is flat at 1 − 2⁻³¹.
//!
//! | | over | maximum | RMS |
//! |---|---|---|---|
//! | error of [`tanh`] | all arguments, −16 to 16 | 2.0e-9 | 3.4e-10 |
//!
//! With half as many steps the error would be ten times larger, and trained networks, whose neurons
//! largely cancel, with output weights of hundreds of times the force, would show it; twice as many
//! would leave the rounding of the coefficients.
//!
//! It is odd to the bit and 0 at 0. Where one step ends and the next begins it may jump by twice
//! the maximum error, so it is monotone to 4.5e-9 and not beyond. A loop over all 2¹⁶ high halves
//! of the argument holds these figures: `cargo test --release -p jointwatch-shared tanh --
//! --nocapture`.

use crate::scalar::fixed::{mul_high_add, round_to_i64, saturate};

/// Steps of the table per unit of the argument.
pub const STEPS_PER_UNIT: u32 = 32;
/// The most by which [`tanh`] and [`tanh_scaled`] differ from tanh of the argument that their
/// integer stands for.
///
/// The cubic accounts for d⁴/192·max|tanh⁗| = 1.27e-9 with d = 1/64, rounding its coefficients and
/// products for 9.6e-10.
pub const MAX_ERROR: f64 = 2.25e-9;

/// 2³¹: the integer that would stand for 1.
const RAIL: f64 = 2_147_483_648.0;
/// The last node of the table; beyond half a step after it everything is as it is there.
pub const LAST: u32 = 12 * STEPS_PER_UNIT;
/// A row per node: 6160 bytes.
pub static TABLE: [Row; LAST as usize + 1] = table();
/// What stands in for a row that is not there; the clamp of the node to [`LAST`] leaves none.
const FLAT: Row = Row([i32::MAX, 0, 0, 0]);

/// c₀ to c₃ in Q31, for s in steps; aligned so that two are loaded at once.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(8))]
pub struct Row([i32; 4]);

/// tanh of an argument in Q27, which holds −16 to 16 − 2⁻²⁷; the result is in Q31, from −(1 − 2⁻³¹)
/// to 1 − 2⁻³¹.
///
/// No branch on the value, no division, and no argument that panics. Off by at most [`MAX_ERROR`].
///
/// ```
/// use jointwatch_shared::base::tanh::tanh;
/// let one = tanh(1 << 27);
/// assert!((f64::from(one) / 2_f64.powi(31) - 1_f64.tanh()).abs() < 2.25e-9);
/// assert_eq!((tanh(0), tanh(-1 << 27), tanh(i32::MIN)), (0, -one, -i32::MAX));
/// ```
#[inline(always)]
pub fn tanh(x: i32) -> i32 {
    const PLACES: u32 = 27;
    // A step is 2²² units, so a unit is 2⁻²² steps.
    tanh_scaled(x, STEPS_PER_UNIT << (32 - PLACES))
}

/// tanh of an argument at any scale: one unit of `x` is `steps`·2⁻³² steps of the table, or
/// `steps`·2⁻³⁷.
///
/// The scale may be so coarse that most of `x` lies beyond the table, and every value there gives
/// ±(1 − 2⁻³¹). Otherwise as [`tanh`].
#[inline(always)]
pub fn tanh_scaled(x: i32, steps: u32) -> i32 {
    // All ones for a negative argument: two's complement by hand, because a branch could take
    // longer.
    let sign = x >> 31;
    let size = (x ^ sign) as u32 + (x as u32 >> 31);
    // Below 2³¹·2³²: the high word is the step, the low word where in the step, in 2⁻³².
    let place = u64::from(size) * u64::from(steps);
    let (floor, rest) = ((place >> 32) as u32, place as u32);
    // Read with a sign, the upper half of a step belongs to the node after it.
    let node = (floor + (rest >> 31)).min(LAST);
    let s = rest as i32;
    let &Row([c0, c1, c2, c3]) = TABLE.get(node as usize).unwrap_or(&FLAT);
    let value = mul_high_add(
        mul_high_add(s, c3, c2),
        mul_high_add(s, s, 0),
        mul_high_add(s, c1, c0),
    );
    (value ^ sign) - sign
}

/// The cubics of all nodes, and a proof while compiling that none of them leaves an `i32`.
const fn table() -> [Row; LAST as usize + 1] {
    let mut rows = [FLAT; LAST as usize + 1];
    let mut node = 0;
    while node < rows.len() {
        let [c0, c1, c2, c3] = cubic(node as f64);
        // The rounded products add at most a unit each; where nothing is multiplied nothing is
        // rounded.
        let products =
            (c1.unsigned_abs() / 2 + c2.unsigned_abs() / 4 + c3.unsigned_abs() / 8) as i64;
        let flat = c1 == 0 && c2 == 0 && c3 == 0;
        assert!(c0 >= 0 && (flat || c0 as i64 + products + 3 <= i32::MAX as i64));
        rows[node] = Row([c0, c1, c2, c3]);
        node += 1;
    }
    rows
}

/// The cubic through tanh at the four Chebyshev points ±½·cos(π/8), ±½·cos(3π/8) around a node, in
/// Q31.
const fn cubic(node: f64) -> [i32; 4] {
    // ¼·cos² of the two angles: (2 ± √2)/16.
    let root = square_root(2.0);
    let (far, near) = ((2.0 + root) / 16.0, (2.0 - root) / 16.0);
    // Sum and difference of opposite points separate c₀ + c₂·s² from c₁ + c₃·s².
    let (far_even, far_odd) = even_and_odd(node, square_root(far));
    let (near_even, near_odd) = even_and_odd(node, square_root(near));
    let c2 = (far_even - near_even) / (far - near);
    let c3 = (far_odd - near_odd) / (far - near);
    [
        q31(near_even - c2 * near),
        q31(near_odd - c3 * near),
        q31(c2),
        q31(c3),
    ]
}

/// Half the sum of tanh at `s` steps to both sides of a node, and half the difference over `s`.
const fn even_and_odd(node: f64, s: f64) -> (f64, f64) {
    let steps = STEPS_PER_UNIT as f64;
    let (above, below) = (real_tanh((node + s) / steps), real_tanh((node - s) / steps));
    ((above + below) / 2.0, (above - below) / (2.0 * s))
}

/// The nearest Q31 number, 1 − 2⁻³¹ for 1.
const fn q31(x: f64) -> i32 {
    saturate(round_to_i64(x * RAIL)).0
}

/// tanh x = (1 − e^−2x)/(1 + e^−2x), to a few units of the last place of 1; for arguments of the
/// table, −1/64 to 12 + 1/64.
const fn real_tanh(x: f64) -> f64 {
    // The series of e^(y/64), |y/64| < 0.4, squared six times; its 20th term is below 1e-26.
    let y = -2.0 * x / 64.0;
    let mut power = 1.0;
    let mut n = 20;
    while n > 0 {
        power = 1.0 + y / n as f64 * power;
        n -= 1;
    }
    let mut squarings = 0;
    while squarings < 6 {
        power *= power;
        squarings += 1;
    }
    (1.0 - power) / (1.0 + power)
}

/// The square root of a number between 0.03 and 2, by Newton's rule from 1: six steps reach 1e-16,
/// ten are taken.
const fn square_root(x: f64) -> f64 {
    let mut root = 1.0;
    let mut steps = 0;
    while steps < 10 {
        root = (root + x / root) / 2.0;
        steps += 1;
    }
    root
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::println;

    /// Low halves tried with every high half: the ends, the middle, and a spread of odd places.
    const LOW_HALVES: [u16; 8] = [0, 1, 0x1d35, 0x4a7b, 0x8000, 0x9c41, 0xd209, 0xffff];

    #[test]
    fn every_high_half_is_as_near_as_stated() {
        let (mut largest, mut squares, mut at) = (0.0_f64, 0.0, 0);
        for high in 0..=u16::MAX {
            for low in LOW_HALVES {
                let x = (u32::from(high) << 16 | u32::from(low)) as i32;
                let error = f64::from(tanh(x)) / RAIL - (f64::from(x) / 2_f64.powi(27)).tanh();
                squares += error * error;
                if error.abs() > largest {
                    (largest, at) = (error.abs(), x);
                }
            }
        }
        let rms = (squares / (65536.0 * LOW_HALVES.len() as f64)).sqrt();
        println!("tanh: maximum {largest:.3e} at {at:#x}, RMS {rms:.3e}");
        assert!((1.8e-9..=2.0e-9).contains(&largest) && largest < MAX_ERROR);
        assert!((3.3e-10..=3.4e-10).contains(&rms));
    }

    #[test]
    fn odd_to_the_bit_flat_at_the_end_and_monotone_to_twice_the_error() {
        let mut last = 0;
        for x in (0..=i32::MAX).step_by(977) {
            let y = tanh(x);
            assert_eq!(tanh(-x), -y, "{x}");
            assert!(f64::from(last - y) < 2.0 * MAX_ERROR * RAIL, "{x}");
            last = y;
            if x >= 12 << 27 {
                assert_eq!(y, i32::MAX, "{x}");
            }
        }
        assert_eq!(
            (tanh(i32::MAX), tanh(i32::MIN), tanh(0)),
            (i32::MAX, -i32::MAX, 0)
        );
    }

    #[test]
    fn any_scale_is_the_same_function_and_any_argument_is_safe() {
        for steps in [0, 1, 3, 511, 512, 700, 1 << 20, u32::MAX] {
            for x in (i32::MIN..=i32::MAX)
                .step_by(1_000_003)
                .chain([i32::MAX, -1, 0, 1])
            {
                let argument = f64::from(x) * f64::from(steps) / 2_f64.powi(37);
                let error = f64::from(tanh_scaled(x, steps)) / RAIL - argument.tanh();
                assert!(error.abs() < MAX_ERROR, "{x} at {steps}: {error:e}");
            }
        }
    }
}
