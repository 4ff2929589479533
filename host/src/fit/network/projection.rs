//! Variable projection: the output layer is solved exactly, so that only the hidden layer's weights
//! are searched for.
//!
//! With ρ = α/β the merit to be minimised is ½·Σ r² + ½·ρ·(|w|² + |c|²). For given hidden weights w
//! the output weights c solve (ΦᵀΦ + ρ·I)·c = ΦᵀY. What is left is a function of w alone; its
//! Gauss–Newton matrix in Kaufman's form is that of all weights with the output layer eliminated,
//!
//! A = (Σ_k c_k·c_kᵀ) ∘ (G_DD − G_DΦ·(G_ΦΦ + ρ·I)⁻¹·G_ΦD) + ρ·I,
//!
//! with G the matrix of products of the columns D·P and Φ. The bracket is the same for every
//! output. Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; Kaufman, BIT 15 (1975) 49.

use super::hidden_layer::{CurvatureSums, OuterSums};
use crate::fit::least_squares::normal_equations::Cholesky;
use faer::Mat;

/// Below this share of its largest entry nothing can be told from rounding in a matrix of products.
const ROUNDING: f64 = 1e-14;

/// The output layer that is best for given hidden weights.
#[derive(Clone, Debug)]
pub(super) struct OutputLayer {
    /// c: one column per output, the bias in the last row.
    pub(super) weights: Mat<f64>,
    /// Σ r² of every output.
    pub(super) squared_errors: Vec<f64>,
    /// |c|²: the sum of the squares of all weights and biases of the layer.
    pub(super) size: f64,
}

impl OutputLayer {
    /// `None` when the sums are not finite.
    pub(super) fn solve(sums: &OuterSums, ridge: f64) -> Option<Self> {
        let mut weights = sums.cross.clone();
        ridged(&sums.gram, ridge)?.solve(weights.as_mut());
        let fitted = &sums.gram * &weights;
        let squared_errors: Vec<f64> = (0..weights.ncols())
            .map(|k| {
                let sum: f64 = (0..weights.nrows())
                    .map(|i| weights[(i, k)] * (fitted[(i, k)] - 2.0 * sums.cross[(i, k)]))
                    .sum();
                // Rounding could take an exact fit below zero.
                (sums.squares[k] + sum).max(f64::EPSILON * sums.squares[k])
            })
            .collect();
        let size = weights.squared_norm_l2();
        let finite = size.is_finite() && squared_errors.iter().all(|e| e.is_finite());
        finite.then_some(Self {
            weights,
            squared_errors,
            size,
        })
    }

    /// Σ r² of all outputs.
    pub(super) fn squared_error(&self) -> f64 {
        self.squared_errors.iter().sum()
    }
}

/// The Cholesky factor of G + ρ·I; when the columns are equal to within rounding, ρ is raised until
/// there is one.
fn ridged(gram: &Mat<f64>, ridge: f64) -> Option<Cholesky> {
    let n = gram.nrows();
    let most = (0..n).map(|i| gram[(i, i)]).fold(0.0, f64::max);
    if !most.is_finite() {
        return None;
    }
    let mut ridge = ridge.max(ROUNDING * most);
    for _ in 0..6 {
        let mut matrix = gram.clone();
        for i in 0..n {
            matrix[(i, i)] += ridge;
        }
        if let Some(cholesky) = Cholesky::new(matrix) {
            return Some(cholesky);
        }
        ridge *= 10.0;
    }
    None
}

/// The Gauss–Newton matrix with the output layer eliminated, before ρ is added, and what its
/// evidence needs.
#[derive(Clone, Debug)]
pub(super) struct Curvature {
    /// (Σ c·cᵀ) ∘ (G_DD − G_DΦ·(G_ΦΦ + ρ·I)⁻¹·G_ΦD).
    pub(super) reduced: Mat<f64>,
    /// (Σ c·cᵀ) ∘ (G_DΦ·(G_ΦΦ + ρ·I)⁻²·G_ΦD).
    back: Mat<f64>,
    /// Trace of (G_ΦΦ + ρ·I)⁻¹.
    outer_trace: f64,
    /// ln det (G_ΦΦ + ρ·I).
    outer_log_det: f64,
    outputs: usize,
}

/// What the curvature says about all weights together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// Trace of (JᵀJ + ρ·I)⁻¹ over all weights.
    pub(super) trace: f64,
    /// ln det (JᵀJ + ρ·I) over all weights.
    pub(super) log_det: f64,
}

impl Curvature {
    /// `scale`: training rows per row that was summed. `None` when the sums are not finite.
    pub(super) fn new(
        sums: &CurvatureSums,
        scale: f64,
        output: &Mat<f64>,
        ridge: f64,
    ) -> Option<Self> {
        let values = sums.outer.nrows();
        let neurons = values - 1;
        let inner = sums.inner.nrows();
        let outer = faer::Scale(scale) * &sums.outer;
        let cholesky = ridged(&outer, ridge)?;
        let mut solved = (faer::Scale(scale) * &sums.mixed).transpose().to_owned();
        cholesky.solve(solved.as_mut());
        let share = Mat::from_fn(neurons, neurons, |a, b| {
            (0..output.ncols())
                .map(|k| output[(a, k)] * output[(b, k)])
                .sum::<f64>()
        });
        let mut reduced = &sums.mixed * &solved;
        let mut back = solved.transpose() * &solved;
        for j in 0..inner {
            for i in 0..inner {
                let share = share[(i % neurons, j % neurons)];
                reduced[(i, j)] = share * scale * (sums.inner[(i, j)] - reduced[(i, j)]);
                back[(i, j)] *= share;
            }
        }
        Some(Self {
            reduced,
            back,
            outer_trace: cholesky.inverse().diagonal().column_vector().iter().sum(),
            outer_log_det: cholesky.log_det(),
            outputs: output.ncols(),
        })
    }

    /// Trace and determinant over all weights, by blocks. `None` when the matrix is not positive
    /// definite.
    pub(super) fn spread(&self, ridge: f64) -> Option<Spread> {
        let n = self.reduced.nrows();
        let mut matrix = self.reduced.clone();
        for i in 0..n {
            matrix[(i, i)] += ridge;
        }
        let cholesky = Cholesky::new(matrix)?;
        let inverse = cholesky.inverse();
        let mut trace = self.outputs as f64 * self.outer_trace;
        for j in 0..n {
            trace += inverse[(j, j)];
            trace += (0..n)
                .map(|i| inverse[(i, j)] * self.back[(i, j)])
                .sum::<f64>();
        }
        let log_det = cholesky.log_det() + self.outputs as f64 * self.outer_log_det;
        (trace.is_finite() && log_det.is_finite()).then_some(Spread { trace, log_det })
    }
}
