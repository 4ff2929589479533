//! Errors on stretches of the training records that a model's linear parameters were not fitted to.
//!
//! Every record is cut into stretches, dealt into [`FOLDS`] folds in turn; those of one fold are
//! left out in turn, with a guard on either side, and predicted from the rest. The shapes of laws,
//! and a network's hidden layer, stay as the whole records gave them; what a shape can change to
//! first order is a column whose factor keeps to where the first order holds.

use super::functions::Functions;
use crate::fit::cross_validation::FOLDS;
use crate::fit::least_squares::bounded;
use crate::fit::polynomial::ridge::ROUNDING;
use faer::Mat;
use faer::linalg::matmul::matmul;
use faer::{Accum, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Stretches of a record in each fold: with fewer, a short record without one of them would hold
/// too little of its motion to learn from.
const ROUNDS: usize = 4;
/// Guard beside what the filters smear, s: more than a cycle of the slowest motions that matter.
const GUARD_S: f64 = 0.1;

/// The rows of every fold: its first rows, those between, its last rows; record after record.
pub(super) struct Folds {
    parts: Vec<[Vec<Range<usize>>; 3]>,
}

impl Folds {
    /// Of records with so many thinned rows each; `smear` is how many rows the low-pass reaches
    /// over.
    pub(super) fn new(records: &[usize], rate_hz: f64, smear: usize) -> Self {
        let guard = (GUARD_S * rate_hz).ceil() as usize + smear;
        let mut parts: Vec<[Vec<Range<usize>>; 3]> =
            (0..FOLDS).map(|_| Default::default()).collect();
        let mut first = 0;
        for &rows in records {
            let count = FOLDS * ROUNDS;
            for stretch in 0..count {
                let (start, end) = (stretch * rows / count, (stretch + 1) * rows / count);
                let guard = guard.min((end - start) / 4);
                let edges = [start, start + guard, end - guard, end];
                for (part, edge) in parts[stretch % FOLDS].iter_mut().zip(edges.windows(2)) {
                    part.push(first + edge[0]..first + edge[1]);
                }
            }
            first += rows;
        }
        Self { parts }
    }

    /// Products of all columns with each other, per fold and part.
    fn grams(&self, columns: &Mat<f64>) -> Vec<[Mat<f64>; 3]> {
        let count = columns.ncols();
        self.parts
            .par_iter()
            .map(|parts| {
                std::array::from_fn(|part| {
                    let mut sum = Mat::zeros(count, count);
                    for rows in &parts[part] {
                        let piece = columns.subrows(rows.start, rows.len());
                        matmul(
                            &mut sum,
                            Accum::Add,
                            piece.transpose(),
                            piece,
                            1.0,
                            Par::Seq,
                        );
                    }
                    sum
                })
            })
            .collect()
    }
}

/// Σ error² of one axis over the held-out stretches of each fold, per λ of the base.
///
/// `columns` are those of the effects on that axis, each with the bounds of its factor; `force` is
/// what all of it is to follow.
pub(super) fn held_out(
    folds: &Folds,
    functions: &Functions,
    axis: usize,
    columns: &[(&[f64], [f64; 2])],
    force: &[f64],
    lambdas: &[f64],
) -> Vec<Vec<f64>> {
    let used = &functions.used[axis];
    let rows = force.len().max(1) as f64;
    let (own, unknowns) = (used.len(), used.len() + columns.len());
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    let bounds = columns.iter().map(|(_, bounds)| *bounds);
    let bounds: Vec<[f64; 2]> = std::iter::repeat_n(free, own).chain(bounds).collect();
    let all = Mat::from_fn(force.len(), unknowns + 1, |row, c| {
        if c < own {
            functions.design[(row, used[c])]
        } else if let Some((column, _)) = columns.get(c - own) {
            column[row]
        } else {
            force[row]
        }
    });
    let grams = folds.grams(&all);
    let sum = |take: &dyn Fn(usize, usize) -> bool| {
        let mut sum = Mat::<f64>::zeros(unknowns + 1, unknowns + 1);
        for (block, parts) in grams.iter().enumerate() {
            for (part, gram) in parts.iter().enumerate() {
                if take(block, part) {
                    sum += gram;
                }
            }
        }
        sum
    };
    let per_fold = |fold: usize| -> Vec<f64> {
        let training = sum(&|block, part| {
            let guard = ((block + 1) % FOLDS == fold && part == 2)
                || (block == (fold + 1) % FOLDS && part == 0);
            block != fold && !guard
        });
        let held = sum(&|block, _| block == fold);
        let error = |&lambda: &f64| {
            let mut products = training.clone();
            let largest = (0..own).map(|i| training[(i, i)]).fold(0.0, f64::max);
            for i in 0..own {
                let penalty = rows * lambda * functions.penalties[used[i]];
                products[(i, i)] += penalty + ROUNDING * largest;
            }
            bounded::left(&held, &bounded::factors(&products, &bounds))
        };
        lambdas.iter().map(error).collect()
    };
    let errors: Vec<Vec<f64>> = (0..FOLDS).into_par_iter().map(per_fold).collect();
    (0..lambdas.len())
        .map(|at| errors.iter().map(|fold| fold[at]).collect())
        .collect()
}
