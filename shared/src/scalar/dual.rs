//! A number that carries its derivative, so that a force law can be differentiated by a parameter without a second text.

use super::{Number, Powers, Scalar};
use core::ops::{Add, Mul, Neg, Sub};

/// A value and its derivative by one chosen quantity.
///
/// ```
/// use jointwatch_shared::scalar::dual::Dual;
/// let x = Dual::variable(3.0);
/// assert_eq!(x * x + x, Dual { value: 12.0, slope: 7.0 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    /// The value of the function.
    pub value: f64,
    /// d value / d (the chosen quantity).
    pub slope: f64,
}

impl Dual {
    /// A number that does not depend on the chosen quantity.
    #[inline]
    pub const fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
    /// The chosen quantity itself.
    #[inline]
    pub const fn variable(value: f64) -> Self {
        Self { value, slope: 1.0 }
    }
}

impl Add for Dual {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }
}

impl Sub for Dual {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Dual {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
}

impl Neg for Dual {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            slope: -self.slope,
        }
    }
}

impl Number for Dual {
    #[inline]
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self::constant(f64::ratio(numerator, denominator))
    }
    #[inline]
    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
    #[inline]
    fn min(self, other: Self) -> Self {
        if other.value < self.value {
            other
        } else {
            self
        }
    }
    #[inline]
    fn max(self, other: Self) -> Self {
        if other.value > self.value {
            other
        } else {
            self
        }
    }
    #[inline]
    fn heaviside(self, threshold: Self) -> Self {
        Self::constant(self.value.heaviside(threshold.value))
    }
    #[inline]
    fn flip_sign(self, direction: Self) -> Self {
        if direction.value < 0.0 { -self } else { self }
    }
    #[inline]
    fn half(self) -> Self {
        Self {
            value: self.value.half(),
            slope: self.slope.half(),
        }
    }
}

impl Dual {
    /// aⁿ, its slope by a, and its slope along with the exponent. Most of a fit's time goes into these powers, so there is one of them, and a
    /// logarithm only where the exponent moves.
    #[inline]
    fn powered(a: f64, exponent: Self) -> (f64, f64, f64) {
        let n = exponent.value;
        let value = a.powf(n);
        let steepness = if a > 0.0 {
            n * (value / a)
        } else {
            n * a.powf(n - 1.0)
        };
        let by_exponent = if exponent.slope == 0.0 {
            0.0
        } else {
            // aⁿ·ln a goes to 0 with a.
            value * a.max(f64::MIN_POSITIVE).ln() * exponent.slope
        };
        (value, steepness, by_exponent)
    }
}

impl Powers for Dual {
    #[inline]
    fn power(self, exponent: Self) -> Self {
        let (value, steepness, by_exponent) = Self::powered(self.value.clamp(0.0, 1.0), exponent);
        Self {
            value,
            slope: steepness * self.slope + by_exponent,
        }
    }
    #[inline]
    fn raised(self, exponent: Self) -> Self {
        let (value, steepness, by_exponent) = Self::powered(self.value.max(0.0), exponent);
        // Below 0 the power stays 0, and with it its slope.
        let steepness = if self.value < 0.0 { 0.0 } else { steepness };
        Self {
            value,
            slope: steepness * self.slope + by_exponent,
        }
    }
}

impl Scalar for Dual {
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
        let value = self.value.tanh();
        Self {
            value,
            slope: (1.0 - value * value) * self.slope,
        }
    }
    #[inline]
    fn decay(self) -> Self {
        let value = self.value.decay();
        let falls = self.value.heaviside(0.0);
        Self {
            value,
            slope: -falls * value * self.slope,
        }
    }
    #[inline]
    fn sine(self) -> Self {
        let cosine = (self.value + 0.25).sine();
        Self {
            value: self.value.sine(),
            slope: core::f64::consts::TAU * cosine * self.slope,
        }
    }
}
