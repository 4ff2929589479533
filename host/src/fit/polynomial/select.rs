//! The fit with few terms: orthogonal forward selection on the normal equations, as long as
//! cross-validation gains.
//!
//! From the terms of total degree up to 6, each step takes the term that lowers the squared error
//! most, given those already taken. A term's gain is read off the normal equations, from which the
//! chosen terms are eliminated one by one, as in a Cholesky factorisation with pivoting by gain.
//! The number of terms is the smallest whose held-out error is within one standard error of the
//! best. Information criteria such as BIC count rows as independent, which the rows of a record are
//! not, and pick far too many terms.

use crate::fit::cross_validation::{FOLDS, Folds, squared_error};
use crate::fit::least_squares::normal_equations;
use crate::fit::moments::Moments;
use crate::model::exponents;
use crate::text::error::{Result, in_order};
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Highest total degree of a candidate.
const TOTAL_DEGREE: u8 = 6;

/// Most terms that are tried.
const MAX_TERMS: usize = 60;

/// A candidate of which less than this share is left after elimination is a sum of those already
/// chosen.
const DEPENDENT: f64 = 1e-9;

/// The fit of one axis.
#[derive(Clone, Debug)]
pub(super) struct Selection {
    pub(super) coefficients: Vec<f64>,
    pub(super) terms: usize,
    /// Percent of the spread of the held-out rows.
    pub(super) cross_validation_nmse: f64,
}

/// The order in which terms are taken, at most `most` of them; ends when nothing gains.
fn forward(gram: &Mat<f64>, cross: MatRef<'_, f64>, most: usize) -> Vec<usize> {
    let n = gram.nrows();
    let mut residual = gram.clone();
    let mut c: Vec<f64> = (0..n).map(|i| cross[(i, 0)]).collect();
    let mut free = vec![true; n];
    let mut order = Vec::new();
    while order.len() < most {
        let gain = |i: usize| c[i] * c[i] / residual[(i, i)];
        let open = |i: &usize| free[*i] && residual[(*i, *i)] > DEPENDENT * gram[(*i, *i)];
        let Some(best) = (0..n)
            .filter(open)
            .max_by(|a, b| gain(*a).total_cmp(&gain(*b)))
        else {
            break;
        };
        if gain(best) <= 0.0 {
            break;
        }
        let pivot: Vec<f64> = (0..n).map(|i| residual[(i, best)]).collect();
        let (size, share) = (pivot[best], c[best] / pivot[best]);
        for j in 0..n {
            let factor = pivot[j] / size;
            for i in 0..n {
                residual[(i, j)] -= pivot[i] * factor;
            }
            c[j] -= pivot[j] * share;
        }
        free[best] = false;
        order.push(best);
    }
    order
}

/// Least squares with the chosen terms only, scattered over all candidates.
fn refit(gram: &Mat<f64>, cross: MatRef<'_, f64>, chosen: &[usize]) -> Result<Mat<f64>> {
    let n = chosen.len();
    let small = Mat::from_fn(n, n, |i, j| gram[(chosen[i], chosen[j])]);
    let right = Mat::from_fn(n, 1, |i, _| cross[(chosen[i], 0)]);
    let solution = normal_equations::solve(&small, &right)?;
    let mut all = Mat::zeros(gram.nrows(), 1);
    for (i, term) in chosen.iter().enumerate() {
        all[(*term, 0)] = solution.coefficients[(i, 0)];
    }
    Ok(all)
}

/// Squared held-out error of one fold per number of terms, from none on.
fn held_out_errors(
    training: &Moments,
    held: &Moments,
    terms: &[[u8; 4]],
    output: usize,
) -> Result<Vec<f64>> {
    let (gram, cross) = (training.gram(terms), training.cross(terms));
    let (judge, judge_cross) = (held.gram(terms), held.cross(terms));
    let (cross, judge_cross) = (cross.subcols(output, 1), judge_cross.subcols(output, 1));
    let order = forward(&gram, cross, MAX_TERMS.min(terms.len()));
    let mut errors = vec![held.square(output)];
    for count in 1..=order.len() {
        let b = refit(&gram, cross, &order[..count])?;
        errors.push(squared_error(
            held.square(output),
            judge.as_ref(),
            judge_cross,
            b.as_ref(),
        ));
    }
    Ok(errors)
}

/// Chooses and fits the terms of one output.
pub(super) fn fit(folded: &Folds, orders: &[u8], output: usize) -> Result<Selection> {
    let all = exponents(orders);
    let places: Vec<usize> = (0..all.len())
        .filter(|i| all[*i].iter().sum::<u8>() <= TOTAL_DEGREE)
        .collect();
    let terms: Vec<[u8; 4]> = places.iter().map(|i| all[*i]).collect();
    let folds = in_order((0..FOLDS).into_par_iter().map(|fold| {
        held_out_errors(
            &folded.training(fold),
            &folded.held_out(fold),
            &terms,
            output,
        )
    }))?;
    let longest = folds.iter().map(Vec::len).min().unwrap_or(0);
    let mean = |count: usize| folds.iter().map(|fold| fold[count]).sum::<f64>() / FOLDS as f64;
    let best = (0..longest)
        .min_by(|a, b| mean(*a).total_cmp(&mean(*b)))
        .unwrap_or(0);
    // The folds' errors differ because the blocks do; what matters is how they differ in what they
    // gain from more terms.
    let count = (0..=best)
        .find(|count| {
            let excess: Vec<f64> = folds.iter().map(|fold| fold[*count] - fold[best]).collect();
            let average = excess.iter().sum::<f64>() / FOLDS as f64;
            let square: f64 = excess.iter().map(|e| (e - average).powi(2)).sum();
            average <= (square / (FOLDS * (FOLDS - 1)) as f64).sqrt()
        })
        .unwrap_or(best);
    let total = folded.total();
    let (gram, cross) = (total.gram(&terms), total.cross(&terms));
    let cross = cross.subcols(output, 1);
    let order = forward(&gram, cross, count);
    let fitted = refit(&gram, cross, &order)?;
    let mut coefficients = vec![0.0; all.len()];
    for (i, place) in places.iter().enumerate() {
        coefficients[*place] = fitted[(i, 0)];
    }
    Ok(Selection {
        coefficients,
        terms: order.len(),
        cross_validation_nmse: 100.0 * mean(count) * FOLDS as f64
            / total.spread(output).max(f64::MIN_POSITIVE),
    })
}
