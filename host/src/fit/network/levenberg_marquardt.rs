//! Levenberg–Marquardt steps of the hidden weights, the output layer following exactly, on a part
//! of the rows.

use super::evidence::{Precisions, Sizes};
use super::hidden_layer::{OuterSums, Pass};
use super::projection::{Curvature, OutputLayer};
use super::rows::Rows;
use crate::fit::least_squares::normal_equations::Cholesky;

/// Rows over which the curvature is summed: at most one in this many, neighbours in a record being
/// nearly equal …
const THINNED: usize = 4;

/// … but at least this many per hidden weight.
const ROWS_PER_WEIGHT: usize = 12;

/// Dampings that are tried before a step is given up.
const TRIALS: usize = 12;

/// How much damping a search begins with, as a share of the curvature's diagonal.
const FIRST_DAMPING: f64 = 1e-2;

/// The least damping that makes a difference in f64.
const MIN_DAMPING: f64 = 1e-12;

/// What one step did.
pub(super) enum Step {
    /// The merit fell by this share of itself.
    Down(f64),
    /// No step that was tried made it smaller.
    Level,
    /// A sum was not finite.
    NotFinite,
}

/// A network on its way down.
pub(super) struct Search<'a> {
    pass: Pass<'a>,
    source: &'a Rows,
    /// Rows of this stage.
    rows: usize,
    /// `[input][neuron]`, the bias as the last input.
    pub(super) weights: Vec<f64>,
    /// The output layer that belongs to them.
    pub(super) output: OutputLayer,
    sums: OuterSums,
    pub(super) precisions: Precisions,
    /// γ, the weights that the data determine; all of them until it is first estimated.
    pub(super) effective_parameters: f64,
    /// Up to a constant that all searches over the same rows share.
    pub(super) log_evidence: f64,
    damping: f64,
    growth: f64,
}

impl<'a> Search<'a> {
    /// From the given hidden weights over the first `rows` rows; `None` when sums over them are not
    /// finite.
    pub(super) fn new(
        source: &'a Rows,
        neurons: usize,
        weights: Vec<f64>,
        rows: usize,
    ) -> Option<Self> {
        let mut pass = Pass::new(source, neurons);
        let sums = pass.outer(&weights, rows);
        let residuals = (rows * source.outputs) as f64;
        // A first guess that holds nothing back: residuals as large as the outputs, weights free
        // within some tens.
        let precisions = Precisions {
            alpha: 1e-3,
            beta: residuals / sums.squares.iter().sum::<f64>(),
        };
        let output = OutputLayer::solve(&sums, precisions.ridge())?;
        Some(Self {
            pass,
            source,
            rows,
            effective_parameters: (weights.len() + output.weights.nrows() * source.outputs) as f64,
            log_evidence: f64::NEG_INFINITY,
            weights,
            output,
            sums,
            precisions,
            damping: FIRST_DAMPING,
            growth: 2.0,
        })
    }

    /// Goes on with more rows. `false` when sums over them are not finite.
    pub(super) fn extend(&mut self, rows: usize) -> bool {
        self.rows = rows;
        self.sums = self.pass.outer(&self.weights, rows);
        match OutputLayer::solve(&self.sums, self.precisions.ridge()) {
            Some(output) => self.output = output,
            None => return false,
        }
        true
    }

    /// Goes over to all rows and estimates evidence and effective parameters there. `false` when
    /// sums are not finite.
    pub(super) fn conclude(&mut self, rows: usize) -> bool {
        if rows != self.rows && !self.extend(rows) {
            return false;
        }
        let Some(curvature) = self.curvature() else {
            return false;
        };
        if let Some(spread) = curvature.spread(self.precisions.ridge()) {
            let sizes = self.sizes();
            self.effective_parameters = self.precisions.effective_parameters(sizes, spread);
            self.log_evidence = self.precisions.log_evidence(sizes, spread);
        }
        true
    }

