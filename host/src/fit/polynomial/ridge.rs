//! The default fit: least squares with a penalty on what the function does where there are no rows.
//!
//! Plain least squares is free to do anything in the corners of the input box that the records
//! never reached, and that is where its validation error sits. In products of Legendre polynomials
//! of degrees d₁ d₂ d₃ d₄, the penalty λ·Σ Π(1 + dᵢ²)·b² weighs the function's mean square over the
//! whole box, and rough terms and interactions more than plain ones. The constant and the linear
//! terms go free. λ has no unit and is the same for a study in newtons and in kilonewtons;
//! cross-validation picks it for each axis.

use super::legendre::{gram_to_legendre, rows_to_legendre, to_monomials};
use crate::fit::cross_validation::{FOLDS, Folds, squared_error};
use crate::fit::least_squares::normal_equations::Cholesky;
use crate::fit::moments::Moments;
use crate::model::exponents;
use crate::text::error::{Error, Result};
use faer::Mat;
use rayon::prelude::*;

/// Added to every diagonal entry of the mean Gram matrix: rounding of sums of numbers up to 1,
/// nothing more. It keeps directions without data solvable, and their coefficients at zero.
pub(in crate::fit) const ROUNDING: f64 = 1e-13;

/// The λ that are tried: two per decade.
pub(in crate::fit) fn candidates() -> impl Iterator<Item = f64> {
    (-22..=4).map(|half_decade| 10f64.powf(f64::from(half_decade) / 2.0))
}

/// The fit of one axis.
#[derive(Clone, Debug)]
pub(in crate::fit) struct RidgeFit {
    pub(in crate::fit) coefficients: Vec<f64>,
    pub(in crate::fit) lambda: f64,
    pub(in crate::fit) effective_parameters: f64,
    /// Percent of the spread of the held-out rows.
    pub(in crate::fit) cross_validation_nmse: f64,
}

/// Penalty of each term.
pub(in crate::fit) fn weights(orders: &[u8]) -> Vec<f64> {
    let penalty = |term: &[u8; 4]| {
        if term.iter().sum::<u8>() <= 1 {
            0.0
        } else {
            term.iter().map(|d| 1.0 + f64::from(*d).powi(2)).product()
        }
    };
    exponents(orders).iter().map(penalty).collect()
}

/// Mean normal equations in Legendre products.
struct Equations {
    gram: Mat<f64>,
    cross: Mat<f64>,
}

impl Equations {
    fn new(moments: &Moments, orders: &[u8]) -> Self {
        let terms = exponents(orders);
        let mean = faer::Scale(1.0 / moments.rows().max(1) as f64);
        Self {
            gram: gram_to_legendre(moments.gram(&terms) * mean, orders),
            cross: rows_to_legendre(moments.cross(&terms) * mean, orders),
        }
    }

    /// The factor of gram + λ·penalty.
    fn factor(&self, weights: &[f64], lambda: f64) -> Result<Cholesky> {
        let mut matrix = self.gram.clone();
        for (i, weight) in weights.iter().enumerate() {
            matrix[(i, i)] += lambda * weight + ROUNDING * self.gram[(0, 0)];
        }
        Cholesky::new(matrix).ok_or_else(|| {
            Error::data("the records leave even the linear terms of the polynomial undetermined: record more kinds of motion, or lower its orders with --order")
        })
    }

    fn solve(&self, weights: &[f64], lambda: f64) -> Result<Mat<f64>> {
        let mut coefficients = self.cross.clone();
        self.factor(weights, lambda)?.solve(coefficients.as_mut());
        Ok(coefficients)
    }
}

/// Squared error on the held-out rows of one fold, per candidate and output; `None` where the
/// matrix could not be factored.
fn held_out_errors(folded: &Folds, fold: usize, orders: &[u8], outputs: usize) -> Vec<Vec<f64>> {
    let weights = weights(orders);
    let training = Equations::new(&folded.training(fold), orders);
    let held = folded.held_out(fold);
    let judge = Equations::new(&held, orders);
    let rows = held.rows().max(1) as f64;
    let errors = |lambda| {
        let Ok(b) = training.solve(&weights, lambda) else {
            return vec![f64::INFINITY; outputs];
        };
        (0..outputs)
            .map(|y| {
                let (b, cross) = (b.subcols(y, 1), judge.cross.subcols(y, 1));
                rows * squared_error(held.square(y) / rows, judge.gram.as_ref(), cross, b)
            })
            .collect()
    };
    candidates().map(errors).collect()
}

/// Fits every output with its own λ.
pub(in crate::fit) fn fit(folded: &Folds, orders: &[u8], outputs: usize) -> Result<Vec<RidgeFit>> {
    let folds: Vec<_> = (0..FOLDS)
        .into_par_iter()
        .map(|fold| held_out_errors(folded, fold, orders, outputs))
        .collect();
    let total = folded.total();
    let equations = Equations::new(&total, orders);
    let weights = weights(orders);
    let rows = total.rows().max(1) as f64;
    (0..outputs)
        .map(|output| {
            let (error, lambda) = candidates()
                .enumerate()
                .map(|(i, lambda)| {
                    (
                        folds.iter().map(|fold| fold[i][output]).sum::<f64>(),
                        lambda,
                    )
                })
                // At a tie the larger λ, hence the plainer function.
                .min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)))
                .unwrap_or((f64::INFINITY, 1.0));
            let factor = equations.factor(&weights, lambda)?;
            let mut coefficients = equations.cross.subcols(output, 1).to_owned();
            factor.solve(coefficients.as_mut());
            // tr((G + λW)⁻¹·G): 1 for a term that the data fix, 0 for one that the penalty fixes.
            let mut influence = equations.gram.clone();
            factor.solve(influence.as_mut());
            let monomials = to_monomials(coefficients, orders);
            Ok(RidgeFit {
                coefficients: (0..monomials.nrows()).map(|i| monomials[(i, 0)]).collect(),
                lambda,
                effective_parameters: (0..influence.nrows()).map(|i| influence[(i, i)]).sum(),
                cross_validation_nmse: 100.0 * error
                    / total.spread(output).max(f64::MIN_POSITIVE * rows),
            })
        })
        .collect()
}
