//! The number that runs on the device: 64 bits, 32 of them behind the binary point, every operation
//! saturating.
//!
//! Laws are evaluated on quantities relative to the training range (`units`), so numbers near 1 are
//! the rule; the 31 places before the point leave room for stiff contacts and steep transitions,
//! the 32 behind it keep what one sample adds to an internal state. A Cortex-M4 multiplies two of
//! them in about 20 instructions.

use super::{Number, ratio};
use crate::scalar::fixed::{mul_high_add, round_to_i64};
use core::ops::{Add, Mul, Neg, Sub};

/// A signed fixed-point number: `raw`/2³², from −2³¹ to 2³¹ − 2⁻³².
///
/// | operation | rounding | at the rails |
/// |---|---|---|
/// | `+`, `−`, negation, [`Number::abs`], [`Number::flip_sign`] | exact | saturates |
/// | [`Number::half`] | to nearest, half up | cannot leave the range |
/// | `·` | to nearest, half up | saturates |
/// | [`Scalar::tanh`](super::Scalar::tanh) | that of [`mod@crate::base::tanh`] | cannot leave the range |
/// | [`Scalar::decay`](super::Scalar::decay), [`Scalar::sine`](super::Scalar::sine) | that of [`mod@super::elementary`] | cannot leave the range |
/// | [`Q::from_f64`] | to nearest, half up | saturates; NaN becomes 0 |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Q {
    raw: i64,
}

/// Binary places behind the point.
pub const PLACES: u32 = 32;
/// The value of one unit: 2⁻³².
pub const UNIT: f64 = 1.0 / (1_u64 << PLACES) as f64;

impl Q {
    pub(crate) const ONE: Self = Self::from_raw(1 << PLACES);

    /// The number whose bits are `raw`.
    #[inline]
    pub const fn from_raw(raw: i64) -> Self {
        Self { raw }
    }

    /// The stored integer: the number times 2^[`PLACES`].
    #[inline]
    pub const fn raw(self) -> i64 {
        self.raw
    }

    /// A Q31 number; exact.
    #[inline]
    pub const fn from_q31(value: i32) -> Self {
        Self {
            raw: (value as i64) << 1,
        }
    }

    /// The sum of two numbers that are known to be small enough: where nothing can saturate, it
    /// takes a third of what `+` does.
    #[inline]
    pub(crate) const fn plus(self, other: Self) -> Self {
        Self::from_raw(self.raw.wrapping_add(other.raw))
    }

    /// As [`Self::plus`], the difference.
    #[inline]
    pub(crate) const fn minus(self, other: Self) -> Self {
        Self::from_raw(self.raw.wrapping_sub(other.raw))
    }

    /// The nearest number, half up.
    pub const fn from_f64(value: f64) -> Self {
        Self {
            raw: round_to_i64(value / UNIT),
        }
    }

    /// The value, to the 53 bits of an `f64`.
    pub const fn to_f64(self) -> f64 {
        self.raw as f64 * UNIT
    }
}

impl Add for Q {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::from_raw(self.raw.saturating_add(other.raw))
    }
}

impl Sub for Q {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::from_raw(self.raw.saturating_sub(other.raw))
    }
}

impl Neg for Q {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::from_raw(0_i64.saturating_sub(self.raw))
    }
}

impl Mul for Q {
    type Output = Self;
    // Laws multiply in more than a hundred places: written into each, products alone would take the
    // device 7 KiB.
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        // Halves that both have a sign: products of such are single instructions of the device,
        // rounding and addition included. The high half is one more where the low one is
        // negative, and does not fit for the very largest numbers alone.
        let halves = |raw: i64| {
            let low = raw as i32;
            let high = ((raw >> PLACES) as i32).checked_add((low as u32 >> 31).cast_signed());
            high.map(|high| (high, low))
        };
        let Some((a, c)) = halves(self.raw) else {
            return self.mul_largest(other);
        };
        let Some((b, d)) = halves(other.raw) else {
            return self.mul_largest(other);
        };
        let product = |x: i32, y: i32| i64::from(x) * i64::from(y);
        // Two of 2⁶² may wrap, but then both numbers are above 2³⁰ in size and the product
        // saturates all the same.
        let middle = i64::from(mul_high_add(c, d, 0)).wrapping_add(product(a, d));
        let middle = middle.wrapping_add(product(c, b));
        let high = (middle >> PLACES) + product(a, b);
        let top = high as i32;
        Self::from_raw(if i64::from(top) == high {
            high << PLACES | i64::from(middle as u32)
        } else {
            i64::MAX ^ (high >> 63)
        })
    }
}