    /// Rows of this stage.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    fn hidden_size(&self) -> f64 {
        self.weights.iter().map(|w| w * w).sum()
    }

    /// ½·Σ r² + ½·ρ·(|w|² + |c|²).
    fn merit(&self, weights_size: f64, output: &OutputLayer) -> f64 {
        0.5 * (output.squared_error() + self.precisions.ridge() * (weights_size + output.size))
    }

    fn sizes(&self) -> Sizes {
        Sizes {
            parameters: (self.weights.len() + self.output.weights.nrows() * self.source.outputs)
                as f64,
            residuals: (self.rows * self.source.outputs) as f64,
            squared_error: self.output.squared_error(),
            squared_weights: self.hidden_size() + self.output.size,
        }
    }

    /// The curvature at the present weights; `None` when it is not finite.
    fn curvature(&mut self) -> Option<Curvature> {
        let least = ROWS_PER_WEIGHT * self.weights.len();
        let rows = (self.rows / THINNED).max(least).min(self.rows);
        let sums = self.pass.curvature(&self.weights, rows);
        let scale = self.rows as f64 / rows as f64;
        Curvature::new(&sums, scale, &self.output.weights, self.precisions.ridge())
    }

    /// Estimates the precisions anew from the curvature; the output layer follows.
    fn weigh(&mut self, curvature: &Curvature) -> bool {
        let Some(spread) = curvature.spread(self.precisions.ridge()) else {
            return true;
        };
        let sizes = self.sizes();
        self.effective_parameters = self.precisions.effective_parameters(sizes, spread);
        self.log_evidence = self.precisions.log_evidence(sizes, spread);
        self.precisions = Precisions::update(sizes, self.effective_parameters);
        match OutputLayer::solve(&self.sums, self.precisions.ridge()) {
            Some(output) => self.output = output,
            None => return false,
        }
        true
    }

    /// One step. With `weighing` the precisions are estimated first.
    pub(super) fn step(&mut self, weighing: bool) -> Step {
        let Some(curvature) = self.curvature() else {
            return Step::NotFinite;
        };
        if weighing && !self.weigh(&curvature) {
            return Step::NotFinite;
        }
        let ridge = self.precisions.ridge();
        let mut gradient =
            self.pass
                .gradient(&self.weights, self.output.weights.as_ref(), self.rows);
        for (down, weight) in gradient.iter_mut().zip(&self.weights) {
            *down -= ridge * weight;
        }
        let merit = self.merit(self.hidden_size(), &self.output);
        if !merit.is_finite() {
            return Step::NotFinite;
        }
        let n = gradient.len();
        let mean = (0..n).map(|i| curvature.reduced[(i, i)]).sum::<f64>() / n as f64;
        for _ in 0..TRIALS {
            let mut matrix = curvature.reduced.clone();
            let mut damping = vec![0.0; n];
            for (i, damping) in damping.iter_mut().enumerate() {
                *damping = self.damping * (matrix[(i, i)] + 1e-3 * mean);
                matrix[(i, i)] += ridge + *damping;
            }
            let step = Cholesky::new(matrix).map(|cholesky| {
                let mut step = faer::Mat::from_fn(n, 1, |i, _| gradient[i]);
                cholesky.solve(step.as_mut());
                step
            });
            let Some(step) = step else {
                self.dampen();
                continue;
            };
            // ½·δᵀ·(g + damping·δ): how far the quadratic model falls.
            let promised: f64 = (0..n)
                .map(|i| 0.5 * step[(i, 0)] * (gradient[i] + damping[i] * step[(i, 0)]))
                .sum();
            let trial: Vec<f64> = self
                .weights
                .iter()
                .enumerate()
                .map(|(i, w)| w + step[(i, 0)])
                .collect();
            let sums = self.pass.outer(&trial, self.rows);
            let Some(output) = OutputLayer::solve(&sums, ridge) else {
                self.dampen();
                continue;
            };
            let size = trial.iter().map(|w| w * w).sum();
            let fall = merit - self.merit(size, &output);
            if fall > 0.0 {
                // Nielsen's rule: the better the quadratic model foretold the fall, the less
                // damping.
                let ratio = fall / promised.max(f64::MIN_POSITIVE);
                let factor = (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0);
                self.damping = (self.damping * factor).max(MIN_DAMPING);
                self.growth = 2.0;
                self.weights = trial;
                self.output = output;
                self.sums = sums;
                return Step::Down(fall / merit);
            }
            self.dampen();
        }
        Step::Level
    }

    fn dampen(&mut self) {
        self.damping *= self.growth;
        self.growth *= 2.0;
    }
}
