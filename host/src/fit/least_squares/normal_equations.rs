//! Solving the normal equations of a fit: scaled, by Cholesky, and by the shortest solution where
//! the data leave directions open.

use crate::text::error::{Error, Result};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::cholesky::llt::solve::solve_in_place;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, Par, Side};

/// Above this condition number of the columns the matrix of the normal equations has lost its
/// digits.
const WORST_CONDITION: f64 = 3e6;

/// Eigenvalues below this share of the largest count as zero.
const ZERO_SHARE: f64 = 1e-13;

/// A solution and what is known about its matrix.
#[derive(Clone, Debug)]
pub struct Solution {
    /// One column per right side.
    pub coefficients: Mat<f64>,
    /// Directions that the data determine.
    pub rank: usize,
    /// Condition number of the columns, each scaled to length 1: estimated by iteration when the
    /// rank is full, else over the directions that the data determine.
    pub condition: f64,
}

/// The Cholesky factor L of a symmetric matrix, in one thread.
pub(crate) struct Cholesky {
    factor: Mat<f64>,
}

impl Cholesky {
    /// `None` when the matrix is not positive definite to working precision.
    pub(crate) fn new(mut matrix: Mat<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let params = Default::default();
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(n, Par::Seq, params));
        cholesky_in_place(
            matrix.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            params,
        )
        .ok()?;
        let sound = (0..n).all(|i| matrix[(i, i)].is_finite() && matrix[(i, i)] > 0.0);
        sound.then_some(Self { factor: matrix })
    }

    /// Overwrites right sides by solutions.
    pub(crate) fn solve(&self, right: MatMut<'_, f64>) {
        let mut memory = MemBuffer::new(Default::default());
        solve_in_place(
            self.factor.as_ref(),
            right,
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }

    /// L itself; what stands above its diagonal is no part of it.
    pub(in crate::fit) fn lower(&self) -> faer::MatRef<'_, f64> {
        self.factor.as_ref()
    }

    /// The inverse of the matrix.
    pub(in crate::fit) fn inverse(&self) -> Mat<f64> {
        let n = self.factor.nrows();
        let mut inverse = Mat::identity(n, n);
        self.solve(inverse.as_mut());
        inverse
    }

    /// The logarithm of its determinant.
    pub(in crate::fit) fn log_det(&self) -> f64 {
        let diagonal = self.factor.diagonal().column_vector();
        2.0 * diagonal.iter().map(|d| d.ln()).sum::<f64>()
    }
}

/// The least-squares coefficients from Σ φ·φᵀ and Σ φ·y.
///
/// Columns are scaled to length 1 first. A matrix that is not positive definite, or too badly
/// conditioned to trust, is solved by its eigenvectors instead: the shortest solution in scaled
/// coefficients, with nothing along directions that the data leave open.
///
/// # Errors
/// One sentence when even the eigenvalues cannot be had, which takes entries that are not finite.
pub fn solve(gram: &Mat<f64>, cross: &Mat<f64>) -> Result<Solution> {
    let n = gram.nrows();
    let scale: Vec<f64> = (0..n)
        .map(|i| {
            if gram[(i, i)] > 0.0 {
                gram[(i, i)].sqrt().recip()
            } else {
                0.0
            }
        })
        .collect();
    let mut scaled = gram.clone();
    for j in 0..n {
        for i in 0..n {
            scaled[(i, j)] *= scale[i] * scale[j];
        }
    }
    let mut coefficients = Mat::from_fn(n, cross.ncols(), |i, j| scale[i] * cross[(i, j)]);
    let mut rank = n;
    let mut condition = f64::INFINITY;
    let cholesky = Cholesky::new(scaled.clone());
    if let Some(cholesky) = &cholesky {
        condition = (largest(&scaled) * largest_of_inverse(cholesky, n)).sqrt();
    }
    match cholesky {
        Some(cholesky) if condition < WORST_CONDITION => {
            cholesky.solve(coefficients.as_mut());
        }
        _ => (rank, condition) = solve_shortest(&scaled, &mut coefficients)?,
    }
    for j in 0..coefficients.ncols() {
        for i in 0..n {
            coefficients[(i, j)] *= scale[i];
        }
    }
    Ok(Solution {
        coefficients,
        rank,
        condition,
    })
}

