//! What every law with one strength per direction shares: its strengths, and the split of a force
//! of size 1 between them.

use super::about::Parameter;
use crate::scalar::Scalar;
use crate::units::Dimension;

/// A strength that acts in one direction only.
pub(super) const fn strength(
    name: &'static str,
    symbol: &'static str,
    meaning: &'static str,
    dimension: Dimension,
) -> Parameter {
    Parameter::linear(name, symbol, meaning, dimension, true)
}

/// A spring on either side that gives nothing at x = 0: above·(g(x) − g(0)) − below·(g(−x) − g(0)).
pub(super) fn from_rest<S: Scalar>(x: S, [above, below]: [S; 2], g: impl Fn(S) -> S) -> S {
    let at_rest = g(S::zero());
    above * (g(x) - at_rest) - below * (g(-x) - at_rest)
}

/// The force of a law whose force of size 1 is `unit`: forward·max(unit, 0) + backward·min(unit,
/// 0).
pub(super) fn split<S: Scalar>(unit: S, forward: S, backward: S) -> S {
    forward * unit.max(S::zero()) + backward * unit.min(S::zero())
}
