//! The few operations a force law may use, so that one text of the law serves three kinds of
//! number.
//!
//! A law is written once, generic over [`Scalar`]: `f64` predicts on the host, [`dual::Dual`]
//! differentiates it by a parameter, [`q::Q`] runs on the device, and [`interval::Interval`] bounds
//! what the device can make of it. There is no division and no comparison that returns a truth
//! value: quotients and branches are where the kinds of number would part ways.
//!
//! | operation | means | derivative where it has a corner |
//! |---|---|---|
//! | `+ − ·`, negation | as always | |
//! | [`Number::abs`] | \|a\| | that of the side on which the value is; at 0 the right one |
//! | [`Number::min`], [`Number::max`] | the smaller, the larger | that of the one taken; the first on a tie |
//! | [`Number::heaviside`] | 1 where a ≥ b, else 0 | 0 |
//! | [`Number::flip_sign`] | a where b ≥ 0, else −a | by b 0 |
//! | [`Number::half`] | a/2 | |
//! | [`Scalar::tanh`] | hyperbolic tangent | |
//! | [`Scalar::decay`] | e⁻ᵃ for a ≥ 0, 1 below | at 0 the right one |
//! | [`Scalar::hyperbolic_decay`] | 1/(1 + a) for a ≥ 0, 1 below | at 0 the right one |
//! | [`Scalar::gaussian`] | e^(−a²) | |
//! | [`Scalar::sine`] | sin(2πa): the sine of a turns | |
//! | [`Powers::power`] | aⁿ for a from 0 to 1, n from 1 to 4 | |
//! | [`Powers::raised`] | aⁿ for a from 0 to 8, n from −7 to 7 | |
//!
//! Where a law takes many steps with numbers that are all small, such as the internal state of a
//! hysteresis, it takes them with [`Scalar::Short`] ones, which the device has in half as many bits
//! ([`short::Short`]).

#[cfg(feature = "fit")]
pub mod dual;
pub mod elementary;
pub mod fixed;
mod functions;
#[cfg(feature = "fit")]
pub mod interval;
pub mod q;
pub mod short;
pub(crate) mod zero;

use core::ops::{Add, Mul, Neg, Sub};

/// A number with what every kind of number has.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// The number `numerator/denominator`, for the small exact ratios that a law contains; the
    /// denominator is not 0.
    fn ratio(numerator: i32, denominator: i32) -> Self;
    /// The absolute value |a|.
    fn abs(self) -> Self;
    /// The smaller of two.
    fn min(self, other: Self) -> Self;
    /// The larger of two.
    fn max(self, other: Self) -> Self;
    /// 1 where `self` ≥ `threshold`, 0 elsewhere.
    fn heaviside(self, threshold: Self) -> Self;
    /// The same where `direction` ≥ 0, its opposite elsewhere.
    fn flip_sign(self, direction: Self) -> Self;
    /// Half of the number.
    fn half(self) -> Self;

    /// The number 0.
    fn zero() -> Self {
        Self::ratio(0, 1)
    }
    /// The number 1.
    fn one() -> Self {
        Self::ratio(1, 1)
    }
    /// The value held between −`limit` and `limit`; `limit` is not negative.
    fn within(self, limit: Self) -> Self {
        self.min(limit).max(-limit)
    }
    /// What the value exceeds ±`gap` by: 0 between −gap and gap, `self` ∓ gap outside.
    fn dead_zone(self, gap: Self) -> Self {
        (self - gap).max(Self::zero()) + (self + gap).min(Self::zero())
    }
}

/// A number that can be raised to a power.
pub trait Powers: Number {
    /// selfⁿ for a number from 0 to 1, held there, and an exponent from 1 to 4.
    fn power(self, exponent: Self) -> Self;
    /// selfⁿ for a number from 0 to 8 and an exponent from above 0 to 7; 0 where `self` is
    /// negative.
    ///
    /// The exponent may be below 0 as well, down to −7, where `self` is so far above 0 that the
    /// power is below 8.
    fn raised(self, exponent: Self) -> Self;
}

/// A number that a force law can be evaluated with.
pub trait Scalar: Number {
    /// The same with less room and fewer places where the device gains from it: for numbers that
    /// stay below 8 in size.
    type Short: Powers;

