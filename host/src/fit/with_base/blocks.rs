//! Errors on stretches of the training records that a model's linear parameters were not fitted to.
//!
//! Every record is cut into [`FOLDS`] stretches as for a polynomial alone; those of one fold are
//! left out in turn, with a guard on either side, and predicted from the rest. The shapes of laws,
//! and a network's hidden layer, stay as the whole records gave them; what a shape can change to
//! first order is a column like any other.

use super::functions::Functions;
use crate::fit::cross_validation::{FOLDS, squared_error};
use crate::fit::least_squares::normal_equations::Cholesky;
use crate::fit::polynomial::ridge::ROUNDING;
use faer::Mat;
use faer::linalg::matmul::matmul;
use faer::{Accum, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Guard beside what the filters smear, s: more than a cycle of the slowest motions that matter.
const GUARD_S: f64 = 0.1;
/// Added to the diagonal for columns of mean square 1: keeps apart what the records of a fold do
/// not.
const TRACE: f64 = 1e-9;

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
            for (fold, parts) in parts.iter_mut().enumerate() {
                let (start, end) = (fold * rows / FOLDS, (fold + 1) * rows / FOLDS);
                let guard = guard.min((end - start) / 4);
                let edges = [start, start + guard, end - guard, end];
                for (part, edge) in parts.iter_mut().zip(edges.windows(2)) {
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
/// `columns` are those of the effects on that axis, `force` is what all of it is to follow.
pub(super) fn held_out(
    folds: &Folds,
    functions: &Functions,
    axis: usize,
    columns: &[&[f64]],
    force: &[f64],
    lambdas: &[f64],
) -> Vec<Vec<f64>> {
    let used = &functions.used[axis];
    let rows = force.len().max(1) as f64;
    let scaled: Vec<(&[f64], f64)> = columns
        .iter()
        .map(|column| {
            let square: f64 = column.iter().map(|v| v * v).sum();
            (*column, (square / rows).sqrt())
        })
        .filter(|(_, size)| *size > 0.0)
        .map(|(column, size)| (column, 1.0 / size))
        .collect();
    let (own, unknowns) = (used.len(), used.len() + scaled.len());
    let all = Mat::from_fn(force.len(), unknowns + 1, |row, c| {
        if c < own {
            functions.design[(row, used[c])]
        } else if let Some((column, factor)) = scaled.get(c - own) {
            factor * column[row]
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
            let guard = (block + 1 == fold && part == 2) || (block == fold + 1 && part == 0);
            block != fold && !guard
        });
        let held = sum(&|block, _| block == fold);
        let part = |of: &Mat<f64>, c: usize, columns: usize| {
            of.submatrix(0, c, unknowns, columns).to_owned()
        };
        let error = |&lambda: &f64| {
            let mut matrix = part(&training, 0, unknowns);
            let largest = (0..unknowns).map(|i| matrix[(i, i)]).fold(0.0, f64::max);
            for i in 0..unknowns {
                matrix[(i, i)] += if i < own {
                    rows * lambda * functions.penalties[used[i]] + ROUNDING * largest
                } else {
                    rows * TRACE
                };
            }
            let mut factors = part(&training, unknowns, 1);
            let Some(cholesky) = Cholesky::new(matrix) else {
                return f64::INFINITY;
            };
            cholesky.solve(factors.as_mut());
            let (gram, cross) = (part(&held, 0, unknowns), part(&held, unknowns, 1));
            squared_error(
                held[(unknowns, unknowns)],
                gram.as_ref(),
                cross.as_ref(),
                factors.as_ref(),
            )
        };
        lambdas.iter().map(error).collect()
    };
    let errors: Vec<Vec<f64>> = (0..FOLDS).into_par_iter().map(per_fold).collect();
    (0..lambdas.len())
        .map(|at| errors.iter().map(|fold| fold[at]).collect())
        .collect()
}
