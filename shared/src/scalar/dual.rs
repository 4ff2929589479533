//! A number that carries its derivatives, so that a force law can be differentiated by its
//! parameters without a second text.

use super::{Number, Powers, Scalar};
use core::ops::{Add, Mul, Neg, Sub};

/// A value and its derivatives by N chosen quantities.
///
/// ```
/// use jointwatch_shared::scalar::dual::Dual;
/// let x = Dual::variable(3.0);
/// assert_eq!(x * x + x, Dual { value: 12.0, slopes: [7.0] });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize = 1> {
    /// The value of the function.
    pub value: f64,
    /// d value / d (each of the chosen quantities).
    pub slopes: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number that does not depend on the chosen quantities.
    #[inline]
    pub const fn constant(value: f64) -> Self {
        Self {
            value,
            slopes: [0.0; N],
        }
    }

    /// A function of this number alone, from its value and its derivative there.
    #[inline]
    fn through(self, value: f64, steepness: f64) -> Self {
        Self {
            value,
            slopes: self.slopes.map(|slope| steepness * slope),
        }
    }

    /// The slopes of what depends on this number with one steepness and on another with its own.
    #[inline]
    fn weighed(self, steepness: f64, other: Self, of_other: f64) -> [f64; N] {
        core::array::from_fn(|k| steepness * self.slopes[k] + of_other * other.slopes[k])
    }
}

impl Dual {
    /// The chosen quantity itself.
    #[inline]
    pub const fn variable(value: f64) -> Self {
        Self {
            value,
            slopes: [1.0],
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slopes: core::array::from_fn(|k| self.slopes[k] + other.slopes[k]),
        }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slopes: self.weighed(other.value, other, self.value),
        }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            slopes: self.slopes.map(|slope| -slope),
        }
    }
}

impl<const N: usize> Number for Dual<N> {
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
        self.through(self.value.half(), 0.5)
    }
}

impl<const N: usize> Dual<N> {
    /// aⁿ, where a moves with this number or, below a bound, not at all. Most of a fit's time goes
    /// into these powers, so there is one of them, and a logarithm only where the exponent
    /// moves.
    #[inline]
    fn powered(self, a: f64, moves: bool, exponent: Self) -> Self {
        let n = exponent.value;
        let value = super::powered(a, n);
        let steepness = match (moves, a > 0.0) {
            (false, _) => 0.0,
            (true, true) => n * (value / a),
            (true, false) => n * super::powered(a, n - 1.0),
        };
        if exponent.slopes.iter().all(|slope| *slope == 0.0) {
            return self.through(value, steepness);
        }
        // aⁿ·ln a goes to 0 with a.
        let by_exponent = value * a.max(f64::MIN_POSITIVE).ln();
        Self {
            value,
            slopes: self.weighed(steepness, exponent, by_exponent),
        }
    }
}

impl<const N: usize> Powers for Dual<N> {
    #[inline]
    fn power(self, exponent: Self) -> Self {
        self.powered(self.value.clamp(0.0, 1.0), true, exponent)
    }
    #[inline]
    fn raised(self, exponent: Self) -> Self {
        // Below 0 the power stays 0, and with it its slope.
        self.powered(self.value.max(0.0), self.value >= 0.0, exponent)
    }
}

impl<const N: usize> Scalar for Dual<N> {
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
        self.through(value, 1.0 - value * value)
    }
    #[inline]
    fn decay(self) -> Self {
        let value = self.value.decay();
        let falls = self.value.heaviside(0.0);
        self.through(value, -falls * value)
    }
    #[inline]
    fn hyperbolic_decay(self) -> Self {
        let value = self.value.hyperbolic_decay();
        let falls = self.value.heaviside(0.0);
        self.through(value, -falls * value * value)
    }
    #[inline]
    fn sine(self) -> Self {
        let cosine = (self.value + 0.25).sine();
        self.through(self.value.sine(), core::f64::consts::TAU * cosine)
    }
}
