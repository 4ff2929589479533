//! Levenberg–Marquardt: steps down a sum of squares, damped until they lead down.

use super::normal_equations;
use crate::text::error::Result;
use faer::Mat;

/// A step that gains less than this part of the cost ends a search: chance adds far more to it.
pub(crate) const SMALL_GAIN: f64 = 1e-6;

/// Why a search stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Nothing had to be searched for.
    Direct,
    /// The unknowns no longer changed.
    Converged,
    /// The allowed number of steps was used up.
    GaveUp,
}

/// A sum of squares that unknowns make smaller.
pub(crate) trait SumOfSquares {
    /// Values of the unknowns with what follows from them.
    type Point;
    /// What a step from a point needs to know.
    type Linearised;

    /// The sum of squares at a point; a point that cannot be has an infinite one.
    fn cost(&self, point: &Self::Point) -> f64;

    /// How the residual changes at a point.
    ///
    /// # Errors
    /// One sentence when nothing finite comes of it.
    fn linearised(&self, point: &Self::Point) -> Result<Self::Linearised>;

    /// JᵀJ and Jᵀe of the unknowns, beside each other; e is what is left.
    fn normal<'a>(&self, linearised: &'a Self::Linearised) -> &'a Mat<f64>;

    /// The point that a step leads to, which may be held within bounds; none when that is no
    /// change.
    ///
    /// # Errors
    /// As [`SumOfSquares::linearised`].
    fn stepped(
        &self,
        point: &Self::Point,
        linearised: &Self::Linearised,
        step: &[f64],
    ) -> Result<Option<Self::Point>>;
}

/// Takes out of JᵀJ and Jᵀe, beside each other, the unknowns that a bound keeps from going where
/// they would, `is_held` of an unknown and the sign of its step: they stay there, and the others go
/// as if they were known.
pub(crate) fn hold(normal: &mut Mat<f64>, is_held: impl Fn(usize, f64) -> bool) {
    let unknowns = normal.nrows();
    for held in 0..unknowns {
        if !is_held(held, normal[(held, unknowns)]) {
            continue;
        }
        for other in (0..unknowns).filter(|&other| other != held) {
            normal[(held, other)] = 0.0;
            normal[(other, held)] = 0.0;
        }
        normal[(held, unknowns)] = 0.0;
    }
}

/// Goes down from a point until a step gains less than `small_gain` of the cost, with so many steps
/// at most.
pub(crate) fn descend<S: SumOfSquares>(
    squares: &S,
    start: S::Point,
    steps: usize,
    small_gain: f64,
) -> Result<(S::Point, Stopped)> {
    let mut best = start;
    let mut damping = 1e-3;
    for _ in 0..steps {
        let linearised = squares.linearised(&best)?;
        let normal = squares.normal(&linearised);
        let unknowns = normal.nrows();
        let mut improved = false;
        while damping < 1e10 {
            let mut matrix = normal.subcols(0, unknowns).to_owned();
            for i in 0..unknowns {
                let curvature = normal[(i, i)].max(0.0);
                matrix[(i, i)] += damping * curvature + f64::MIN_POSITIVE;
            }
            let right = normal.subcols(unknowns, 1).to_owned();
            let step = normal_equations::solve(&matrix, &right)?.coefficients;
            let step: Vec<f64> = (0..unknowns).map(|i| step[(i, 0)]).collect();
            let Some(candidate) = squares.stepped(&best, &linearised, &step)? else {
                return Ok((best, Stopped::Converged));
            };
            let (before, after) = (squares.cost(&best), squares.cost(&candidate));
            if after < before {
                let gain = (before - after) / before.max(f64::MIN_POSITIVE);
                best = candidate;
                damping = (damping / 10.0).max(1e-12);
                improved = true;
                if gain < small_gain {
                    return Ok((best, Stopped::Converged));
                }
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            return Ok((best, Stopped::Converged));
        }
    }
    Ok((best, Stopped::GaveUp))
}
