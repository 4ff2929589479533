//! A small least-squares fit over blocks of rows, with errors from leaving out one block at a time:
//! enough to be sure of a sign.

use crate::study::series::jackknife;
use nalgebra::{DMatrix, DVector};

/// Sums over one block of rows.
struct Block {
    gram: DMatrix<f64>,
    target: DVector<f64>,
}

/// A fit of a target by a few columns and a constant.
pub(crate) struct Linear {
    columns: usize,
    blocks: Vec<Block>,
    target_square: f64,
    target_sum: f64,
    rows: usize,
}

/// The solution of a [`Linear`] fit.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    /// One per column; the constant is left out.
    pub(crate) coefficients: Vec<f64>,
    /// Standard errors of the coefficients, from leaving out one block at a time.
    pub(crate) errors: Vec<f64>,
    /// RMS of coefficient times column, over the target's RMS.
    pub(crate) shares: Vec<f64>,
    /// What is left of the target's variance.
    pub(crate) rest: f64,
    /// The constant and its standard error, over the target's RMS about its mean.
    constant: [f64; 2],
}

impl Fitted {
    /// Whether a coefficient is surely not 0 and explains at least a hundredth of the target.
    pub(crate) fn sure(&self, column: usize) -> bool {
        self.coefficients[column].abs() > 5.0 * self.errors[column] && self.shares[column] > 0.01
    }

    /// Whether the constant is surely not 0 and larger than all that moves in the target.
    pub(crate) fn stands_off(&self) -> bool {
        let [constant, error] = self.constant;
        constant.abs() > f64::max(1.0, 5.0 * error)
    }
}

impl Linear {
    /// For so many columns, the constant not counted.
    pub(crate) fn new(columns: usize) -> Self {
        Self {
            columns,
            blocks: Vec::new(),
            target_square: 0.0,
            target_sum: 0.0,
            rows: 0,
        }
    }

    /// Adds the rows of one record, in blocks.
    pub(crate) fn add(&mut self, columns: &[&[f64]], target: &[f64], blocks: usize) {
        let rows = columns.iter().map(|c| c.len()).min().unwrap_or(0);
        let rows = rows.min(target.len());
        let width = self.columns + 1;
        for block in 0..blocks {
            let (from, to) = (block * rows / blocks, (block + 1) * rows / blocks);
            let mut gram = DMatrix::zeros(width, width);
            let mut sums = DVector::zeros(width);
            let mut row = DVector::from_element(width, 1.0);
            for at in from..to {
                for (cell, column) in row.iter_mut().zip(columns) {
                    *cell = column[at];
                }
                gram.syger(1.0, &row, &row, 1.0);
                sums.axpy(target[at], &row, 1.0);
                self.target_square += target[at] * target[at];
                self.target_sum += target[at];
            }
            self.rows += to - from;
            self.blocks.push(Block { gram, target: sums });
        }
    }

    /// Solves by all columns; `None` where there is too little to tell, or one says nothing of its
    /// own.
    pub(crate) fn solve(&self) -> Option<Fitted> {
        self.solve_from(0)
    }

    /// The same by the columns from this one on; beyond the last, by the constant alone.
    pub(crate) fn solve_from(&self, first: usize) -> Option<Fitted> {
        self.solve_by(&(first..self.columns).collect::<Vec<_>>())
    }

    /// The same by all columns but one, whose coefficient is 0 and unknown.
    pub(crate) fn solve_without(&self, left_out: usize) -> Option<Fitted> {
        let kept: Vec<usize> = (0..self.columns).filter(|c| *c != left_out).collect();
        self.solve_by(&kept)
    }

