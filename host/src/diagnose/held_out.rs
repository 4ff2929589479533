//! How much an effect explains on stretches of the records that it was not fitted to.

use super::candidates::Beside;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::product;
use crate::fit::normal_equations::Cholesky;
use faer::Mat;

/// Length of a block, s: longer than a cycle of the slowest motion that matters.
const BLOCK_S: f64 = 1.0;
/// Fewer blocks than this say nothing.
pub(crate) const MIN_BLOCKS: usize = 6;

/// Held-out errors, block by block.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldOut {
    /// `[block][axis]`: Σ (weighted residual)² of the rows that were left out.
    pub(crate) errors: Vec<Vec<f64>>,
}

impl HeldOut {
    /// Over all blocks, per axis.
    pub(crate) fn per_axis(&self) -> Vec<f64> {
        let axes = self.errors.first().map_or(0, Vec::len);
        (0..axes)
            .map(|axis| self.errors.iter().map(|block| block[axis]).sum())
            .collect()
    }

    /// What these take away from the errors of `without` on an axis.
    pub(crate) fn worth(
        &self,
        without: &Self,
        axis: usize,
        records: &Records<'_>,
        solution: &Solution,
    ) -> Worth {
        let before = without.per_axis()[axis];
        let drop = before - self.per_axis()[axis];
        let rows = records.rows_per_axis() as f64;
        let rms = (drop.max(0.0) / rows).sqrt() / solution.weights[axis];
        Worth {
            part: drop / before.max(f64::MIN_POSITIVE),
            share: rms / records.references.force[axis],
        }
    }

    /// By how much the errors of `other` exceed these.
    pub(crate) fn better_than(&self, other: &Self) -> Gain {
        let differences: Vec<f64> = other
            .errors
            .iter()
            .zip(&self.errors)
            .map(|(b, a)| b.iter().sum::<f64>() - a.iter().sum::<f64>())
            .collect();
        let count = differences.len() as f64;
        let sum: f64 = differences.iter().sum();
        let mean = sum / count;
        let variance: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
        let won: f64 = differences.iter().filter(|d| **d > 0.0).sum();
        let mut largest = differences;
        largest.sort_by(|a, b| b.total_cmp(a));
        let without = |best: usize| sum - largest.iter().take(best).sum::<f64>();
        Gain {
            sum,
            error: (variance * count / (count - 1.0).max(1.0)).sqrt(),
            lost: won - sum,
            without_best: without(1),
            without_two: without(2),
        }
    }
}

/// What something takes away from held-out errors on an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Worth {
    /// Part of their power.
    pub(crate) part: f64,
    /// RMS beside the RMS of the force.
    pub(crate) share: f64,
}

/// What an effect gains on held-out blocks, Σ (weighted residual)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    /// Over all blocks.
    pub(crate) sum: f64,
    /// Standard error of the sum, blocks taken as alike.
    pub(crate) error: f64,
    /// What is lost in the blocks in which it does harm.
    pub(crate) lost: f64,
    /// What is left of the sum without the block in which it helps most,
    pub(crate) without_best: f64,
    /// and without the two in which it does.
    pub(crate) without_two: f64,
}

impl Gain {
    /// Whether it is more than chance: many standard errors; or, for an effect that acts in a few blocks only (a stop that is
    /// seldom met), next to no harm anywhere and help that does not hang on one or two blocks.
    pub(crate) fn is_sure(&self) -> bool {
        self.sum > SURE * self.error || (self.is_harmless() && self.without_two > SHARED * self.sum)
    }

    /// Whether it does next to no harm anywhere, and helps in two blocks at least: each was predicted from the other.
    pub(crate) fn is_repeated(&self) -> bool {
        self.is_harmless() && self.without_best > SHARED * self.sum
    }

    fn is_harmless(&self) -> bool {
        self.lost < HARMLESS * self.sum
    }
}

/// Standard errors that make a gain sure.
const SURE: f64 = 2.8;
/// Harm that counts as none, as a part of the gain.
const HARMLESS: f64 = 0.05;
/// What blocks other than the best must contribute, as a part of the gain.
const SHARED: f64 = 0.1;

/// The rows of every block, `(start, count)` within one axis.
pub(crate) fn blocks(records: &Records<'_>) -> Vec<(usize, usize)> {
    let rows = (BLOCK_S * records.thinned_rate_hz).round().max(1.0) as usize;
    let mut blocks = Vec::new();
    let mut start = 0;
    for &count in &records.rows {
        let parts = (count / rows).max(1);
        for part in 0..parts {
            let (from, to) = (part * count / parts, (part + 1) * count / parts);
            blocks.push((start + from, to - from));
        }
        start += count;
    }
    blocks
}

/// Fits the residual with the model's own columns and `more` ones on all blocks but one, in turn.
///
/// Nothing when the columns depend on each other.
pub(crate) fn held_out(
    records: &Records<'_>,
    beside: &Beside<'_>,
    more: Option<&Mat<f64>>,
    axes: usize,
) -> Option<HeldOut> {
    let own = beside.own.ncols();
    let extra = more.map_or(0, Mat::ncols);
    let rows = records.rows_per_axis();
    let design = Mat::from_fn(axes * rows, own + extra + 1, |r, c| {
        if c < own {
            beside.own[(r, c)]
        } else if c < own + extra {
            more.map_or(0.0, |more| more[(r, c - own)])
        } else {
            beside.residual[(r, 0)]
        }
    });
    let unknowns = own + extra;
    let grams: Vec<Vec<Mat<f64>>> = blocks(records)
        .into_iter()
        .map(|(start, count)| {
            (0..axes)
                .map(|axis| {
                    let part = design.subrows(axis * rows + start, count).to_owned();
                    product(&part, &part)
                })
                .collect()
        })
        .collect();
    let mut total = Mat::<f64>::zeros(unknowns + 1, unknowns + 1);
    grams.iter().flatten().for_each(|gram| total += gram);
    let mut errors = Vec::new();
    for block in &grams {
        let mut rest = total.clone();
        block.iter().for_each(|gram| rest -= gram);
        let mut matrix = rest.submatrix(0, 0, unknowns, unknowns).to_owned();
        for c in 0..unknowns {
            matrix[(c, c)] += 1e-9;
        }
        let mut factors = rest.submatrix(0, unknowns, unknowns, 1).to_owned();
        Cholesky::new(matrix)?.solve(factors.as_mut());
        let error = |gram: &Mat<f64>| {
            let inner = gram.submatrix(0, 0, unknowns, unknowns) * &factors;
            let mut error = gram[(unknowns, unknowns)];
            for c in 0..unknowns {
                error += factors[(c, 0)] * (inner[(c, 0)] - 2.0 * gram[(c, unknowns)]);
            }
            error.max(0.0)
        };
        errors.push(block.iter().map(error).collect());
    }
    Some(HeldOut { errors })
}