/// Returns rank and condition; overwrites the right sides.
fn solve_shortest(scaled: &Mat<f64>, right: &mut Mat<f64>) -> Result<(usize, f64)> {
    let eigen = scaled.self_adjoint_eigen(Side::Lower).map_err(|_| {
        Error::data("the normal equations of the fit have no eigenvalues: look for values in the records that are not finite or beyond 1e50")
    })?;
    let values: Vec<f64> = (0..scaled.nrows()).map(|i| eigen.S()[i]).collect();
    let most = values.iter().copied().fold(0.0, f64::max);
    let kept = |value: f64| value > ZERO_SHARE * most;
    let mut projected = eigen.U().transpose() * &*right;
    for j in 0..projected.ncols() {
        for (i, value) in values.iter().enumerate() {
            projected[(i, j)] *= if kept(*value) { value.recip() } else { 0.0 };
        }
    }
    *right = eigen.U() * &projected;
    let least = values
        .iter()
        .copied()
        .filter(|v| kept(*v))
        .fold(most, f64::min);
    let rank = values.iter().filter(|v| kept(**v)).count();
    Ok((
        rank,
        if least > 0.0 {
            (most / least).sqrt()
        } else {
            1.0
        },
    ))
}

/// A start that has some of every eigenvector, the same in every run.
fn start(n: usize) -> Mat<f64> {
    Mat::from_fn(n, 1, |i, _| 1.0 + 0.5 * (12.9898 * i as f64).sin())
}

fn normalise(vector: &mut Mat<f64>) -> f64 {
    let length = vector.norm_l2();
    if length > 0.0 {
        *vector *= faer::Scale(length.recip());
    }
    length
}

/// The largest eigenvalue, by power iteration.
fn largest(matrix: &Mat<f64>) -> f64 {
    let mut vector = start(matrix.nrows());
    let mut next = vector.clone();
    normalise(&mut vector);
    let mut value = 0.0;
    for _ in 0..6 {
        matmul(&mut next, Accum::Replace, matrix, &vector, 1.0, Par::Seq);
        value = normalise(&mut next);
        std::mem::swap(&mut vector, &mut next);
    }
    value
}

fn largest_of_inverse(cholesky: &Cholesky, n: usize) -> f64 {
    let mut vector = start(n);
    normalise(&mut vector);
    let mut value = 0.0;
    for _ in 0..4 {
        cholesky.solve(vector.as_mut());
        value = normalise(&mut vector);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn design(rows: usize, columns: usize, seed: u64) -> Mat<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Columns of very different size, as powers of a badly scaled input are.
        Mat::from_fn(rows, columns, |_, j| {
            rng.random_range(-1.0..1.0) * 10f64.powi(j as i32 - 4)
        })
    }

    #[test]
    fn known_coefficients_come_back() {
        let a = design(200, 9, 31);
        let truth = Mat::from_fn(9, 2, |i, j| {
            (0.5 + i as f64 - 3.0 * j as f64) * 10f64.powi(4 - i as i32)
        });
        let gram = a.transpose() * &a;
        let cross = &gram * &truth;
        let solution = solve(&gram, &cross).unwrap();
        assert_eq!(solution.rank, 9);
        for i in 0..9 {
            for j in 0..2 {
                assert!((solution.coefficients[(i, j)] / truth[(i, j)] - 1.0).abs() < 1e-12);
            }
        }
        // Scaled columns of independent noise are nearly orthogonal.
        assert!(
            (1.0..2.5).contains(&solution.condition),
            "{}",
            solution.condition
        );
    }

    #[test]
    fn a_column_given_twice_shares_its_coefficient() {
        let mut a = design(100, 6, 32);
        for row in 0..100 {
            a[(row, 5)] = a[(row, 2)];
            a[(row, 4)] = 0.0;
        }
        let y = Mat::from_fn(100, 1, |row, _| 2.0 * a[(row, 2)] + a[(row, 0)]);
        let solution = solve(&(a.transpose() * &a), &(a.transpose() * &y)).unwrap();
        assert_eq!(solution.rank, 4);
        let c = |i| solution.coefficients[(i, 0)];
        assert!((c(2) - 1.0).abs() < 1e-8 && (c(5) - 1.0).abs() < 1e-8);
        assert!((c(0) - 1.0).abs() < 1e-8);
        assert_eq!(c(4), 0.0);
    }

    #[test]
    fn the_estimated_condition_is_the_true_one() {
        let mut a = design(300, 5, 33);
        for row in 0..300 {
            a[(row, 4)] = 1e4 * a[(row, 0)] + 1e-2 * a[(row, 4)];
        }
        let gram = a.transpose() * &a;
        let solution = solve(&gram, &Mat::zeros(5, 1)).unwrap();
        let scaled = Mat::from_fn(5, 5, |i, j| {
            gram[(i, j)] / (gram[(i, i)] * gram[(j, j)]).sqrt()
        });
        let values = scaled.self_adjoint_eigenvalues(Side::Lower).unwrap();
        let truth = (values[4] / values[0]).sqrt();
        println!("estimated {:.4e}, true {truth:.4e}", solution.condition);
        assert!((solution.condition / truth - 1.0).abs() < 0.1);
    }
}
