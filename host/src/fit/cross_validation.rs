//! Cross-validation over contiguous blocks of every record, from moments alone.
//!
//! Neighbouring rows of a record are nearly the same row, so holding out single rows would tell
//! nothing. Every record is cut into [`FOLDS`] blocks; fold k holds out the k-th block of each, so
//! that no fold loses a kind of motion that only one record has. A guard of some rows on either
//! side of a held-out block is used by neither side.

use super::moments::{Moments, Summation};
use crate::model::InputRange;
use faer::MatRef;

/// Blocks that every record is cut into.
pub const FOLDS: usize = 5;

/// The moments of every block, its two edges apart: per fold the first rows of the blocks, the rows
/// between, the last rows.
pub struct Folds(Vec<[Moments; 3]>);

/// [`Folds`] that records are added to.
pub struct FoldedMoments {
    folds: Folds,
    guard_rows: usize,
    summation: Summation,
}

/// Where the parts of a fold's block begin and end in a record of so many rows.
pub(super) fn edges(fold: usize, rows: usize, guard_rows: usize) -> [usize; 4] {
    let (start, end) = (fold * rows / FOLDS, (fold + 1) * rows / FOLDS);
    let guard = guard_rows.min((end - start) / 4);
    [start, start + guard, end - guard, end]
}

/// Rows on either side of a held-out block that are left out: a tenth of a second, more than a
/// cycle of the slowest motions that matter, beside what the filters smear.
pub(super) fn guard_rows(sample_rate_hz: f64, low_pass: &[f64]) -> usize {
    (0.1 * sample_rate_hz) as usize + low_pass.len()
}

impl FoldedMoments {
    /// Of no rows; `guard_rows` on either side of a held-out block are left out, at most a quarter
    /// of a block.
    pub fn new(ranges: &[InputRange], outputs: usize, guard_rows: usize) -> Self {
        let empty = || std::array::from_fn(|_| Moments::new(ranges.len(), outputs));
        Self {
            folds: Folds((0..FOLDS).map(|_| empty()).collect()),
            guard_rows,
            summation: Summation::new(ranges, outputs),
        }
    }

    /// Adds a whole record: one series per input (SI) and per output.
    pub fn add_record(&mut self, inputs: &[&[f64]], outputs: &[&[f64]]) {
        let rows = outputs[0].len();
        fn cut<'a>(series: &[&'a [f64]], from: usize, to: usize) -> Vec<&'a [f64]> {
            series.iter().map(|s| &s[from..to]).collect()
        }
        for (fold, parts) in self.folds.0.iter_mut().enumerate() {
            let edges = edges(fold, rows, self.guard_rows);
            for (part, edge) in parts.iter_mut().zip(edges.windows(2)) {
                let inputs = cut(inputs, edge[0], edge[1]);
                let outputs = cut(outputs, edge[0], edge[1]);
                self.summation.add(part, &inputs, &outputs);
            }
        }
    }

    /// The moments of what was added.
    pub fn folds(&self) -> &Folds {
        &self.folds
    }
}

impl Folds {
    /// Of the parts of every block in their order, three per fold.
    pub(super) fn of_parts(parts: Vec<[Moments; 3]>) -> Self {
        Self(parts)
    }

    /// The moments of all rows of all blocks.
    pub fn total(&self) -> Moments {
        self.sum(|_, _| true)
    }

    /// What fold `fold` is judged on.
    pub fn held_out(&self, fold: usize) -> Moments {
        self.sum(|block, _| block == fold)
    }

    /// What fold `fold` is fitted to: the other blocks, without the edges that touch the held-out
    /// ones. Summed up rather than subtracted from the total, so that no digits cancel.
    pub fn training(&self, fold: usize) -> Moments {
        self.sum(|block, part| {
            let guard = (block + 1 == fold && part == 2) || (block == fold + 1 && part == 0);
            block != fold && !guard
        })
    }

    fn sum(&self, take: impl Fn(usize, usize) -> bool) -> Moments {
        let mut sum: Option<Moments> = None;
        for (block, parts) in self.0.iter().enumerate() {
            for (part, moments) in parts.iter().enumerate() {
                if take(block, part) {
                    match &mut sum {
                        Some(sum) => *sum += moments,
                        None => sum = Some(moments.clone()),
                    }
                }
            }
        }
        sum.unwrap_or_else(|| unreachable!("every fold has blocks inside and outside"))
    }
}

/// Σ (y − φᵀ·b)² from yy = Σ y², c = Σ φ·y and G = Σ φ·φᵀ; never negative.
pub(super) fn squared_error(
    yy: f64,
    gram: MatRef<'_, f64>,
    cross: MatRef<'_, f64>,
    b: MatRef<'_, f64>,
) -> f64 {
    let quadratic = b.transpose() * gram * b;
    let linear = b.transpose() * cross;
    (yy - 2.0 * linear[(0, 0)] + quadratic[(0, 0)]).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::exponents;
    use faer::Mat;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn folds_equal_the_rows_picked_by_hand() {
        let mut rng = ChaCha8Rng::seed_from_u64(41);
        let ranges = [InputRange {
            center: 0.0,
            half_range: 1.0,
        }; 2];
        let guard = 7;
        let mut folded = FoldedMoments::new(&ranges, 1, guard);
        let lengths = [203, 150];
        let records: Vec<Vec<Vec<f64>>> = lengths
            .iter()
            .map(|&n| {
                (0..3)
                    .map(|_| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect())
                    .collect()
            })
            .collect();
        for r in &records {
            folded.add_record(&[&r[0], &r[1]], &[&r[2]]);
        }
        let folded = folded.folds();
        let terms = exponents(&[3, 3]);
        let feature = |r: &Vec<Vec<f64>>, row: usize, t: usize| {
            r[0][row].powi(i32::from(terms[t][0])) * r[1][row].powi(i32::from(terms[t][1]))
        };
        let b = Mat::from_fn(16, 1, |i, _| 0.3 - 0.05 * i as f64);
        for fold in 0..FOLDS {
            let (mut gram, mut rows, mut error) = (Mat::<f64>::zeros(16, 16), 0, 0.0);
            for r in &records {
                let n = r[0].len();
                let (start, end) = (fold * n / FOLDS, (fold + 1) * n / FOLDS);
                for row in 0..n {
                    if (start..end).contains(&row) {
                        let predicted: f64 = (0..16).map(|t| b[(t, 0)] * feature(r, row, t)).sum();
                        error += (r[2][row] - predicted).powi(2);
                    } else if row + guard < start || row >= end + guard {
                        rows += 1;
                        for s in 0..16 {
                            for t in 0..16 {
                                gram[(s, t)] += feature(r, row, s) * feature(r, row, t);
                            }
                        }
                    }
                }
            }
            let training = folded.training(fold);
            assert_eq!(training.rows(), rows);
            assert!((&training.gram(&terms) - &gram).norm_max() < 1e-12 * gram.norm_max());
            let held = folded.held_out(fold);
            let from_moments = squared_error(
                held.square(0),
                held.gram(&terms).as_ref(),
                held.cross(&terms).as_ref(),
                b.as_ref(),
            );
            assert!((from_moments / error - 1.0).abs() < 1e-12);
        }
        assert_eq!(folded.total().rows(), 353);
    }
}
