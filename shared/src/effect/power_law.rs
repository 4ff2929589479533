//! What the laws with a power share: the power of a number of either sign, the search for its
//! exponent, and the motion that it is relative to.

use super::about::{Parameter, Role, Shape};
use crate::scalar::{Number, Powers, Scalar};
use crate::units::Dimension;

/// A power below 1 is infinitely steep at 0, and a device has no such number: within this part of
/// the reference it is a straight line.
const STRAIGHT: i32 = 256;

/// |u|ⁿ·sgn u; within ±1/256 the straight line to there.
pub(super) fn signed_power<S: Scalar>(u: S, exponent: S) -> S {
    let size = u.abs().short().max(S::Short::ratio(1, STRAIGHT));
    let sign = (u * S::ratio(STRAIGHT, 1)).within(S::one());
    S::long(size.raised(exponent.short())) * sign
}

/// The exponent of a law.
pub(super) const fn exponent(starts: &'static [f64], least: f64, most: f64) -> Parameter {
    Parameter {
        name: "exponent",
        symbol: "p",
        meaning: "power: 1 is a straight line, below 1 it flattens, above 1 it steepens",
        dimension: Dimension::NONE,
        role: Role::Shape(Shape {
            starts,
            least,
            most,
            reciprocal: false,
            tie: None,
        }),
    }
}

/// The motion at which the power is 1. It is not found: it is the largest in the training records,
/// so that the strength is a force.
pub(super) const fn reference(
    name: &'static str,
    symbol: &'static str,
    meaning: &'static str,
    dimension: Dimension,
) -> Parameter {
    Parameter {
        name,
        symbol,
        meaning,
        dimension,
        role: Role::Shape(Shape::given(&[1.0])),
    }
}
