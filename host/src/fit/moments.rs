//! Everything a polynomial fit needs to know about its rows, in one pass and 7⁴ numbers.
//!
//! The normal equations of the 256 terms u₁^i·u₂^j·u₃^k·u₄^l have a 256×256 matrix, but an entry
//! depends only on the sums of the exponents, each 0 to 6: there are 7⁴ = 2401 different ones. They
//! are the entries of one (49×N)·(N×49) product of the power pairs of the first two inputs with
//! those of the last two. Moments of parts of the data add up to those of the whole.

use crate::model::InputRange;
use crate::model::powers::{
    CONSTANT, PAIRS, POSITION, SAMPLE, pair_products, pair_products_by_sample,
};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use std::ops::AddAssign;

/// Rows taken together: their products (280 kB) stay in the second-level cache.
const BLOCK: usize = 256;

/// Numbers in a cache line.
const LINE: usize = 8;

/// Sums over rows of products of powers of the normalised inputs, with each other and with the
/// outputs.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Σ of (first pair)·(second pair); 49×49, or 49×1 for two inputs.
    powers: Mat<f64>,
    /// Σ of output·(first pair)·(second pair), exponents up to 3; 16 rows per output; 16 columns,
    /// or 1 for two inputs.
    cross: Mat<f64>,
    /// Σ of each output's square.
    squares: Vec<f64>,
    rows: usize,
}

impl Moments {
    /// Of no rows, for two to four inputs and any number of outputs.
    pub fn new(inputs: usize, outputs: usize) -> Self {
        let (pairs, low) = if inputs > 2 { (49, 16) } else { (1, 1) };
        Self {
            powers: Mat::zeros(49, pairs),
            cross: Mat::zeros(16 * outputs, low),
            squares: vec![0.0; outputs],
            rows: 0,
        }
    }

    /// Of sums that are known: Σ of the product with these exponents, 0 to 6; Σ of an output times
    /// the product with these, 0 to 3; Σ of an output's square.
    pub(crate) fn of_sums(
        inputs: usize,
        outputs: usize,
        rows: usize,
        power: impl Fn([usize; 4]) -> f64,
        cross: impl Fn(usize, [usize; 4]) -> f64,
        square: impl Fn(usize) -> f64,
    ) -> Self {
        let empty = Self::new(inputs, outputs);
        Self {
            powers: Mat::from_fn(49, empty.powers.ncols(), |row, pair| {
                let (c, d) = PAIRS[pair];
                power([row / 7, row % 7, c, d])
            }),
            cross: Mat::from_fn(16 * outputs, empty.cross.ncols(), |row, pair| {
                let (c, d) = PAIRS[pair];
                cross(row / 16, [row % 16 / 4, row % 4, c, d])
            }),
            squares: (0..outputs).map(square).collect(),
            rows,
        }
    }

    /// How many rows were summed.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Σ y² of an output.
    pub fn square(&self, output: usize) -> f64 {
        self.squares[output]
    }

    /// Σ (y − ȳ)² of an output; never negative.
    pub fn spread(&self, output: usize) -> f64 {
        let sum = self.cross[(16 * output, 0)];
        (self.squares[output] - sum * sum / self.rows.max(1) as f64).max(0.0)
    }

    /// The matrix of the normal equations, Σ φ·φᵀ, for the terms with the given exponents.
    pub fn gram(&self, terms: &[[u8; 4]]) -> Mat<f64> {
        let mut gram = Mat::zeros(terms.len(), terms.len());
        for (t, right) in terms.iter().enumerate() {
            for (s, left) in terms.iter().enumerate().skip(t) {
                let sum: [usize; 4] = std::array::from_fn(|i| usize::from(left[i] + right[i]));
                let value = self.powers[(7 * sum[0] + sum[1], POSITION[sum[2]][sum[3]])];
                gram[(s, t)] = value;
                gram[(t, s)] = value;
            }
        }
        gram
    }

    /// The right side of the normal equations, Σ φ·y, one column per output.
    pub fn cross(&self, terms: &[[u8; 4]]) -> Mat<f64> {
        Mat::from_fn(terms.len(), self.squares.len(), |s, output| {
            let e = terms[s].map(usize::from);
            let row = 16 * output + 4 * e[0] + e[1];
            self.cross[(row, POSITION[e[2]][e[3]])]
        })
    }
}

impl AddAssign<&Moments> for Moments {
    fn add_assign(&mut self, other: &Moments) {
        self.powers += &other.powers;
        self.cross += &other.cross;
        for (square, more) in self.squares.iter_mut().zip(&other.squares) {
            *square += more;
        }
        self.rows += other.rows;
    }
}

/// Sums rows into [`Moments`], some hundred at a time; holds the ranges and the working space.
pub struct Summation {
    ranges: Vec<InputRange>,
    normalised: Vec<Vec<f64>>,
    /// Per row the products of the first pair, then the first 16 of them times each output.
    first: Vec<f64>,
    /// Per product of the second pair, its rows.
    second: Vec<f64>,
}

impl Summation {
    /// For inputs normalised with `ranges` (2 to 4 of them) and so many outputs.
    pub fn new(ranges: &[InputRange], outputs: usize) -> Self {
        let second = if ranges.len() > 2 { 49 } else { 1 };
        Self {
            ranges: ranges.to_vec(),
            // The place of a fourth input that is not there stays 0.
            normalised: vec![vec![0.0; BLOCK]; 4],
            first: vec![0.0; BLOCK * (SAMPLE + 16 * outputs) + LINE],
            // For two inputs it stays the constant 1.
            second: vec![1.0; BLOCK * second],
        }
    }

