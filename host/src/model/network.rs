//! A network of tanh neurons as the host keeps it, and its evaluation on whole records.

use super::InputRange;
use super::tanh::tanh_all;
use crate::text::error::{Error, Result};
use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

/// Rows evaluated together: the values of 40 neurons for them (40 kB) stay in the cache.
const BLOCK: usize = 128;

/// T = W2·tanh(W1·P + b1) + b2 of normalised inputs P and outputs T (the paper's Eqs. 14 and 15).
///
/// Two inputs and one output for one axis, four and two for two axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// How each input is normalised: P = (state − center) / half_range; of one axis a third may be
    /// an input of the study.
    pub inputs: Vec<InputRange>,
    /// How each axis's output is normalised: force = center + half_range·T, N or N·m.
    pub outputs: Vec<InputRange>,
    /// W1: `[neuron][input]`, no unit.
    pub hidden_weights: Vec<Vec<f64>>,
    /// b1: one per neuron.
    pub hidden_bias: Vec<f64>,
    /// W2: `[axis][neuron]`, no unit.
    pub output_weights: Vec<Vec<f64>>,
    /// b2: one per axis.
    pub output_bias: Vec<f64>,
}

impl Network {
    /// Neurons in the hidden layer.
    pub fn neurons(&self) -> usize {
        self.hidden_bias.len()
    }

    /// Weights and biases in all: of the hidden layer and of every axis's output.
    pub fn parameters(&self) -> usize {
        self.neurons() * (self.inputs.len() + 1 + self.outputs.len()) + self.outputs.len()
    }

    /// Whether the parts fit together and every number is finite.
    ///
    /// # Errors
    /// One sentence that says which part does not fit.
    pub fn check(&self) -> Result<()> {
        let (inputs, axes, neurons) = (self.inputs.len(), self.outputs.len(), self.neurons());
        let shapes = matches!(inputs, 2..=4)
            && axes == inputs / 2
            && neurons > 0
            && self.hidden_weights.len() == neurons
            && self.hidden_weights.iter().all(|row| row.len() == inputs)
            && self.output_weights.len() == axes
            && self.output_weights.iter().all(|row| row.len() == neurons)
            && self.output_bias.len() == axes;
        if !shapes {
            return Err(Error::data(format!(
                "a network's weights do not fit {inputs} inputs, {neurons} neurons and {axes} outputs: identify it anew"
            )));
        }
        let ranges = self.inputs.iter().chain(&self.outputs);
        let weights = self.hidden_weights.iter().chain(&self.output_weights);
        let numbers = weights
            .flatten()
            .chain(&self.hidden_bias)
            .chain(&self.output_bias);
        if !numbers.into_iter().all(|w| w.is_finite()) || !ranges.into_iter().all(|r| r.is_sound())
        {
            return Err(Error::data(
                "a network holds a number that is not finite, or a range that is not positive: identify it anew",
            ));
        }
        Ok(())
    }

    /// The restoring force of every axis, N or N·m, at every row of `states` (one series per input,
    /// SI).
    ///
    /// # Errors
    /// One sentence when the network does not pass [`Network::check`], or when the number of inputs
    /// or the lengths of the series differ.
    pub fn predict(&self, states: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        self.check()?;
        let rows = super::check_states(states, self.inputs.len())?;
        let mut forces = vec![vec![0.0; rows]; self.outputs.len()];
        let mut normalised = vec![vec![0.0; BLOCK]; states.len()];
        let mut hidden = vec![0.0; BLOCK * self.neurons()];
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            for ((u, range), series) in normalised.iter_mut().zip(&self.inputs).zip(states) {
                range.normalise_all(&series[start..start + count], u);
            }
            let hidden = &mut hidden[..count * self.neurons()];
            Arch::new().dispatch(Arguments {
                network: self,
                inputs: &normalised,
                hidden,
                count,
            });
            tanh_all(hidden);
            for (axis, force) in forces.iter_mut().enumerate() {
                Arch::new().dispatch(Output {
                    network: self,
                    axis,
                    hidden,
                    force: &mut force[start..start + count],
                });
            }
        }
        Ok(forces)
    }
}

/// W1·P + b1, neuron after neuron, each for all rows of a block.
struct Arguments<'a> {
    network: &'a Network,
    inputs: &'a [Vec<f64>],
    hidden: &'a mut [f64],
    count: usize,
}

impl WithSimd for Arguments<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let neurons = self.network.hidden_weights.iter();
        let neurons = neurons.zip(&self.network.hidden_bias);
        for (sums, (weights, bias)) in self.hidden.chunks_exact_mut(self.count).zip(neurons) {
            sums.fill(*bias);
            for (weight, input) in weights.iter().zip(self.inputs) {
                for (sum, input) in sums.iter_mut().zip(input) {
                    *sum = weight.mul_add(*input, *sum);
                }
            }
        }
    }
}

/// W2·T + b2 for one axis, in units of force.
struct Output<'a> {
    network: &'a Network,
    axis: usize,
    hidden: &'a [f64],
    force: &'a mut [f64],
}

impl WithSimd for Output<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let (network, force) = (self.network, self.force);
        let count = force.len();
        force.fill(network.output_bias[self.axis]);
        let weights = &network.output_weights[self.axis];
        for (weight, values) in weights.iter().zip(self.hidden.chunks_exact(count)) {
            for (sum, value) in force.iter_mut().zip(values) {
                *sum = weight.mul_add(*value, *sum);
            }
        }
        let range = network.outputs[self.axis];
        for sum in force {
            *sum = sum.mul_add(range.half_range, range.center);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn prediction_equals_the_formula_written_out() {
        let mut rng = ChaCha8Rng::seed_from_u64(51);
        // More than two blocks, the last one short; and fewer rows than a block.
        for (axes, neurons, rows) in [(2, 40, 300), (1, 7, 300), (2, 1, 5), (1, 3, 0)] {
            let mut numbers =
                |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.5..1.5)).collect() };
            let range = |i: usize| InputRange {
                center: 0.3 * i as f64,
                half_range: 0.5 + i as f64,
            };
            let network = Network {
                inputs: (0..2 * axes).map(range).collect(),
                outputs: (0..axes).map(|i| range(i + 3)).collect(),
                hidden_weights: (0..neurons).map(|_| numbers(2 * axes)).collect(),
                hidden_bias: numbers(neurons),
                output_weights: (0..axes).map(|_| numbers(neurons)).collect(),
                output_bias: numbers(axes),
            };
            let states: Vec<Vec<f64>> = (0..2 * axes).map(|_| numbers(rows)).collect();
            let slices: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
            let forces = network.predict(&slices).unwrap();
            for row in 0..rows {
                for (axis, force) in forces.iter().enumerate() {
                    let mut sum = network.output_bias[axis];
                    for neuron in 0..neurons {
                        let mut z = network.hidden_bias[neuron];
                        for (input, range) in network.inputs.iter().enumerate() {
                            z += network.hidden_weights[neuron][input]
                                * range.normalise(states[input][row]);
                        }
                        sum += network.output_weights[axis][neuron] * z.tanh();
                    }
                    let range = network.outputs[axis];
                    let expected = range.center + range.half_range * sum;
                    assert!((force[row] - expected).abs() < 1e-12, "row {row}");
                }
            }
        }
    }
}
