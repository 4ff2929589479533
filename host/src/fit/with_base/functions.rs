//! The functions that a polynomial or a network is a sum of, along the training records: columns of
//! a least-squares problem.
//!
//! A polynomial is a sum of products of Legendre polynomials (or, where few terms were chosen, of
//! those powers); a network, its hidden layer kept, a sum of its neurons and a constant. They are
//! evaluated on the wide-band states and low-passed and thinned out as the effects beside them are.
//! Every axis is a sum of the same functions with factors of its own.

use crate::fit::effects::columns::Records;
use crate::fit::polynomial::{legendre, ridge};
use crate::model::file::{Base, ModelFile};
use crate::model::{InputRange, Network, Polynomial, exponents};
use crate::signal::motion::Motion;
use crate::study::series::dot;
use crate::text::error::{Error, Result};
use faer::Mat;
use rayon::prelude::*;

/// A base as columns.
pub(crate) struct Functions {
    /// One column per function, record after record, thinned out.
    pub(super) design: Mat<f64>,
    /// How much the square of each factor is held back; of no use where λ is 0.
    pub(super) penalties: Vec<f64>,
    /// Per axis the functions that it is made of.
    pub(super) used: Vec<Vec<usize>>,
    /// Whether the factors are held back at all.
    pub(super) held_back: bool,
    base: Base,
}

impl Functions {
    /// The functions of a model's base, along the motions of `records`.
    ///
    /// # Errors
    /// A base without functions.
    pub(super) fn new(
        model: &ModelFile,
        motions: &[&Motion],
        records: &Records<'_>,
    ) -> Result<Self> {
        let (base, method) = (&model.base, model.fit.as_str());
        let input = model.state_input.as_deref();
        let states: Vec<Vec<&[f64]>> = motions.iter().map(|m| m.base_states(input)).collect();
        let few = method == "select";
        let axes = base.inputs().len() / 2;
        let (columns, penalties) = match base {
            Base::Polynomial(polynomial) => (
                of_polynomial(polynomial, few, &states, records),
                ridge::weights(&polynomial.orders),
            ),
            Base::Network(network) => {
                let mut penalties = vec![1.0; network.neurons()];
                penalties.push(0.0);
                (of_network(network, &states, records), penalties)
            }
            Base::None(_) => (Vec::new(), Vec::new()),
        };
        let rows = records.rows_per_axis();
        if columns.iter().any(|column| column.len() != rows) {
            return Err(Error::failed("a base's columns differ in length"));
        }
        let count = columns.len();
        let all = || (0..count).collect::<Vec<_>>();
        let used = match base {
            Base::Polynomial(polynomial) if few => {
                let terms = polynomial.coefficients.iter();
                terms
                    .map(|axis| (0..count).filter(|&term| axis[term] != 0.0).collect())
                    .collect()
            }
            _ => (0..axes).map(|_| all()).collect(),
        };
        Ok(Self {
            design: Mat::from_fn(rows, count, |row, c| columns[c][row]),
            penalties,
            used,
            held_back: !few && method != "least-squares",
            base: base.clone(),
        })
    }

    /// The base with these factors, one list per axis in the order of `used`.
    pub(super) fn base(&self, factors: &[Vec<f64>]) -> Base {
        let mut base = self.base.clone();
        let whole = |axis: usize| {
            let mut whole = Mat::<f64>::zeros(self.design.ncols(), 1);
            for (&place, value) in self.used[axis].iter().zip(&factors[axis]) {
                whole[(place, 0)] = *value;
            }
            whole
        };
        match &mut base {
            Base::Polynomial(polynomial) => {
                let orders = polynomial.orders.clone();
                for (axis, coefficients) in polynomial.coefficients.iter_mut().enumerate() {
                    let mut found = whole(axis);
                    if self.used[axis].len() == found.nrows() {
                        found = legendre::to_monomials(found, &orders);
                    }
                    *coefficients = found.col(0).iter().copied().collect();
                }
            }
            Base::Network(network) => {
                for axis in 0..network.outputs.len() {
                    let found = whole(axis);
                    let InputRange { center, half_range } = network.outputs[axis];
                    let neurons = network.neurons();
                    for (n, weight) in network.output_weights[axis].iter_mut().enumerate() {
                        *weight = found[(n, 0)] / half_range;
                    }
                    network.output_bias[axis] = (found[(neurons, 0)] - center) / half_range;
                }
            }
            Base::None(_) => {}
        }
        base
    }
}

/// Series along every motion, each made by `at` from the normalised inputs of a row, low-passed and
/// joined.
fn along(
    count: usize,
    inputs: &[InputRange],
    motions: &[Vec<&[f64]>],
    records: &Records<'_>,
    at: impl Fn(usize, &[f64; 4]) -> f64 + Sync,
) -> Vec<Vec<f64>> {
    let normalised: Vec<Vec<[f64; 4]>> = motions
        .iter()
        .map(|states| {
            let row = |row: usize| {
                let mut u = [0.0; 4];
                for ((u, range), series) in u.iter_mut().zip(inputs).zip(states) {
                    *u = range.normalise(series[row]);
                }
                u
            };
            (0..states.first().map_or(0, |s| s.len()))
                .map(row)
                .collect()
        })
        .collect();
    let column = |c: usize| {
        let of_record = |(record, rows): (usize, &Vec<[f64; 4]>)| {
            let series: Vec<f64> = rows.iter().map(|u| at(c, u)).collect();
            records.thinned(record, &series)
        };
        normalised.iter().enumerate().flat_map(of_record).collect()
    };
    (0..count).into_par_iter().map(column).collect()
}

fn of_polynomial(
    polynomial: &Polynomial,
    few: bool,
    motions: &[Vec<&[f64]>],
    records: &Records<'_>,
) -> Vec<Vec<f64>> {
    let terms = exponents(&polynomial.orders);
    along(
        terms.len(),
        &polynomial.inputs,
        motions,
        records,
        |term, u| {
            let factors = terms[term].iter().zip(u);
            let factor = |(&degree, &u): (&u8, &f64)| match (degree, few) {
                (0, _) => 1.0,
                (_, true) => u.powi(i32::from(degree)),
                (_, false) => legendre::values(u)[usize::from(degree)],
            };
            factors.map(factor).product()
        },
    )
}

fn of_network(network: &Network, motions: &[Vec<&[f64]>], records: &Records<'_>) -> Vec<Vec<f64>> {
    let neurons = network.neurons();
    along(
        neurons + 1,
        &network.inputs,
        motions,
        records,
        |neuron, u| {
            let Some(weights) = network.hidden_weights.get(neuron) else {
                return 1.0;
            };
            (dot(weights, u) + network.hidden_bias[neuron]).tanh()
        },
    )
}
