//! All values that a quantity can take, and how far the device's number can be from the exact one:
//! bounds for export.

use super::elementary::{DECAY_ERROR, HYPERBOLIC_DECAY_ERROR, SINE_ERROR};
use super::short::{self, POWER_ERROR, RAISED_ERROR};
use super::{Number, Powers, Scalar, q};
use crate::base::tanh;
use core::ops::{Add, Mul, Neg, Sub};

/// A range of exact values together with a bound of |device − exact| over all of them, of a number
/// with so many places behind the point: those of [`q::Q`], or those of [`short::Short`].
///
/// Evaluating a law on intervals bounds its result for every input in the ranges, with the rounding
/// of the device added operation by operation. The same quantity used twice counts as two, so
/// ranges can come out wider than they are. `f64`'s own rounding, 2⁻⁵³ of a value, is far under the
/// device's and is left out. A comparison ([`Number::heaviside`]) is taken to fall alike on both
/// sides: inputs closer to a threshold than the error itself are outside the bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<const PLACES: u32 = { q::PLACES }> {
    /// The smallest exact value.
    pub least: f64,
    /// The largest exact value.
    pub most: f64,
    /// Bound of |device − exact|.
    pub error: f64,
    /// The largest part of what the device's kind of number can hold that anything computed on the
    /// way to it takes, exact or on the device: from 1 on it may have saturated.
    pub fullest: f64,
}

impl<const PLACES: u32> Interval<PLACES> {
    /// The value of one unit.
    const UNIT: f64 = 1.0 / (1_u64 << PLACES) as f64;
    /// What the device's numbers stay below in size: they have 63 bits beside the sign, or 31.
    const ROOM: f64 = if PLACES == short::PLACES {
        (1_u64 << (31 - PLACES)) as f64
    } else {
        (1_u64 << (63 - PLACES)) as f64
    };

    /// A quantity that the device holds as the number nearest to `value`.
    pub fn stored(value: f64) -> Self {
        Self::range(value, value, 0.5 * Self::UNIT)
    }

    /// All values between two, each known to the device within `error`.
    pub fn range(least: f64, most: f64, error: f64) -> Self {
        Self::from(least, most, error, &[])
    }

    /// The range as given, with how full its own number is and those that it came from were.
    fn from(least: f64, most: f64, error: f64, before: &[Self]) -> Self {
        let before = before.iter().fold(0.0, |most: f64, i| most.max(i.fullest));
        let mut made = Self {
            least,
            most,
            error,
            fullest: before,
        };
        made.fullest = before.max(made.magnitude() / Self::ROOM);
        made
    }

    /// The same quantity as a number of another kind, within this error.
    fn converted<const FROM: u32>(from: Interval<FROM>, error: f64) -> Self {
        let mut made = Self::range(from.least, from.most, error);
        made.fullest = made.fullest.max(from.fullest);
        made
    }

    /// The smallest magnitude, exact or on the device.
    fn nearest_to_zero(self) -> f64 {
        (self.least.max(-self.most) - self.error).max(0.0)
    }

    /// The largest magnitude, exact or on the device.
    pub fn magnitude(self) -> f64 {
        self.least.abs().max(self.most.abs()) + self.error
    }
}

impl<const PLACES: u32> Add for Interval<PLACES> {
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

impl<const PLACES: u32> Sub for Interval<PLACES> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const PLACES: u32> Neg for Interval<PLACES> {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            least: -self.most,
            most: -self.least,
            ..self
        }
    }
}

impl<const PLACES: u32> Mul for Interval<PLACES> {
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
            + 0.5 * Self::UNIT;
        Self::from(
            corners.into_iter().fold(f64::INFINITY, f64::min),
            corners.into_iter().fold(f64::NEG_INFINITY, f64::max),
            error,
            &[self, other],
        )
    }
}

impl<const PLACES: u32> Number for Interval<PLACES> {
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
    fn heaviside(self, threshold: Self) -> Self {
        Self::from(
            self.least.heaviside(threshold.most),
            self.most.heaviside(threshold.least),
            0.0,
            &[self, threshold],
        )
    }
    fn flip_sign(self, direction: Self) -> Self {
        let (mut least, mut most) = (self.least, self.most);
        if direction.least < 0.0 {
            (least, most) = (least.min(-most), most.max(-least));
        }
        Self::from(least, most, self.error, &[self, direction])
    }
    fn half(self) -> Self {
        let error = 0.5 * (self.error + Self::UNIT);
        Self::from(self.least.half(), self.most.half(), error, &[self])
    }
}

