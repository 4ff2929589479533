//! Taking out of a column what a base makes of it, so that effects can be fitted as if the base
//! were not there.
//!
//! With the functions Φ (mean square 1) and a penalty λ·bᵀWb on their factors, the best factors for
//! what the effects E·β leave of the force y are b = K⁻¹Φᵀ(y − Eβ)/N with K = ΦᵀΦ/N + λW, and what
//! is then left of the merit is (y − Eβ)ᵀM(y − Eβ) with M = I − ΦK⁻¹Φᵀ/N. A fit of the effects to
//! M^½y by columns M^½E therefore minimises the merit of both together (Frisch and Waugh,
//! Econometrica 1 (1933) 387, where λ = 0 and M is a projection).

use super::functions::Functions;
use crate::fit::least_squares::normal_equations::Cholesky;
use crate::fit::polynomial::ridge::ROUNDING;
use crate::text::error::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par, Side};

/// One axis's functions at one λ.
pub(super) struct NuisanceProjection {
    /// The columns of the axis.
    design: Mat<f64>,
    factor: Cholesky,
    /// M^½ = I − Φ·half·Φᵀ/N.
    half: Mat<f64>,
    /// tr(K⁻¹ΦᵀΦ/N): the factors that the records, not the penalty, determine.
    pub(super) effective: f64,
}

/// ΦᵀΦ of all functions, over the rows' number.
pub(super) fn mean_gram(functions: &Functions) -> Mat<f64> {
    let rows = functions.design.nrows().max(1) as f64;
    let mut gram = Mat::zeros(functions.design.ncols(), functions.design.ncols());
    matmul(
        &mut gram,
        Accum::Replace,
        functions.design.transpose(),
        &functions.design,
        1.0 / rows,
        Par::rayon(0),
    );
    gram
}

impl NuisanceProjection {
    /// # Errors
    /// Records that leave the functions undetermined.
    pub(super) fn new(
        functions: &Functions,
        gram: &Mat<f64>,
        axis: usize,
        lambda: f64,
    ) -> Result<Self> {
        let used = &functions.used[axis];
        let count = used.len();
        let gram = Mat::from_fn(count, count, |r, c| gram[(used[r], used[c])]);
        let mut ridged = gram.clone();
        let largest = (0..count).map(|i| gram[(i, i)]).fold(0.0, f64::max);
        for i in 0..count {
            ridged[(i, i)] += lambda * functions.penalties[used[i]] + ROUNDING * largest;
        }
        let undetermined = || {
            Error::data(
                "the records leave the model's base undetermined: record more kinds of motion, or learn a smaller model",
            )
        };
        // With K = L·Lᵀ and L⁻¹·G·L⁻ᵀ = U·s·Uᵀ, Φ·L⁻ᵀ·U has orthogonal columns of squared length
        // N·s.
        let factor = Cholesky::new(ridged).ok_or_else(undetermined)?;
        let lower = factor.lower();
        let mut whitened = gram;
        forward(lower, &mut whitened);
        let mut whitened = whitened.transpose().to_owned();
        forward(lower, &mut whitened);
        let effective = (0..count).map(|i| whitened[(i, i)]).sum();
        let mut half = Mat::zeros(count, count);
        if count > 0 {
            let eigen = whitened
                .self_adjoint_eigen(Side::Lower)
                .map_err(|_| undetermined())?;
            let (u, s) = (eigen.U(), eigen.S().column_vector());
            // (1 − √(1 − s))/s, which stays finite as s goes to 0.
            let root = |s: f64| 1.0 / (1.0 + (1.0 - s.clamp(0.0, 1.0)).sqrt());
            let mut scaled = Mat::from_fn(count, count, |r, c| u[(r, c)] * root(s[c]).sqrt());
            backward(lower, &mut scaled);
            half = &scaled * scaled.transpose();
        }
        Ok(Self {
            design: Mat::from_fn(functions.design.nrows(), count, |r, c| {
                functions.design[(r, used[c])]
            }),
            factor,
            half,
            effective,
        })
    }

    /// Φᵀ·series/N: what each function has in common with a series.
    fn onto(&self, series: &[f64]) -> Mat<f64> {
        let mut out = Mat::zeros(self.design.ncols(), 1);
        matmul(
            &mut out,
            Accum::Replace,
            self.design.transpose(),
            MatRef::from_column_major_slice(series, series.len(), 1),
            1.0 / series.len().max(1) as f64,
            Par::rayon(0),
        );
        out
    }

    /// The factors of the functions that follow a series best.
    pub(super) fn factors(&self, series: &[f64]) -> Vec<f64> {
        let mut factors = self.onto(series);
        self.factor.solve(factors.as_mut());
        factors.col(0).iter().copied().collect()
    }

    /// The function with these factors.
    pub(super) fn follow(&self, factors: &[f64]) -> Vec<f64> {
        let factors = MatRef::from_column_major_slice(factors, factors.len(), 1);
        let mut out = Mat::zeros(self.design.nrows(), 1);
        matmul(
            &mut out,
            Accum::Replace,
            &self.design,
            factors,
            1.0,
            Par::rayon(0),
        );
        out.col(0).iter().copied().collect()
    }

    /// M^½·series, in place.
    pub(super) fn take_out(&self, series: &mut [f64]) {
        if series.iter().all(|v| *v == 0.0) {
            return;
        }
        let factors = &self.half * self.onto(series);
        let factors: Vec<f64> = factors.col(0).iter().copied().collect();
        for (value, taken) in series.iter_mut().zip(self.follow(&factors)) {
            *value -= taken;
        }
    }
}

/// L⁻¹·matrix, in place.
fn forward(lower: MatRef<'_, f64>, matrix: &mut Mat<f64>) {
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(
        lower,
        matrix.as_mut(),
        Par::Seq,
    );
}

/// L⁻ᵀ·matrix, in place.
fn backward(lower: MatRef<'_, f64>, matrix: &mut Mat<f64>) {
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(
        lower.transpose(),
        matrix.as_mut(),
        Par::Seq,
    );
}
