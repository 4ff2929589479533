//! The hidden layer over the training rows: its values, and every sum over rows that training
//! needs.
//!
//! Three passes, each over blocks of rows that stay in the second-level cache. With
//! Φ = [tanh(W1·P + b1), 1] and D = 1 − tanh²:
//!
//! - [`Pass::outer`]: Φᵀ·Φ, Φᵀ·Y and Yᵀ·Y, from which the output layer follows exactly (a trial
//!   step needs no more);
//! - [`Pass::gradient`]: Σ D_h·P_j·Σ_k c_hk·r_k, the gradient of half the squared error for given
//!   output weights c;
//! - [`Pass::curvature`]: the matrix of all products of the columns D_h·P_j and Φ. The derivative
//!   of output k by the weight of neuron h and input j is c_hk·D_h·P_j, so one matrix serves all
//!   outputs. It may be summed over fewer rows: neighbours in a record are nearly equal.

use super::rows::Rows;
use crate::model::tanh::tanh_all;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::{Accum, Mat, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};

/// Rows whose values and derivatives are in memory at a time.
const BLOCK: usize = 256;

/// Sums over rows from which the output layer follows.
#[derive(Clone, Debug)]
pub(super) struct OuterSums {
    /// Φᵀ·Φ, both halves; neurons first, the constant last.
    pub(super) gram: Mat<f64>,
    /// Φᵀ·Y, one column per output.
    pub(super) cross: Mat<f64>,
    /// Σ y² of every output.
    pub(super) squares: Vec<f64>,
}

/// Products of all columns of derivatives and values with each other, both halves.
#[derive(Clone, Debug)]
pub(super) struct CurvatureSums {
    /// D·P with D·P: index `input·neurons + neuron`, the bias as the last input.
    pub(super) inner: Mat<f64>,
    /// D·P (rows) with Φ (columns).
    pub(super) mixed: Mat<f64>,
    /// Φ (rows) with Φ (columns).
    pub(super) outer: Mat<f64>,
}

/// The working space of one training: a block of rows.
pub(super) struct Pass<'a> {
    rows: &'a Rows,
    neurons: usize,
    /// Row after row, every neuron's value.
    hidden: Vec<f64>,
    /// Row after row, the columns whose products are summed.
    columns: Vec<f64>,
}

impl<'a> Pass<'a> {
    pub(super) fn new(rows: &'a Rows, neurons: usize) -> Self {
        let columns = neurons * (rows.inputs + 2) + 1 + rows.outputs;
        Self {
            rows,
            neurons,
            hidden: vec![0.0; BLOCK * neurons],
            columns: vec![0.0; BLOCK * columns],
        }
    }

    /// The neurons' values for a block of rows. `weights`: `[input][neuron]`, the bias as the last
    /// input.
    fn hidden(&mut self, weights: &[f64], start: usize, count: usize) {
        let hidden = &mut self.hidden[..count * self.neurons];
        Arch::new().dispatch(Arguments {
            x: &self.rows.x[start * self.rows.inputs..(start + count) * self.rows.inputs],
            inputs: self.rows.inputs,
            weights,
            neurons: self.neurons,
            hidden,
        });
        tanh_all(hidden);
    }

    /// See [`OuterSums`]; over the first `rows` rows.
    pub(super) fn outer(&mut self, weights: &[f64], rows: usize) -> OuterSums {
        let (values, outputs) = (self.neurons + 1, self.rows.outputs);
        let width = values + outputs;
        let mut sums = Mat::<f64>::zeros(width, width);
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            self.hidden(weights, start, count);
            let y = &self.rows.y[start * outputs..(start + count) * outputs];
            let hidden = self.hidden.chunks_exact(self.neurons);
            let columns = self.columns.chunks_exact_mut(width);
            for ((columns, hidden), y) in columns.zip(hidden).zip(y.chunks_exact(outputs)) {
                columns[..values - 1].copy_from_slice(hidden);
                columns[values - 1] = 1.0;
                columns[values..].copy_from_slice(y);
            }
            add_products(&mut sums, &self.columns[..width * count]);
        }
        mirror(&mut sums);
        OuterSums {
            gram: sums.submatrix(0, 0, values, values).to_owned(),
            cross: sums.submatrix(0, values, values, outputs).to_owned(),
            squares: (values..width).map(|k| sums[(k, k)]).collect(),
        }
    }

    /// Σ D_h·P_j·Σ_k c_hk·r_k over the first `rows` rows with the residuals r = y − Φ·c; `output`
    /// is c, one column per output.
    pub(super) fn gradient(
        &mut self,
        weights: &[f64],
        output: MatRef<'_, f64>,
        rows: usize,
    ) -> Vec<f64> {
        let outputs = self.rows.outputs;
        let mut gradient = vec![0.0; weights.len()];
        let output: Vec<Vec<f64>> = (0..outputs)
            .map(|k| output.col(k).iter().copied().collect())
            .collect();
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            self.hidden(weights, start, count);
            Arch::new().dispatch(Gradient {
                x: &self.rows.x[start * self.rows.inputs..(start + count) * self.rows.inputs],
                y: &self.rows.y[start * outputs..(start + count) * outputs],
                hidden: &self.hidden[..count * self.neurons],
                output: &output,
                slope: &mut self.columns[..self.neurons],
                gradient: &mut gradient,
            });
        }
        gradient
    }

    /// See [`CurvatureSums`]; over the first `rows` rows.
    pub(super) fn curvature(&mut self, weights: &[f64], rows: usize) -> CurvatureSums {
        let inner = weights.len();
        let values = self.neurons + 1;
        let width = inner + values;
        let mut sums = Mat::<f64>::zeros(width, width);
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            self.hidden(weights, start, count);
            let columns = &mut self.columns[..width * count];
            Arch::new().dispatch(Columns {
                x: &self.rows.x[start * self.rows.inputs..(start + count) * self.rows.inputs],
                inputs: self.rows.inputs,
                hidden: &self.hidden[..count * self.neurons],
                neurons: self.neurons,
                columns,
            });
            add_products(&mut sums, columns);
        }
        mirror(&mut sums);
        CurvatureSums {
            inner: sums.submatrix(0, 0, inner, inner).to_owned(),
            mixed: sums.submatrix(0, inner, inner, values).to_owned(),
            outer: sums.submatrix(inner, inner, values, values).to_owned(),
        }
    }
}