impl Powers for Interval<{ short::PLACES }> {
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
    fn raised(self, exponent: Self) -> Self {
        // What the device's numbers can be; a power is monotonic in each of its two numbers, and so
        // is its slope.
        let a = [(self.least - self.error).max(0.0), self.most + self.error];
        let n = [
            exponent.least - exponent.error,
            exponent.most + exponent.error,
        ];
        let corners = |a: [f64; 2], n: [f64; 2], of: fn(f64, f64) -> f64| {
            let all = a.map(|a| n.map(|n| of(a, n)));
            let [least, most] = [f64::min, f64::max];
            let all = all.into_iter().flatten();
            [all.clone().fold(f64::INFINITY, least), all.fold(0.0, most)]
        };
        let [_, steepest] = corners(a, n, |a, n| n.abs() * a.powf(n - 1.0));
        let [_, largest] = corners(a, n, f64::powf);
        let by_exponent = if n[0] > 0.0 {
            // |aⁿ·ln a| is at most 1/(e·n) up to 1, and grows beyond.
            (0.37 / n[0]).max(largest * a[1].max(1.0).ln())
        } else {
            largest * a[0].ln().abs().max(a[1].ln().abs())
        };
        let size = n[0].abs().max(n[1].abs());
        let error = steepest * self.error
            + by_exponent * exponent.error
            + (1.0 + size) * largest * RAISED_ERROR
            + POWER_ERROR;
        let range = [self.least.max(0.0), self.most.max(0.0)];
        let [least, most] = corners(range, [exponent.least, exponent.most], f64::powf);
        Self::from(least, most, error, &[self, exponent])
    }
}

impl Scalar for Interval {
    type Short = Interval<{ short::PLACES }>;

    fn short(self) -> Self::Short {
        Interval::converted(self, self.error + 0.5 * Self::Short::UNIT)
    }
    fn long(short: Self::Short) -> Self {
        Self::converted(short, short.error)
    }
    fn tanh(self) -> Self {
        // The slope is at most 1; the argument loses five places on its way into the table.
        let error = self.error + 16.0 * Self::UNIT + tanh::MAX_ERROR;
        Self::from(self.least.tanh(), self.most.tanh(), error, &[self])
    }
    fn change(self, step: Self, factor: Self) -> Self {
        // Two values of one number, each anywhere in its range and known within its error: the
        // difference of the products has the range of the step's product and the error of
        // both.
        let (range, product) = (step * factor, self * factor);
        let error = 2.0 * product.error;
        Self::from(range.least, range.most, error, &[range, product])
    }
    fn short_change(self, step: Self, factor: Self, limit: Self::Short) -> Self::Short {
        let mut change = self.change(step, factor);
        let most = limit.most;
        (change.least, change.most) = (change.least.max(-most), change.most.min(most));
        // The factor is one number in both products: what it is off by shows in the step alone, and
        // in none beyond what is held.
        let furthest = step.magnitude().min(most / factor.nearest_to_zero());
        let position = 2.0 * (factor.magnitude() * self.error + 0.5 * Self::UNIT);
        let error = change.error.min(position + furthest * factor.error);
        // Each of both products is cut to a short number, both to the same side; what is held
        // cannot be off by more than what it is held between.
        let error = (error + Self::Short::UNIT).min(2.0 * most);
        Interval::converted(change, error)
    }
    fn decay(self) -> Self {
        // The slope is at most the value at the smallest argument.
        let steepest = (self.least - self.error).decay();
        let error = steepest * self.error + DECAY_ERROR;
        Self::from(self.most.decay(), self.least.decay(), error, &[self])
    }
    fn hyperbolic_decay(self) -> Self {
        // The slope is at most the square of the value at the smallest argument.
        let largest = (self.least - self.error).hyperbolic_decay();
        let error = largest * largest * self.error + HYPERBOLIC_DECAY_ERROR;
        Self::from(
            self.most.hyperbolic_decay(),
            self.least.hyperbolic_decay(),
            error,
            &[self],
        )
    }
    fn sine(self) -> Self {
        let error = core::f64::consts::TAU * self.error + SINE_ERROR;
        Self::from(-1.0, 1.0, error, &[self])
    }
}
