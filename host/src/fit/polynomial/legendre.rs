//! Terms that are orthogonal over the whole box of the normalised inputs: products of Legendre
//! polynomials.
//!
//! A sum of monomials says little about how large the function is between and beyond the rows. In
//! products of Legendre polynomials normalised over [−1, 1], the sum of the squared coefficients is
//! the mean square of the function over the box, whatever corner of it the records have left empty.

use faer::Mat;

/// Coefficients of √(2k+1)·P_k in monomials, k = 0 to 3: mean square 1 over [−1, 1].
fn monomials() -> [[f64; 4]; 4] {
    let [s3, s5, s7] = [3.0, 5.0, 7.0].map(f64::sqrt);
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, s3, 0.0, 0.0],
        [-0.5 * s5, 0.0, 1.5 * s5, 0.0],
        [0.0, -1.5 * s7, 0.0, 2.5 * s7],
    ]
}

/// √(2k+1)·P_k(u) for k = 0 to 3.
pub(in crate::fit) fn values(u: f64) -> [f64; 4] {
    monomials().map(|[a, b, c, d]| a + u * (b + u * (c + u * d)))
}

/// Applies the transform of one input to the rows of `matrix`; `transposed` maps coefficients back
/// to monomials.
fn along(matrix: &mut Mat<f64>, orders: &[u8], input: usize, transposed: bool) {
    let table = monomials();
    let stride: usize = orders[input + 1..]
        .iter()
        .map(|o| usize::from(*o) + 1)
        .product();
    let count = usize::from(orders[input]) + 1;
    for column in matrix.as_mut().col_iter_mut() {
        let mut column = column;
        for block in (0..column.nrows()).step_by(stride * count) {
            for offset in block..block + stride {
                let mut old = [0.0; 4];
                for (k, old) in old.iter_mut().enumerate().take(count) {
                    *old = column[offset + k * stride];
                }
                for k in 0..count {
                    let weight = |i: usize| if transposed { table[i][k] } else { table[k][i] };
                    column[offset + k * stride] = (0..count).map(|i| weight(i) * old[i]).sum();
                }
            }
        }
    }
}

/// Sums over monomials become sums over Legendre products: T·matrix, rows in the order of the
/// coefficients.
pub(in crate::fit) fn rows_to_legendre(mut matrix: Mat<f64>, orders: &[u8]) -> Mat<f64> {
    for input in 0..orders.len() {
        along(&mut matrix, orders, input, false);
    }
    matrix
}

/// T·gram·Tᵀ for a symmetric matrix.
pub(in crate::fit) fn gram_to_legendre(gram: Mat<f64>, orders: &[u8]) -> Mat<f64> {
    let half = rows_to_legendre(gram, orders);
    rows_to_legendre(half.transpose().to_owned(), orders)
}

/// Coefficients of Legendre products become coefficients of monomials: Tᵀ·coefficients.
pub(in crate::fit) fn to_monomials(mut coefficients: Mat<f64>, orders: &[u8]) -> Mat<f64> {
    for input in 0..orders.len() {
        along(&mut coefficients, orders, input, true);
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::exponents;

    /// Mean of u^n over [−1, 1].
    fn mean_power(n: u8) -> f64 {
        if n.is_multiple_of(2) {
            1.0 / f64::from(n + 1)
        } else {
            0.0
        }
    }

    #[test]
    fn the_terms_are_orthonormal_over_the_box() {
        for orders in [vec![3, 3, 3, 3], vec![2, 3, 1, 0], vec![3, 1]] {
            let terms = exponents(&orders);
            let n = terms.len();
            let box_gram = Mat::from_fn(n, n, |s, t| {
                (0..4)
                    .map(|i| mean_power(terms[s][i] + terms[t][i]))
                    .product()
            });
            let legendre = gram_to_legendre(box_gram, &orders);
            // The largest product of four has coefficients near 2000; their squares cost seven of
            // sixteen digits.
            assert!((&legendre - Mat::<f64>::identity(n, n)).norm_max() < 1e-8);
        }
    }

    #[test]
    fn coefficients_describe_the_same_function_in_both() {
        let orders = [3, 2, 1, 3];
        let terms = exponents(&orders);
        let point: [f64; 4] = [0.3, -0.8, 0.5, 0.9];
        let monomials = Mat::from_fn(terms.len(), 1, |t, _| {
            (0..4)
                .map(|i| point[i].powi(i32::from(terms[t][i])))
                .product::<f64>()
        });
        let coefficients = Mat::from_fn(terms.len(), 1, |t, _| (t as f64 * 0.7).sin());
        let legendre = rows_to_legendre(monomials.clone(), &orders);
        let in_legendre = (coefficients.transpose() * legendre)[(0, 0)];
        let in_monomials = (to_monomials(coefficients, &orders).transpose() * monomials)[(0, 0)];
        assert!((in_legendre - in_monomials).abs() < 1e-12);
    }
}
