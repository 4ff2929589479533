//! How sure the parameters are: intervals that hold although the residual is not white.
//!
//! The covariance of the least-squares parameters is G⁻¹·M·G⁻¹ with G = JᵀJ and M the long-run
//! covariance of the rows' scores J_t·e_t, summed over lags with falling weights (Newey and West,
//! Econometrica 55 (1987) 703–708). Noise of the sensors, counts of the encoders and whatever the
//! effects miss make the residual of neighbouring rows alike; counting rows as independent would
//! promise intervals several times too narrow.

use super::projection::{Problem, Solved, product};
use crate::fit::least_squares::normal_equations::Cholesky;
use faer::Mat;

/// 97.5 % of the normal distribution: the intervals cover the truth in 95 of 100 experiments.
pub(crate) const QUANTILE: f64 = 1.959_964;
/// Autocorrelation of the residual below which two rows count as independent.
const INDEPENDENT: f64 = 0.05;
/// The sum over lags goes on to this many times the lag at which rows become independent.
const LAGS: usize = 3;

/// Standard errors, or nothing where the records do not determine the parameters. That of a
/// parameter that changes nothing is not a number.
pub(crate) struct Errors {
    /// Of every linear unknown, terms first, then inertias; SI.
    pub(crate) linear: Vec<f64>,
    /// Of the logarithm of every shape.
    pub(crate) shapes: Vec<f64>,
}

/// The standard errors at the solution.
pub(crate) fn errors(problem: &Problem<'_>, solved: &Solved) -> Option<Errors> {
    let mut design = problem.design(solved);
    let unknowns = design.ncols() - 1;
    // Columns of length 1: parameters of very different size then stand beside each other.
    let lengths: Vec<f64> = (0..unknowns).map(|c| design.col(c).norm_l2()).collect();
    // What is given and not found has no slope, and no error.
    let linear = solved.columns.len();
    let given = |c: usize| {
        let unknown = c.checked_sub(linear).map(|shape| &problem.shapes[shape]);
        unknown.is_some_and(|unknown| unknown.shape.is_given())
    };
    if lengths.iter().any(|l| l.is_nan()) {
        return None;
    }
    // Nor has what changes nothing, as a strength that is held at its bound and the shapes of its
    // law.
    let idle: Vec<bool> = lengths.iter().map(|l| *l <= 0.0).collect();
    let lengths = lengths.iter().map(|l| if *l <= 0.0 { 1.0 } else { *l });
    let lengths: Vec<f64> = lengths.collect();
    for (c, length) in lengths.iter().enumerate() {
        design.col_mut(c).iter_mut().for_each(|v| *v /= length);
    }
    let residual: Vec<f64> = design.col(unknowns).iter().copied().collect();
    let jacobian = design.subcols(0, unknowns).to_owned();
    let mut gram = product(&jacobian, &jacobian);
    for c in (0..unknowns).filter(|&c| idle[c]) {
        gram[(c, c)] = 1.0;
    }

    let rows = problem.records.rows_per_axis();
    let axes = problem.weights.len();
    // Both axes' scores of one instant belong together.
    let scores = Mat::from_fn(rows, unknowns, |row, c| {
        (0..axes)
            .map(|axis| jacobian[(axis * rows + row, c)] * residual[axis * rows + row])
            .sum::<f64>()
    });
    let lags = lags(&residual, &problem.records.rows, axes);
    let mut long_run = product(&scores, &scores);
    for lag in 1..=lags {
        let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
        let mut start = 0;
        for &count in &problem.records.rows {
            if count > lag {
                let later = scores.subrows(start + lag, count - lag).to_owned();
                let earlier = scores.subrows(start, count - lag).to_owned();
                let both = product(&later, &earlier);
                long_run += weight * (&both + both.transpose());
            }
            start += count;
        }
    }
    // Parameters cost degrees of freedom, as for independent rows.
    let left = rows * axes;
    let correction = left as f64 / (left.saturating_sub(unknowns)).max(1) as f64;
    let factor = Cholesky::new(gram)?;
    let mut half = long_run;
    factor.solve(half.as_mut());
    let mut covariance = half.transpose().to_owned();
    factor.solve(covariance.as_mut());
    let error = |c: usize| match idle[c] && !given(c) {
        true => f64::NAN,
        false => (correction * covariance[(c, c)].max(0.0)).sqrt() / lengths[c],
    };
    Some(Errors {
        linear: (0..linear).map(error).collect(),
        shapes: (linear..unknowns).map(error).collect(),
    })
}

/// To which lag neighbouring rows have to be counted together.
fn lags(residual: &[f64], records: &[usize], axes: usize) -> usize {
    let shortest = records.iter().copied().min().unwrap_or(0);
    let most = (shortest / 8).clamp(1, 400);
    let per_axis: usize = records.iter().sum();
    let product = |axis: usize, lag: usize| {
        let mut start = axis * per_axis;
        let mut sum = 0.0;
        for &count in records {
            let part = &residual[start..start + count];
            let pairs = part.iter().zip(part.iter().skip(lag));
            sum += pairs.map(|(a, b)| a * b).sum::<f64>();
            start += count;
        }
        sum
    };
    let independent = |axis: usize| {
        let whole = product(axis, 0);
        (1..most)
            .find(|&lag| product(axis, lag).abs() < INDEPENDENT * whole)
            .unwrap_or(most)
    };
    let longest = (0..axes).map(independent).max().unwrap_or(1);
    (LAGS * longest).min(most)
}