    /// The same by the columns that are kept.
    fn solve_by(&self, kept: &[usize]) -> Option<Fitted> {
        let used: Vec<usize> = kept.iter().copied().chain([self.columns]).collect();
        let width = used.len();
        let sum_without = |left_out: Option<usize>| {
            let mut gram = DMatrix::zeros(width, width);
            let mut target = DVector::zeros(width);
            for (index, block) in self.blocks.iter().enumerate() {
                if Some(index) != left_out {
                    gram += block.gram.select_rows(&used).select_columns(&used);
                    target += block.target.select_rows(&used);
                }
            }
            (gram, target)
        };
        let count = self.blocks.len();
        if count < 4 || self.rows < 10 * width {
            return None;
        }
        let (gram, target) = sum_without(None);
        let all = solve(&gram, &target)?;
        let parts = (0..count).map(|block| {
            let (gram, target) = sum_without(Some(block));
            solve(&gram, &target)
        });
        let parts: Vec<DVector<f64>> = parts.collect::<Option<_>>()?;
        let explained = all.dot(&target);
        let variance = self.target_square - self.target_sum * self.target_sum / self.rows as f64;
        let rms = (variance / self.rows as f64).sqrt();
        let last = width - 1;
        let constant = [all[last], jackknife(parts.iter().map(|part| part[last]))];
        let mut fitted = Fitted {
            constant: constant.map(|c| c / rms),
            coefficients: vec![0.0; self.columns],
            errors: vec![f64::INFINITY; self.columns],
            shares: vec![0.0; self.columns],
            rest: ((self.target_square - explained) / variance).max(0.0),
        };
        for (i, column) in kept.iter().copied().enumerate() {
            let mean = gram[(last, i)] / self.rows as f64;
            let moving = (gram[(i, i)] / self.rows as f64 - mean * mean).max(0.0);
            fitted.coefficients[column] = all[i];
            fitted.errors[column] = jackknife(parts.iter().map(|part| part[i]));
            fitted.shares[column] = all[i].abs() * (moving * self.rows as f64 / variance).sqrt();
        }
        Some(fitted)
    }
}

/// The smallest part of a column, as a power, that may be its own.
const OWN: f64 = 1e-12;

/// Solves by the lower triangle; `None` when a column says nothing of its own.
fn solve(gram: &DMatrix<f64>, target: &DVector<f64>) -> Option<DVector<f64>> {
    let scales = gram.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| {
        gram[(i, j)] / (scales[i] * scales[j])
    });
    let root = scaled.cholesky()?;
    let own = root.l_dirty().diagonal().map(|own| own * own);
    let solution = root.solve(&target.component_div(&scales));
    (own.min() >= OWN).then(|| solution.component_div(&scales))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_coefficients_come_back_and_what_is_absent_is_not_sure() {
        let wave = |w: f64| -> Vec<f64> { (0..3000).map(|i| (w * f64::from(i)).sin()).collect() };
        let (a, b, c, noise) = (wave(0.02), wave(0.11), wave(0.37), wave(2.9));
        let target: Vec<f64> = (0..3000)
            .map(|i| 3.0 * a[i] - 0.5 * b[i] + 7.0 + 0.05 * noise[i])
            .collect();
        let mut fit = Linear::new(3);
        fit.add(&[&a, &b, &c], &target, 12);
        let found = fit.solve().unwrap();
        assert!((found.coefficients[0] - 3.0).abs() < 1e-3, "{found:?}");
        assert!((found.coefficients[1] + 0.5).abs() < 1e-3, "{found:?}");
        assert!(
            found.sure(0) && found.sure(1) && !found.sure(2),
            "{found:?}"
        );
        assert!(found.rest < 1e-3, "{found:?}");
    }

    #[test]
    fn two_columns_that_are_one_are_refused() {
        let a: Vec<f64> = (0..1000).map(|i| (0.1 * f64::from(i)).sin()).collect();
        let twice: Vec<f64> = a.iter().map(|x| 2.0 * x).collect();
        let mut fit = Linear::new(2);
        fit.add(&[&a, &twice], &a, 8);
        assert!(fit.solve().is_none());
    }
}