impl Q {
    /// The product of any numbers.
    #[cold]
    #[inline(never)]
    fn mul_largest(self, other: Self) -> Self {
        // Schoolbook on 32-bit halves: a 128-bit product would be a library call on the device.
        let (a, b) = (self.raw >> PLACES, other.raw >> PLACES);
        let (c, d) = (i64::from(self.raw as u32), i64::from(other.raw as u32));
        // Each product of a high and a low half is at least 2³² less than 2⁶³ in size; their halves
        // are added apart from each other.
        let low = (c as u64 * d as u64 + (1 << 31)) >> PLACES;
        let (ad, cb) = (a * d + low as i64, c * b);
        let sum = u64::from(ad as u32) + u64::from(cb as u32);
        let high = a * b + (ad >> PLACES) + (cb >> PLACES) + (sum >> PLACES) as i64;
        let top = high as i32;
        Self::from_raw(if i64::from(top) == high {
            high << PLACES | (sum & 0xffff_ffff) as i64
        } else {
            i64::MAX ^ (high >> 63)
        })
    }
}

impl Number for Q {
    #[inline]
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self::from_raw(ratio(numerator, denominator, PLACES))
    }
    #[inline]
    fn abs(self) -> Self {
        Self::from_raw(self.raw.saturating_abs())
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
        Self::from_raw(i64::from(self.raw >= threshold.raw) << PLACES)
    }
    #[inline]
    fn flip_sign(self, direction: Self) -> Self {
        if direction.raw < 0 { -self } else { self }
    }
    #[inline]
    fn half(self) -> Self {
        Self::from_raw((self.raw >> 1) + (self.raw & 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Scalar;
    use proptest::prelude::*;

    fn exact(product: i128) -> i64 {
        let rounded = (product + (1 << 31)) >> 32;
        rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
    }

    proptest! {
        #[test]
        fn a_product_is_the_128_bit_product_rounded_half_up_and_saturated(a: i64, b: i64, small in 0_u32..40) {
            for (a, b) in [(a, b), (a >> small, b >> (40 - small)), (a >> 31, b >> 31), (i64::MIN, b), (a, i64::MIN)] {
                let seen = (Q::from_raw(a) * Q::from_raw(b)).raw();
                prop_assert_eq!(seen, exact(i128::from(a) * i128::from(b)), "{} times {}", a, b);
            }
        }

        #[test]
        fn a_ratio_is_the_nearest_number(numerator in -1000_i32..1000, denominator in 1_i32..1000) {
            let wanted = f64::from(numerator) / f64::from(denominator);
            prop_assert!((Q::ratio(numerator, denominator).to_f64() - wanted).abs() <= 0.500_001 * UNIT);
        }

        #[test]
        fn corners_agree_with_plain_arithmetic(a in -1e6_f64..1e6, b in -1e6_f64..1e6) {
            let (p, q) = (Q::from_f64(a), Q::from_f64(b));
            let close = |seen: Q, wanted: f64| (seen.to_f64() - wanted).abs() < 2.0 * UNIT;
            prop_assert!(close(p.abs(), a.abs()) && close(Number::min(p, q), a.min(b)) && close(Number::max(p, q), a.max(b)));
            prop_assert_eq!(p.heaviside(q).to_f64(), f64::from(u8::from(p >= q)));
            prop_assert!(close(p + q, a + b) && close(p - q, a - b) && close(-p, -a));
        }
    }

    #[test]
    fn rails_hold() {
        let (most, least) = (Q::from_raw(i64::MAX), Q::from_raw(i64::MIN));
        assert_eq!(most + most, most);
        assert_eq!(least - most, least);
        assert_eq!(-least, most);
        assert_eq!(least.abs(), most);
        assert_eq!(least * least, most);
        assert_eq!(least * most, least);
        assert_eq!(most.tanh(), Q::from_f64(1e3).tanh());
    }
}
