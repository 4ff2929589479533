//! Whether what a model leaves over follows the motion in a way that no effect of the library does.
//!
//! Noise does not follow the motion. Of a few kinds of laws that the library does not have it is asked, therefore, whether they explain
//! much of what is left, on blocks that were not fitted to: then something is missing, however loud the noise beside it is, and the
//! kind says where to look for it.

use super::candidates::Beside;
use super::held_out::{Gain, HeldOut, Worth, held_out};
use super::judge::{MIN_MISSING, WRONG_BY};
use super::linear_memory;
use super::tolerances;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::{Records, Sample};
use crate::model::effects::Bound;
use crate::model::mains_hum;
use faer::Mat;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A polynomial has to explain this part of what is left: a model's small faults are in part one.
const MIN_STATIC: Worth = Worth {
    part: 0.4,
    share: WRONG_BY,
};
/// Its degree.
const DEGREE: i32 = 3;
/// A stiffness or a friction that changes has to explain this part; what else is left does not look like one.
const MIN_CHANGING: Worth = Worth {
    part: 0.1,
    share: WRONG_BY,
};
/// The slowest swings of a stiffness and of a friction, Hz: a slower one of the stiffness is a drift.
const SLOWEST_HZ: [f64; 2] = [1.0, 0.2];
/// What is small beside what was found, RMS beside RMS.
const OF_EXPLAINED: f64 = 0.25;
/// Speed beside the largest one over which dry friction turns its sign.
const EDGE: f64 = 0.05;

/// A solved model with what it leaves over, to hold columns against.
pub(super) struct LeftOver<'a> {
    pub(super) records: &'a Records<'a>,
    pub(super) terms: &'a [Bound],
    pub(super) solution: &'a Solution,
    beside: Beside<'a>,
    without: HeldOut,
    /// Weighted, with everything taken out that the model can take up.
    residual: Mat<f64>,
}

impl<'a> LeftOver<'a> {
    /// `within` are the effects of instruments that are within their tolerances. Nothing when the model's columns depend on each other.
    pub(super) fn new(
        records: &'a Records<'a>,
        terms: &'a [Bound],
        solution: &'a Solution,
        within: &[Bound],
    ) -> Option<Self> {
        let columns = tolerances::columns(records, within);
        let beside = Beside::new(records, terms, solution, columns)?;
        let without = held_out(records, &beside, None, solution.weights.len())?;
        Some(Self {
            records,
            terms,
            solution,
            residual: beside.left(),
            beside,
            without,
        })
    }

    /// What columns explain of it on an axis, on blocks that were not fitted to.
    pub(super) fn explained_by(&self, axis: usize, columns: &[Vec<f64>]) -> Option<(Worth, Gain)> {
        let columns = self.beside.unit_columns(columns);
        let axes = self.solution.weights.len();
        let with = held_out(self.records, &self.beside, Some(&columns), axes)?;
        let worth = with.worth(&self.without, axis, self.records, self.solution);
        Some((worth, with.better_than(&self.without)))
    }

    /// What columns explain, if it is at least so much of what is left and of the force.
    fn worth(&self, axis: usize, least: Worth, columns: &[Vec<f64>]) -> Option<Worth> {
        let (worth, gain) = self.explained_by(axis, columns)?;
        let much = worth.part >= least.part && worth.share >= least.share && gain.is_sure();
        much.then_some(worth)
    }
}

/// A way in which what is left follows the motion.
pub(crate) struct Pattern {
    /// Of which axis.
    pub(crate) axis: usize,
    /// Which.
    pub(crate) words: String,
    /// Whether something is missing for its sake that the library does not have; not where it is small beside what the effects explain that
    /// were found: they are what was missing, and not quite the whole law.
    pub(crate) decides: bool,
}

