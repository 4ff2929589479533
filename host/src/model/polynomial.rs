//! Evaluating a polynomial on whole records, and the order in which its terms stand.

use super::Polynomial;
use super::powers::pair_products;
use crate::text::error::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Rows evaluated together: their powers stay in the first-level cache.
const BLOCK: usize = 256;

/// The exponents of every term for the given orders, in the order of the coefficients: the last
/// input's exponent runs fastest. Fewer than four inputs leave the other exponents 0.
pub fn exponents(orders: &[u8]) -> Vec<[u8; 4]> {
    let order = |input: usize| orders.get(input).copied().unwrap_or(0);
    let mut terms = Vec::new();
    for i in 0..=order(0) {
        for j in 0..=order(1) {
            for k in 0..=order(2) {
                for l in 0..=order(3) {
                    terms.push([i, j, k, l]);
                }
            }
        }
    }
    terms
}

impl Polynomial {
    /// Whether the parts fit together: two to four inputs, orders 0 to 3, as many coefficients as
    /// the orders ask for, everything finite.
    ///
    /// # Errors
    /// One sentence that says which part does not fit.
    pub fn check(&self) -> Result<()> {
        let inputs = self.orders.len();
        if !matches!(inputs, 2..=4) || self.inputs.len() != inputs {
            return Err(Error::data(format!(
                "a polynomial has 2 to 4 inputs, each with an order and a range; this one has {inputs} orders and {} ranges",
                self.inputs.len()
            )));
        }
        if let Some(order) = self.orders.iter().find(|order| **order > 3) {
            return Err(Error::data(format!(
                "an exponent of a polynomial is at most 3; this one asks for {order}"
            )));
        }
        let terms: usize = self
            .orders
            .iter()
            .map(|order| usize::from(*order) + 1)
            .product();
        if self.coefficients.len() != inputs / 2
            || self.coefficients.iter().any(|axis| axis.len() != terms)
        {
            return Err(Error::data(format!(
                "a polynomial of orders {:?} has {terms} coefficients for each of {} axes",
                self.orders,
                inputs / 2
            )));
        }
        if !self.inputs.iter().all(|range| range.is_sound())
            || !self.coefficients.iter().flatten().all(|c| c.is_finite())
        {
            return Err(Error::data(
                "a polynomial holds a number that is not finite, or a range that is not positive: identify it anew",
            ));
        }
        Ok(())
    }

    /// The restoring force of every axis, N or N·m, at every row of `states` (one series per input,
    /// SI).
    ///
    /// # Errors
    /// One sentence when the polynomial does not pass [`Polynomial::check`], or when the number of
    /// inputs or the lengths of the series differ.
    pub fn predict(&self, states: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        self.check()?;
        let rows = super::check_states(states, self.inputs.len())?;
        // Σ c·(u^i·v^j)·(w^k·z^l): one matrix product over the second pair, then a sum over the
        // first.
        let axes = self.coefficients.len();
        let pairs_second = match self.inputs.len() {
            2 => 1,
            _ => 16,
        };
        let mut weights = Mat::<f64>::zeros(pairs_second, 16 * axes);
        for (axis, coefficients) in self.coefficients.iter().enumerate() {
            for ([i, j, k, l], value) in exponents(&self.orders).into_iter().zip(coefficients) {
                let at = |a: u8, b: u8| 4 * usize::from(a) + usize::from(b);
                weights[(at(k, l), 16 * axis + at(i, j))] = *value;
            }
        }
        let mut normalised = vec![vec![0.0; BLOCK]; 4];
        let mut first = vec![0.0; BLOCK * 16];
        let mut second = vec![1.0; BLOCK * pairs_second];
        let mut inner = vec![0.0; BLOCK * 16 * axes];
        let mut forces = vec![vec![0.0; rows]; axes];
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            for ((u, range), series) in normalised.iter_mut().zip(&self.inputs).zip(states) {
                range.normalise_all(&series[start..start + count], u);
            }
            let u = |input: usize| &normalised[input][..count];
            pair_products(u(0), u(1), &mut first[..16 * count]);
            // Two inputs leave the second pair at the constant 1.
            if pairs_second > 1 {
                pair_products(u(2), u(3), &mut second[..16 * count]);
            }
            let inner = &mut inner[..16 * axes * count];
            matmul(
                MatMut::from_column_major_slice_mut(inner, count, 16 * axes),
                Accum::Replace,
                MatRef::from_column_major_slice(
                    &second[..pairs_second * count],
                    count,
                    pairs_second,
                ),
                &weights,
                1.0,
                Par::Seq,
            );
            for (force, inner) in forces.iter_mut().zip(inner.chunks_exact(16 * count)) {
                let force = &mut force[start..start + count];
                for (power, weight) in first.chunks_exact(count).zip(inner.chunks_exact(count)) {
                    for (sum, (power, weight)) in force.iter_mut().zip(power.iter().zip(weight)) {
                        *sum += power * weight;
                    }
                }
            }
        }
        Ok(forces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::InputRange;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn prediction_equals_the_sum_written_out() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for orders in [
            vec![3, 3, 3, 3],
            vec![1, 3, 0, 2],
            vec![3, 3],
            vec![2, 1],
            vec![3, 3, 3],
            vec![1, 2, 3],
        ] {
            let axes = orders.len() / 2;
            let terms = exponents(&orders);
            let polynomial = Polynomial {
                inputs: (0..orders.len())
                    .map(|i| InputRange {
                        center: 0.1 * i as f64,
                        half_range: 2.0 + i as f64,
                    })
                    .collect(),
                coefficients: (0..axes)
                    .map(|_| terms.iter().map(|_| rng.random_range(-1.0..1.0)).collect())
                    .collect(),
                orders,
            };
            // More than two blocks, the last one short.
            let states: Vec<Vec<f64>> = polynomial
                .inputs
                .iter()
                .map(|_| (0..600).map(|_| rng.random_range(-2.0..2.0)).collect())
                .collect();
            let slices: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
            let forces = polynomial.predict(&slices).unwrap();
            for row in 0..600 {
                for (axis, force) in forces.iter().enumerate() {
                    let mut expected = 0.0;
                    for (term, c) in terms.iter().zip(&polynomial.coefficients[axis]) {
                        let mut product = *c;
                        for (input, range) in polynomial.inputs.iter().enumerate() {
                            let u = range.normalise(states[input][row]);
                            product *= u.powi(i32::from(term[input]));
                        }
                        expected += product;
                    }
                    assert!((force[row] - expected).abs() < 1e-12, "row {row}");
                }
            }
        }
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let good = Polynomial {
            orders: vec![1, 1],
            inputs: vec![
                InputRange {
                    center: 0.0,
                    half_range: 1.0
                };
                2
            ],
            coefficients: vec![vec![0.0; 4]],
        };
        assert!(good.check().is_ok());
        let mut bad = good.clone();
        bad.orders = vec![4, 1];
        assert!(bad.check().is_err());
        let mut bad = good.clone();
        bad.inputs[0].half_range = 0.0;
        assert!(bad.check().is_err());
        let mut bad = good.clone();
        bad.coefficients[0].pop();
        assert!(bad.check().is_err());
        assert!(good.predict(&[&[1.0]]).is_err());
        assert!(good.predict(&[&[1.0], &[]]).is_err());
    }
}
