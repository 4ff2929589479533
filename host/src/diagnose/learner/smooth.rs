//! A smooth function of displacement and velocity without a law: products of cubic B-splines in
//! both, whose factors keep close to a plane where rows are few (Eilers and Marx, Statistical
//! Science 11 (1996) 89–121).

use crate::fit::least_squares::normal_equations::Cholesky;
use crate::study::series::extent;
use faer::Mat;

/// Splines over the displacement and over the velocity.
const ACROSS: [usize; 2] = [19, 13];
/// Splines of one variable that are not zero at a place.
const LOCAL: usize = 4;
/// How much a bend of the function costs, beside the mean square of a spline: the best of these is
/// taken.
const STIFFNESS: [f64; 5] = [1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Splines at every row, and the products of them over every block.
pub(crate) struct Smooth {
    /// The first splines that are not zero in each direction, and the values of those and the next
    /// ones.
    rows: Vec<([usize; 2], [[f64; LOCAL]; 2])>,
    products: Vec<Mat<f64>>,
    bends: Mat<f64>,
}

impl Smooth {
    /// Splines over two states, for rows that belong to these blocks, numbered below `count`.
    pub(crate) fn new(states: [&[f64]; 2], block: &[usize], count: usize) -> Self {
        let ranges = states.map(|state| {
            let [low, high] = extent(state.iter().copied());
            [low, (high - low).max(f64::MIN_POSITIVE)]
        });
        let at = |row: usize, way: usize| {
            let [low, width] = ranges[way];
            let pieces = ACROSS[way] + 1 - LOCAL;
            let place = (states[way][row] - low) / width * pieces as f64;
            let first = (place as usize).min(pieces - 1);
            (first, cubic(place - first as f64))
        };
        let rows = (0..block.len()).map(|row| {
            let ((i, x), (j, v)) = (at(row, 0), at(row, 1));
            ([i, j], [x, v])
        });
        let mut smooth = Self {
            rows: rows.collect(),
            products: Vec::new(),
            bends: bends(),
        };
        let size = ACROSS[0] * ACROSS[1];
        smooth.products = vec![Mat::zeros(size, size); count];
        for (row, &number) in block.iter().enumerate() {
            let own: Vec<(usize, f64)> = smooth.splines(row).collect();
            for &(a, x) in &own {
                for &(b, y) in &own {
                    smooth.products[number][(a, b)] += x * y;
                }
            }
        }
        smooth
    }

    /// The splines that are not zero at a row, with their values.
    fn splines(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let ([i, j], [x, v]) = self.rows[row];
        let all = (0..LOCAL * LOCAL).map(|at| (at / LOCAL, at % LOCAL));
        all.map(move |(a, b)| ((i + a) * ACROSS[1] + j + b, x[a] * v[b]))
    }

    /// The function that follows `series` in all blocks but some best, at every row, for each of
    /// the bends' prices.
    pub(crate) fn taught(&self, series: &[f64], block: &[usize], but: &[usize]) -> Vec<Vec<f64>> {
        let size = ACROSS[0] * ACROSS[1];
        let mut products = Mat::<f64>::zeros(size, size);
        let kept = self.products.iter().enumerate();
        kept.filter(|(number, _)| !but.contains(number))
            .for_each(|(_, own)| products += own);
        let mut right = Mat::<f64>::zeros(size, 1);
        for (row, value) in series.iter().enumerate() {
            if !but.contains(&block[row]) {
                for (spline, own) in self.splines(row) {
                    right[(spline, 0)] += own * value;
                }
            }
        }
        let trace: f64 = (0..size).map(|i| products[(i, i)]).sum();
        let unit = trace / size as f64;
        let each = STIFFNESS.iter().map(|price| {
            let matrix = Mat::from_fn(size, size, |a, b| {
                let ridge = if a == b { 1e-6 } else { 0.0 };
                products[(a, b)] + unit * (price * self.bends[(a, b)] + ridge)
            });
            let mut factors = right.clone();
            match Cholesky::new(matrix) {
                Some(factor) => factor.solve(factors.as_mut()),
                None => factors = Mat::zeros(size, 1),
            }
            let value = |row| {
                self.splines(row)
                    .map(|(s, own)| factors[(s, 0)] * own)
                    .sum()
            };
            (0..series.len()).map(value).collect()
        });
        each.collect()
    }
}

/// The four cubic B-splines between two knots, of the way from one to the other.
fn cubic(t: f64) -> [f64; LOCAL] {
    let s = 1.0 - t;
    [
        s.powi(3) / 6.0,
        (3.0 * t.powi(3) - 6.0 * t * t + 4.0) / 6.0,
        (3.0 * s.powi(3) - 6.0 * s * s + 4.0) / 6.0,
        t.powi(3) / 6.0,
    ]
}

/// Squares of the second differences of the factors, in both directions.
fn bends() -> Mat<f64> {
    let size = ACROSS[0] * ACROSS[1];
    let mut bends = Mat::<f64>::zeros(size, size);
    for (step, inner) in [(ACROSS[1], true), (1, false)] {
        for i in 0..ACROSS[0] {
            for j in 0..ACROSS[1] {
                let room = if inner {
                    i + 2 < ACROSS[0]
                } else {
                    j + 2 < ACROSS[1]
                };
                if !room {
                    continue;
                }
                let from = i * ACROSS[1] + j;
                let parts = [(from, 1.0), (from + step, -2.0), (from + 2 * step, 1.0)];
                for (a, x) in parts {
                    for (b, y) in parts {
                        bends[(a, b)] += x * y;
                    }
                }
            }
        }
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::Smooth;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn it_follows_a_smooth_law_on_other_rows_and_no_noise() {
        let mut rng = StdRng::seed_from_u64(5);
        let rows = 1200;
        let mut draw = || (0..rows).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (x, v, noise): (Vec<f64>, Vec<f64>, Vec<f64>) = (draw(), draw(), draw());
        let block: Vec<usize> = (0..rows).map(|row| row % 4).collect();
        let smooth = Smooth::new([&x, &v], &block, 4);
        let left = |series: &[f64]| {
            let judged = || (0..rows).filter(|row| block[*row] == 3);
            let square =
                |values: &dyn Fn(usize) -> f64| judged().map(|r| values(r).powi(2)).sum::<f64>();
            let each = smooth.taught(series, &block, &[3]).into_iter();
            let each =
                each.map(|taught| square(&|r| series[r] - taught[r]) / square(&|r| series[r]));
            each.fold(f64::INFINITY, f64::min)
        };
        let law: Vec<f64> = (0..rows)
            .map(|r| (3.0 * x[r]).sin() * v[r] + x[r] * x[r])
            .collect();
        let (followed, chance) = (left(&law), left(&noise));
        assert!(followed < 1e-4, "{followed}");
        assert!(chance > 0.95, "{chance}");
    }
}
