//! Least squares whose factors keep to physical bounds: what has to be positive is, and what instruments do within their tolerances stays
//! within them.

use super::normal_equations::Cholesky;
use faer::Mat;

/// A trace of a ridge, beside columns of length 1: keeps columns apart that nearly repeat each other.
const RIDGE: f64 = 1e-9;

/// The factors of columns, from the products of all of them, the series last; `bounds` are the least and the most of each factor.
///
/// A factor that would leave its bounds stands at the one it crosses, and the others are found anew beside it.
pub(crate) fn factors(products: &Mat<f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    let count = bounds.len();
    let scale: Vec<f64> = (0..count)
        .map(|c| {
            let square = products[(c, c)];
            if square > 0.0 {
                square.sqrt().recip()
            } else {
                0.0
            }
        })
        .collect();
    let mut fixed: Vec<Option<f64>> = scale.iter().map(|s| (*s == 0.0).then_some(0.0)).collect();
    // Every pass fixes a factor, so there are no more of them.
    for _ in 0..=count {
        let free: Vec<usize> = (0..count).filter(|&c| fixed[c].is_none()).collect();
        let matrix = Mat::from_fn(free.len(), free.len(), |i, j| {
            let (a, b) = (free[i], free[j]);
            let ridge = if i == j { RIDGE } else { 0.0 };
            products[(a, b)] * scale[a] * scale[b] + ridge
        });
        let mut right = Mat::from_fn(free.len(), 1, |i, _| {
            let a = free[i];
            let taken = fixed.iter().enumerate();
            let taken: f64 = taken
                .filter_map(|(c, value)| value.map(|value| products[(a, c)] * value))
                .sum();
            (products[(a, count)] - taken) * scale[a]
        });
        if let Some(factor) = Cholesky::new(matrix) {
            factor.solve(right.as_mut());
        }
        let mut found: Vec<f64> = fixed.iter().map(|value| value.unwrap_or(0.0)).collect();
        for (i, &c) in free.iter().enumerate() {
            found[c] = right[(i, 0)] * scale[c];
        }
        let crossed: Vec<usize> = free
            .iter()
            .copied()
            .filter(|&c| found[c] < bounds[c][0] || found[c] > bounds[c][1])
            .collect();
        if crossed.is_empty() {
            return found;
        }
        for c in crossed {
            fixed[c] = Some(found[c].clamp(bounds[c][0], bounds[c][1]));
        }
    }
    fixed.iter().map(|value| value.unwrap_or(0.0)).collect()
}

/// Σ of the squared error that factors leave, from the products.
pub(crate) fn left(products: &Mat<f64>, factors: &[f64]) -> f64 {
    let count = factors.len();
    let mut square = products[(count, count)];
    for (c, factor) in factors.iter().enumerate() {
        let inner: f64 = (0..count).map(|d| products[(c, d)] * factors[d]).sum();
        square += factor * (inner - 2.0 * products[(c, count)]);
    }
    square.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::{factors, left};
    use faer::Mat;

    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    #[test]
    fn factors_are_those_of_least_squares_and_keep_to_their_bounds() {
        let rows = 50;
        let column = |c: usize, row: usize| ((c + 1) as f64 * 0.37 * row as f64).sin();
        let series = |row: usize| 2.0 * column(0, row) - 3.0 * column(1, row);
        let design = Mat::from_fn(
            rows,
            3,
            |row, c| if c < 2 { column(c, row) } else { series(row) },
        );
        let products = design.transpose() * &design;
        let free = factors(&products, &[FREE, FREE]);
        assert!(
            (free[0] - 2.0).abs() < 1e-6 && (free[1] + 3.0).abs() < 1e-6,
            "{free:?}"
        );
        assert!(left(&products, &free) < 1e-6);
        let positive = factors(&products, &[FREE, [0.0, f64::INFINITY]]);
        assert_eq!(positive[1], 0.0);
        let alone = products[(0, 2)] / products[(0, 0)];
        assert!((positive[0] - alone).abs() < 1e-6);
        let held = factors(&products, &[[-0.5, 0.5], FREE]);
        assert!((held[0] - 0.5).abs() < 1e-12, "{held:?}");
    }
}
