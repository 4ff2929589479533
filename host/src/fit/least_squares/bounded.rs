//! Least squares whose factors keep to physical bounds: what has to be positive is, and what
//! instruments do within their tolerances stays within them.

use super::normal_equations::Cholesky;
use faer::Mat;

/// A trace of a ridge, beside columns of length 1: keeps columns apart that nearly repeat each
/// other.
const RIDGE: f64 = 1e-9;

/// A factor leaves its bound where that takes away more than this part of what its column alone
/// could.
const PULL: f64 = 1e-9;
/// Passes for each factor after which the best so far is kept.
const PASSES: usize = 4;

/// The factors of columns, from the products of all of them, the series last; `bounds` are the
/// least and the most of each factor, with 0 between them or at one of them.
///
/// Of all factors within the bounds they leave least. Those that stand at a bound are a set that
/// changes until none of them would rather leave it (P. B. Stark, R. L. Parker, Computational
/// Statistics 10 (1995) 129–141).
pub(crate) fn factors(products: &Mat<f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    let count = bounds.len();
    let scale: Vec<f64> = (0..count)
        .map(|c| products[(c, c)])
        .map(|square| {
            if square > 0.0 {
                square.sqrt().recip()
            } else {
                0.0
            }
        })
        .collect();
    let mut free: Vec<bool> = scale.iter().map(|s| *s > 0.0).collect();
    let mut found: Vec<f64> = bounds
        .iter()
        .map(|[least, most]| 0_f64.clamp(*least, *most))
        .collect();
    let length = products[(count, count)].max(f64::MIN_POSITIVE).sqrt();
    for _ in 0..=PASSES * count {
        let best = unbounded(products, &scale, &found, &free);
        // The part of the way to there that keeps to the bounds, and what stands at one when it is
        // gone.
        let reached = |c: usize| {
            let [least, most] = bounds[c];
            let bound = best[c].clamp(least, most);
            if bound == best[c] {
                1.0
            } else {
                (bound - found[c]) / (best[c] - found[c])
            }
        };
        let part = (0..count)
            .filter(|&c| free[c])
            .map(reached)
            .fold(1.0, f64::min);
        if part < 1.0 {
            let held: Vec<usize> = (0..count)
                .filter(|&c| free[c] && reached(c) <= part)
                .collect();
            for c in 0..count {
                found[c] += part * (best[c] - found[c]);
            }
            for c in held {
                free[c] = false;
                found[c] = best[c].clamp(bounds[c][0], bounds[c][1]);
            }
            continue;
        }
        found = best;
        // How much a factor that is held would take away, inwards.
        let pull = |c: usize| {
            let taken: f64 = (0..count).map(|d| products[(c, d)] * found[d]).sum();
            let pull = (products[(c, count)] - taken) * scale[c] / length;
            let [least, most] = bounds[c];
            (found[c] < most)
                .then_some(pull)
                .into_iter()
                .chain((found[c] > least).then_some(-pull))
                .fold(0.0, f64::max)
        };
        let held = (0..count).filter(|&c| !free[c]).map(|c| (c, pull(c)));
        match held.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((c, pull)) if pull > PULL => free[c] = true,
            _ => break,
        }
    }
    found
}

/// The factors that leave least where those that are free may be anything and the others stay.
fn unbounded(products: &Mat<f64>, scale: &[f64], found: &[f64], free: &[bool]) -> Vec<f64> {
    let count = free.len();
    let (own, held): (Vec<usize>, Vec<usize>) = (0..count).partition(|&c| free[c]);
    let matrix = Mat::from_fn(own.len(), own.len(), |i, j| {
        let (a, b) = (own[i], own[j]);
        let ridge = if i == j { RIDGE } else { 0.0 };
        products[(a, b)] * scale[a] * scale[b] + ridge
    });
    let mut right = Mat::from_fn(own.len(), 1, |i, _| {
        let a = own[i];
        let taken: f64 = held.iter().map(|&c| products[(a, c)] * found[c]).sum();
        (products[(a, count)] - taken) * scale[a]
    });
    if let Some(factor) = Cholesky::new(matrix) {
        factor.solve(right.as_mut());
    }
    let mut best = found.to_vec();
    for (i, &c) in own.iter().enumerate() {
        best[c] = right[(i, 0)] * scale[c];
    }
    best
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
