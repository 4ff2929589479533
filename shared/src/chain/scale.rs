//! Turning counts into machine numbers: one multiplier, one offset, one shift, built once from SI
//! values.

use crate::chain::filter::shift_round;
use crate::fault::Error;
use crate::scalar::fixed::round_to_i64;

/// `y = (v − origin)·multiplier·2^−shift + offset·2^−shift`, rounded half up and saturated to
/// `i32`.
///
/// The origin is taken off in whole counts with wrapping subtraction, so a counter may stand
/// anywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Scale {
    origin: i32,
    multiplier: i32,
    offset: i64,
    shift: i8,
}

/// Multipliers lie in ±2^28..2^29, so that a product with a 32-bit count stays under 2⁶⁰ and
/// several add up.
const MULTIPLIER_BITS: i32 = 29;

/// A real factor as `multiplier·2^−shift` with 28 to 29 significant bits.
///
/// # Errors
/// [`Error::OutOfRange`] when the factor is not finite, zero or so far from one that no shift of
/// 1..=62 holds it.
pub fn factor(quantity: &'static str, value: f64) -> Result<(i32, i8), Error> {
    let refused = Err(Error::OutOfRange {
        quantity,
        seen: value,
        least: MIN_FACTOR,
        most: MAX_FACTOR,
    });
    let magnitude = value.abs();
    if !(MIN_FACTOR..=MAX_FACTOR).contains(&magnitude) {
        return refused;
    }
    let mut shift = 0;
    let mut scaled = value;
    while scaled.abs() < (1_i64 << (MULTIPLIER_BITS - 1)) as f64 && shift < 62 {
        scaled *= 2.0;
        shift += 1;
    }
    Ok((round_to_i64(scaled) as i32, shift))
}

/// The smallest magnitude a factor may have: 2⁻³³ still keeps 29 bits at the largest shift.
pub const MIN_FACTOR: f64 = 1.0 / (1_u64 << 33) as f64;
/// The largest magnitude a factor may have: at least one bit of shift is left for rounding.
pub const MAX_FACTOR: f64 = ((1_u64 << (MULTIPLIER_BITS - 1)) - 1) as f64;

impl Scale {
    /// A scale that maps the count `origin + rest` to zero and has `gain` machine units per count.
    ///
    /// `zero` is the count, in general not a whole number, that maps to zero.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when the gain cannot be held or `zero` lies outside ±2³¹.
    pub fn new(quantity: &'static str, gain: f64, zero: f64) -> Result<Self, Error> {
        let (multiplier, shift) = factor(quantity, gain)?;
        let limit = i32::MAX as f64;
        if !(-limit..=limit).contains(&zero) {
            return Err(Error::OutOfRange {
                quantity,
                seen: zero,
                least: -limit,
                most: limit,
            });
        }
        let origin = round_to_i64(zero);
        // |rest| ≤ ½ count, so the offset is under 2²⁸.
        let rest = zero - origin as f64;
        Ok(Self {
            origin: origin as i32,
            multiplier,
            offset: round_to_i64(-rest * multiplier as f64),
            shift,
        })
    }

    /// The machine number, and whether it ran into a rail.
    #[inline(always)]
    pub fn apply(&self, counts: i32) -> (i32, bool) {
        let moved = counts.wrapping_sub(self.origin) as i64;
        let value = shift_round(moved * self.multiplier as i64 + self.offset, self.shift);
        (value, value == i32::MAX || value == i32::MIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_scale_is_its_real_formula_to_half_a_unit(
            exponent in -20_i32..20, mantissa in 1.0_f64..2.0, negative: bool,
            zero in -1e6_f64..1e6, counts in -2_000_000_i32..2_000_000,
        ) {
            let gain = mantissa * 2_f64.powi(exponent) * if negative { -1.0 } else { 1.0 };
            let scale = Scale::new("gain", gain, zero).unwrap();
            let wanted = (counts as f64 - zero) * gain;
            let (seen, at_rail) = scale.apply(counts);
            if wanted.abs() < 2_147_483_000.0 {
                // Half a unit of rounding and 2⁻²⁹ relative of the multiplier.
                prop_assert!((seen as f64 - wanted).abs() <= 0.51 + wanted.abs() * 2e-9, "{seen} for {wanted}");
                prop_assert!(!at_rail);
            } else if wanted.abs() > 2_147_484_000.0 * 1.000_001 {
                prop_assert!(at_rail);
            }
        }

        #[test]
        fn nothing_overflows_whatever_the_counts(gain in -2e8_f64..2e8, zero in -2e9_f64..2e9, counts: i32) {
            if let Ok(scale) = Scale::new("gain", gain, zero) {
                let _ = scale.apply(counts);
            }
        }
    }

    #[test]
    fn factors_that_cannot_be_held_are_refused() {
        for value in [0.0, f64::NAN, f64::INFINITY, 1e-11, 3e8] {
            assert!(factor("gain", value).is_err(), "{value}");
        }
        assert_eq!(factor("gain", 1.0).unwrap(), (1 << 28, 28));
        assert_eq!(factor("gain", -0.5).unwrap(), (-(1 << 28), 29));
    }
}