/// The way in which most of what is left on an axis follows the motion, for every axis on which any does. `found` are the effects that the search added,
/// `explained` what they explain, RMS beside the RMS force of the axis.
pub(super) fn found_in(left: &LeftOver<'_>, found: &[Bound], explained: &[f64]) -> Vec<Pattern> {
    let of_axis = |axis: usize| {
        let softened = |m: &Sample| m.displacement * m.largest;
        let softened = [left.records.of_motion(axis, None, softened)];
        // One column with nothing to seek is held to what an effect is, where no effect may have left it over.
        let least_softened = if found.iter().any(|bound| bound.acts_on(axis)) {
            MIN_CHANGING
        } else {
            MIN_MISSING
        };
        let (hz, stiffness) = swinging(left, axis, SLOWEST_HZ[0], |m| m.displacement);
        let edge = EDGE * left.records.references.velocity[axis];
        let direction = |m: &Sample| m.velocity / m.velocity.hypot(edge);
        let (friction_hz, friction) = swinging(left, axis, SLOWEST_HZ[1], direction);
        let kinds = [
            (
                linear_memory::worth(left, axis, found, explained[axis]),
                "what is left follows from the displacements of the last moments: a feedback with a delay, or elements in series that \
                 the library does not have"
                    .to_string(),
            ),
            (
                left.worth(axis, MIN_STATIC, &polynomial(left.records, axis)),
                "what is left follows from displacement and velocity of the same moment by a law that the library does not have, such \
                 as damping that grows with the displacement"
                    .to_string(),
            ),
            (
                left.worth(axis, least_softened, &softened),
                "what is left is in part a stiffness that changes with the largest excursion so far"
                    .to_string(),
            ),
            (
                left.worth(axis, MIN_CHANGING, &stiffness),
                format!("what is left is in part a stiffness that swings {hz:.2} times a second"),
            ),
            (
                left.worth(axis, MIN_CHANGING, &friction),
                format!("what is left is in part a dry friction that swings {friction_hz:.2} times a second"),
            ),
        ];
        let memory = kinds[0].0.is_some();
        let there = kinds
            .into_iter()
            .filter_map(|(worth, words)| Some((worth?, words)));
        let most = there.max_by(|a, b| a.0.part.total_cmp(&b.0.part));
        most.map(|(worth, words)| Pattern {
            axis,
            words,
            decides: memory || worth.share >= OF_EXPLAINED * explained[axis],
        })
    };
    let axes = (0..explained.len()).into_par_iter();
    axes.filter_map(of_axis).collect()
}

/// The products of powers of an axis's displacement and velocity.
fn polynomial(records: &Records<'_>, axis: usize) -> Vec<Vec<f64>> {
    let (x, v) = (
        records.references.displacement[axis],
        records.references.velocity[axis],
    );
    let powers = (0..=DEGREE).flat_map(|i| (0..=DEGREE - i).map(move |j| (i, j)));
    let powers = powers.filter(|(i, j)| i + j > 0);
    powers
        .map(|(i, j)| {
            records.of_motion(axis, None, |m| {
                (m.displacement / x).powi(i) * (m.velocity / v).powi(j)
            })
        })
        .collect()
}

/// The frequency, Hz, from `slowest_hz` on at which a force on an axis swings most in what is left, and the columns of such a
/// force: sine and cosine of every record.
fn swinging(
    left: &LeftOver<'_>,
    axis: usize,
    slowest_hz: f64,
    force: impl Fn(&Sample) -> f64,
) -> (f64, Vec<Vec<f64>>) {
    let records = left.records;
    let mut start = axis * records.rows_per_axis();
    let steady = records.of_motion(axis, None, &force);
    let product = records.rows.iter().map(|&count| {
        start += count;
        let rows = start - count..start;
        rows.map(|row| left.residual[(row, 0)] * steady[row])
            .collect()
    });
    let product: Vec<Vec<f64>> = product.collect();
    let product: Vec<&[f64]> = product.iter().map(Vec::as_slice).collect();
    let hz = mains_hum::strongest_from(slowest_hz, &product, records.thinned_rate_hz);
    let columns = (0..records.rows.len()).flat_map(|record| {
        [0.0, mains_hum::QUARTER].map(|phase| {
            records.of_motion(axis, Some(record), |m| {
                force(m) * (TAU * (hz * m.time_s + phase)).sin()
            })
        })
    });
    (hz, columns.collect())
}