/// Adds the products of the columns of a block, given row after row, to the lower half.
fn add_products(sums: &mut Mat<f64>, by_row: &[f64]) {
    let width = sums.nrows();
    let block = MatRef::from_column_major_slice(by_row, width, by_row.len() / width);
    triangular_matmul(
        sums.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        block,
        BlockStructure::Rectangular,
        block.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// Copies the lower half to the upper.
fn mirror(sums: &mut Mat<f64>) {
    for j in 0..sums.ncols() {
        for i in 0..j {
            sums[(i, j)] = sums[(j, i)];
        }
    }
}

/// W1·P + b1, row after row.
struct Arguments<'a> {
    x: &'a [f64],
    inputs: usize,
    weights: &'a [f64],
    neurons: usize,
    hidden: &'a mut [f64],
}

impl WithSimd for Arguments<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let (weights, bias) = self.weights.split_at(self.inputs * self.neurons);
        let rows = self.x.chunks_exact(self.inputs);
        for (x, sums) in rows.zip(self.hidden.chunks_exact_mut(self.neurons)) {
            sums.copy_from_slice(bias);
            for (x, weights) in x.iter().zip(weights.chunks_exact(self.neurons)) {
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum = x.mul_add(*weight, *sum);
                }
            }
        }
    }
}

/// The columns D·P and Φ, row after row.
struct Columns<'a> {
    x: &'a [f64],
    inputs: usize,
    hidden: &'a [f64],
    neurons: usize,
    columns: &'a mut [f64],
}

impl WithSimd for Columns<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let n = self.neurons;
        let width = n * (self.inputs + 2) + 1;
        let rows = self.x.chunks_exact(self.inputs);
        let rows = rows.zip(self.hidden.chunks_exact(n));
        for ((x, hidden), columns) in rows.zip(self.columns.chunks_exact_mut(width)) {
            let (products, rest) = columns.split_at_mut(n * self.inputs);
            let (slopes, rest) = rest.split_at_mut(n);
            for ((slope, value), hidden) in slopes.iter_mut().zip(&mut rest[..n]).zip(hidden) {
                *value = *hidden;
                *slope = 1.0 - hidden * hidden;
            }
            rest[n] = 1.0;
            for (x, products) in x.iter().zip(products.chunks_exact_mut(n)) {
                for (product, slope) in products.iter_mut().zip(&*slopes) {
                    *product = x * slope;
                }
            }
        }
    }
}

/// Adds a block's part of the gradient.
struct Gradient<'a> {
    x: &'a [f64],
    y: &'a [f64],
    hidden: &'a [f64],
    /// Per output: one weight per neuron, then the bias.
    output: &'a [Vec<f64>],
    slope: &'a mut [f64],
    gradient: &'a mut [f64],
}

impl WithSimd for Gradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let (n, outputs) = (self.slope.len(), self.output.len());
        let inputs = self.gradient.len() / n - 1;
        let rows = self
            .x
            .chunks_exact(inputs)
            .zip(self.y.chunks_exact(outputs));
        for ((x, y), hidden) in rows.zip(self.hidden.chunks_exact(n)) {
            self.slope.fill(0.0);
            for (y, output) in y.iter().zip(self.output) {
                let (weights, bias) = output.split_at(n);
                let residual = y - bias[0] - dot(weights, hidden);
                for (slope, weight) in self.slope.iter_mut().zip(weights) {
                    *slope = residual.mul_add(*weight, *slope);
                }
            }
            for (slope, hidden) in self.slope.iter_mut().zip(hidden) {
                *slope *= 1.0 - hidden * hidden;
            }
            let (products, bias) = self.gradient.split_at_mut(n * inputs);
            for (x, sums) in x.iter().zip(products.chunks_exact_mut(n)) {
                for (sum, slope) in sums.iter_mut().zip(&*self.slope) {
                    *sum = x.mul_add(*slope, *sum);
                }
            }
            for (sum, slope) in bias.iter_mut().zip(&*self.slope) {
                *sum += slope;
            }
        }
    }
}

/// Σ a·b in eight partial sums, which a processor adds side by side.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a8, a_rest), (b8, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a8.iter().zip(b8) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum = a.mul_add(*b, *sum);
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