    /// Adds rows to `moments`: one series per input (SI) and per output, all of the same length.
    pub fn add(&mut self, moments: &mut Moments, inputs: &[&[f64]], outputs: &[&[f64]]) {
        let rows = outputs[0].len();
        for start in (0..rows).step_by(BLOCK) {
            self.add_block(moments, inputs, outputs, start, BLOCK.min(rows - start));
        }
        moments.rows += rows;
    }

    fn add_block(
        &mut self,
        moments: &mut Moments,
        inputs: &[&[f64]],
        outputs: &[&[f64]],
        start: usize,
        count: usize,
    ) {
        for ((u, range), series) in self.normalised.iter_mut().zip(&self.ranges).zip(inputs) {
            range.normalise_all(&series[start..start + count], u);
        }
        let u = |input: usize| &self.normalised[input][..count];
        let stride = SAMPLE + 16 * outputs.len();
        // From the first whole cache line on: vectors that straddle two lines cost twice.
        let line = self.first.as_ptr().align_offset(8 * LINE).min(LINE);
        let first = &mut self.first[line..line + stride * count];
        let pairs = moments.powers.ncols();
        let second = &mut self.second[..pairs * count];
        let block: Vec<&[f64]> = outputs.iter().map(|y| &y[start..start + count]).collect();
        pair_products_by_sample(u(0), u(1), &block, first);
        if pairs == 49 {
            pair_products(u(2), u(3), second);
        }
        for (square, y) in moments.squares.iter_mut().zip(&block) {
            *square += y.iter().map(|y| y * y).sum::<f64>();
        }
        let first = MatRef::from_column_major_slice(&*first, stride, count);
        let series = &*second;
        let second = MatRef::from_column_major_slice(series, count, pairs);
        // 48 rows fill whole registers; the first product is the constant 1, whose sums are plain
        // sums.
        matmul(
            moments.powers.as_mut().subrows_mut(1, 48),
            Accum::Add,
            first.subrows(CONSTANT + 1, 48),
            second,
            1.0,
            Par::Seq,
        );
        for (pair, products) in series.chunks_exact(count).enumerate() {
            moments.powers[(0, pair)] += sum(products);
        }
        matmul(
            &mut moments.cross,
            Accum::Add,
            first.subrows(SAMPLE, stride - SAMPLE),
            second.subcols(0, pairs.min(16)),
            1.0,
            Par::Seq,
        );
    }
}

/// The sum of a series in eight partial sums, which a processor adds side by side.
fn sum(series: &[f64]) -> f64 {
    let (eights, rest) = series.as_chunks::<8>();
    let mut partial = [0.0; 8];
    for eight in eights {
        for (partial, value) in partial.iter_mut().zip(eight) {
            *partial += value;
        }
    }
    partial.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::exponents;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(series: usize, rows: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..series)
            .map(|_| (0..rows).map(|_| rng.random_range(-3.0..1.0)).collect())
            .collect()
    }

    fn slices(series: &[Vec<f64>], from: usize, to: usize) -> Vec<&[f64]> {
        series.iter().map(|s| &s[from..to]).collect()
    }

    const RANGE: InputRange = InputRange {
        center: -1.0,
        half_range: 2.0,
    };

    fn difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        (a - b).norm_max() / a.norm_max()
    }

    #[test]
    fn moments_are_the_gram_matrix_of_the_terms_written_out() {
        for (axes, orders) in [
            (2, vec![3, 3, 3, 3]),
            (2, vec![2, 3, 1, 0]),
            (1, vec![3, 3]),
            (1, vec![3, 2, 3]),
        ] {
            let (inputs, outputs) = (random(orders.len(), 700, 1), random(axes, 700, 2));
            let mut moments = Moments::new(orders.len(), axes);
            let mut summation = Summation::new(&vec![RANGE; orders.len()], axes);
            summation.add(
                &mut moments,
                &slices(&inputs, 0, 700),
                &slices(&outputs, 0, 700),
            );
            let terms = exponents(&orders);
            let design = Mat::from_fn(700, terms.len(), |row, t| {
                let powers = inputs.iter().zip(terms[t]);
                powers
                    .map(|(input, e)| RANGE.normalise(input[row]).powi(i32::from(e)))
                    .product::<f64>()
            });
            let y = Mat::from_fn(700, axes, |row, output| outputs[output][row]);
            assert!(difference(&(design.transpose() * &design), &moments.gram(&terms)) < 1e-13);
            assert!(difference(&(design.transpose() * &y), &moments.cross(&terms)) < 1e-13);
            for (output, y) in outputs.iter().enumerate() {
                let yy: f64 = y.iter().map(|y| y * y).sum();
                assert!((moments.square(output) / yy - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn moments_of_parts_add_up_to_the_whole() {
        let (inputs, outputs) = (random(4, 1000, 3), random(2, 1000, 4));
        let terms = exponents(&[3, 3, 3, 3]);
        let mut summation = Summation::new(&[RANGE; 4], 2);
        let mut part = |from, to| {
            let mut moments = Moments::new(4, 2);
            summation.add(
                &mut moments,
                &slices(&inputs, from, to),
                &slices(&outputs, from, to),
            );
            moments
        };
        let whole = part(0, 1000);
        let (a, b, c) = (part(0, 17), part(17, 640), part(640, 1000));
        let mut left = a.clone();
        left += &b;
        left += &c;
        let mut right = c;
        right += &b;
        right += &a;
        for sum in [&left, &right] {
            assert_eq!(sum.rows(), 1000);
            assert!(difference(&whole.gram(&terms), &sum.gram(&terms)) < 1e-13);
            assert!(difference(&whole.cross(&terms), &sum.cross(&terms)) < 1e-13);
            assert!((sum.spread(1) / whole.spread(1) - 1.0).abs() < 1e-12);
        }
    }
}
