//! All values that a quantity can take, and how far the device's number can be from the exact one: bounds for export.

use super::Scalar;
use super::elementary::{DECAY_ERROR, POWER_ERROR, SINE_ERROR};
use super::q::UNIT;
use crate::tanh;
use core::ops::{Add, Mul, Neg, Sub};

/// A range of exact values together with a bound of |device − exact| over all of them.
///
/// Evaluating a law on intervals bounds its result for every input in the ranges, with the rounding of [`super::q::Q`]
/// added operation by operation. The same quantity used twice counts as two, so ranges can come out wider than they are.
/// `f64`'s own rounding, 2⁻⁵³ of a value, is far under the device's and is left out. A comparison ([`Scalar::reaches`]) is taken to fall
/// alike on both sides: inputs closer to a threshold than the error itself are outside the bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The smallest exact value.
    pub least: f64,
    /// The largest exact value.
    pub most: f64,
    /// Bound of |device − exact|.
    pub error: f64,
    /// The largest magnitude, exact or on the device, of anything computed on the way to it.
    pub largest: f64,
}

impl Interval {
    /// A quantity that the device holds as the number nearest to `value`.
    pub fn stored(value: f64) -> Self {
        Self {
            least: value,
            most: value,
            error: 0.5 * UNIT,
            largest: value.abs() + 0.5 * UNIT,
        }
    }

    /// All values between two, each known to the device within `error`.
    pub fn range(least: f64, most: f64, error: f64) -> Self {
        Self::from(least, most, error, &[])
    }

    /// The range as given, its own magnitude and that of what it came from noted.
    fn from(least: f64, most: f64, error: f64, before: &[Self]) -> Self {
        let before = before.iter().fold(0.0, |most: f64, i| most.max(i.largest));
        let mut made = Self {
            least,
            most,
            error,
            largest: before,
        };
        made.largest = before.max(made.magnitude());
        made
    }

    /// The largest magnitude, exact or on the device.
    pub fn magnitude(self) -> f64 {
        self.least.abs().max(self.most.abs()) + self.error
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::from(
            self.least + other.least,
            self.most + other.most,
            self.error + other.error,
            &[self, other],
        )
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            least: -self.most,
            most: -self.least,
            ..self
        }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let corners = [
            self.least * other.least,
            self.least * other.most,
            self.most * other.least,
            self.most * other.most,
        ];
        let size = |i: &Self| i.least.abs().max(i.most.abs());
        let error = size(&self) * other.error
            + size(&other) * self.error
            + self.error * other.error
            + 0.5 * UNIT;
        Self::from(
            corners.into_iter().fold(f64::INFINITY, f64::min),
            corners.into_iter().fold(f64::NEG_INFINITY, f64::max),
            error,
            &[self, other],
        )
    }
}

impl Scalar for Interval {
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self::stored(f64::ratio(numerator, denominator))
    }
    fn abs(self) -> Self {
        let (a, b) = (self.least.abs(), self.most.abs());
        let holds_zero = self.least <= 0.0 && self.most >= 0.0;
        Self {
            least: if holds_zero { 0.0 } else { a.min(b) },
            most: a.max(b),
            ..self
        }
    }
    fn min(self, other: Self) -> Self {
        Self::from(
            self.least.min(other.least),
            self.most.min(other.most),
            self.error.max(other.error),
            &[self, other],
        )
    }
    fn max(self, other: Self) -> Self {
        -((-self).min(-other))
    }
    fn tanh(self) -> Self {
        // The slope is at most 1; the argument loses five places on its way into the table.
        let error = self.error + 16.0 * UNIT + tanh::MAX_ERROR;
        Self::from(self.least.tanh(), self.most.tanh(), error, &[self])
    }
    fn reaches(self, threshold: Self) -> Self {
        Self::from(
            self.least.reaches(threshold.most),
            self.most.reaches(threshold.least),
            0.0,
            &[self, threshold],
        )
    }
    fn change(self, step: Self, factor: Self) -> Self {
        // Two values of one number, each anywhere in its range and known within its error: the difference of the products has
        // the range of the step's product and the error of both.
        let (range, product) = (step * factor, self * factor);
        let error = 2.0 * product.error;
        Self::from(range.least, range.most, error, &[range, product])
    }
    fn decay(self) -> Self {
        // The slope is at most the value at the smallest argument.
        let steepest = (self.least - self.error).decay();
        let error = steepest * self.error + DECAY_ERROR;
        Self::from(self.most.decay(), self.least.decay(), error, &[self])
    }
    fn power(self, exponent: Self) -> Self {
        // The slope by the number is at most n, by the exponent at most 1/(e·n) ≤ 0.37.
        let highest = exponent.most + exponent.error;
        let error = highest * self.error + 0.37 * exponent.error + POWER_ERROR;
        Self::from(
            self.least.power(exponent.most),
            self.most.power(exponent.least),
            error,
            &[self, exponent],
        )
    }
    fn sine(self) -> Self {
        let error = core::f64::consts::TAU * self.error + SINE_ERROR;
        Self::from(-1.0, 1.0, error, &[self])
    }
}