    /// This number as a short one.
    fn short(self) -> Self::Short;
    /// A short one as this.
    fn long(short: Self::Short) -> Self;

    /// The hyperbolic tangent of the number.
    fn tanh(self) -> Self;
    /// e⁻ᵃ; 1 where `self` is negative.
    fn decay(self) -> Self;
    /// e⁻ᵃ and eᵃ, each at most 1: that of a positive number in the first place, of a negative one
    /// in the second, and 1 in the other; and their product.
    fn decay_of_either_sign(self) -> [Self; 3] {
        let [ahead, back] = [self.decay(), (-self).decay()];
        [ahead, back, ahead * back]
    }
    /// 1/(1 + a); 1 where `self` is negative.
    fn hyperbolic_decay(self) -> Self;
    /// The Gaussian e^(−a²); beyond |a| = 5 it stays at e⁻²⁵.
    fn gaussian(self) -> Self {
        // From 5 on it is less than the device's last place, and so is the error of a large square.
        let held = self.within(Self::ratio(5, 1));
        (held * held).decay()
    }
    /// sin(2π·self): the sine of a number of turns.
    fn sine(self) -> Self;

    /// What `self·factor` has changed by since `self` was smaller by `step`, which was a quantity
    /// of the same range.
    ///
    /// It is the difference of both products: along a path their roundings cancel, where those of
    /// `step·factor` add up.
    fn change(self, step: Self, factor: Self) -> Self {
        self * factor - (self - step) * factor
    }
    /// The same as a short number, held between −`limit` and `limit`: the difference of both
    /// products as short ones.
    fn short_change(self, step: Self, factor: Self, limit: Self::Short) -> Self::Short {
        self.change(step, factor).short().within(limit)
    }
}

/// The number of 2^−`places` nearest to `numerator/denominator`, half up, for the small constants
/// of a law; 0 where the denominator is 0.
#[inline]
const fn ratio(numerator: i32, denominator: i32, places: u32) -> i64 {
    // Twice the ratio, rounded down, is rounded half up.
    let twice = (numerator as i64) << (places + 1);
    match twice.checked_div_euclid(denominator as i64) {
        Some(floor) => (floor + 1) >> 1,
        None => 0,
    }
}

#[cfg(feature = "fit")]
impl Number for f64 {
    #[inline]
    fn ratio(numerator: i32, denominator: i32) -> Self {
        f64::from(numerator) / f64::from(denominator)
    }
    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline]
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
    #[inline]
    fn heaviside(self, threshold: Self) -> Self {
        f64::from(u8::from(self >= threshold))
    }
    #[inline]
    fn flip_sign(self, direction: Self) -> Self {
        if direction < 0.0 { -self } else { self }
    }
    #[inline]
    fn half(self) -> Self {
        0.5 * self
    }
}

#[cfg(feature = "fit")]
impl Powers for f64 {
    #[inline]
    fn power(self, exponent: Self) -> Self {
        powered(self.clamp(0.0, 1.0), exponent)
    }
    #[inline]
    fn raised(self, exponent: Self) -> Self {
        powered(f64::max(self, 0.0), exponent)
    }
}

/// aⁿ. The roundest knee has n = 1, and its power needs no logarithm.
#[cfg(feature = "fit")]
#[inline]
fn powered(a: f64, n: f64) -> f64 {
    if n == 1.0 { a } else { a.powf(n) }
}

#[cfg(feature = "fit")]
impl Scalar for f64 {
    type Short = Self;

    #[inline]
    fn short(self) -> Self {
        self
    }
    #[inline]
    fn long(short: Self) -> Self {
        short
    }
    #[inline]
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
    #[inline]
    fn decay(self) -> Self {
        f64::exp(-f64::max(self, 0.0))
    }
    #[inline]
    fn hyperbolic_decay(self) -> Self {
        1.0 / (1.0 + f64::max(self, 0.0))
    }
    #[inline]
    fn sine(self) -> Self {
        // Whole turns are taken off first, which is exact.
        f64::sin(core::f64::consts::TAU * (self - self.round()))
    }
}
