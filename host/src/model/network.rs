//! A network of tanh neurons as the host keeps it, and its evaluation on whole records.

use super::InputRange;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// T = W2·tanh(W1·P + b1) + b2 of normalised inputs P and outputs T (the paper's Eqs. 14 and 15).
///
/// Two inputs and one output for one axis, four and two for two axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// How each input is normalised: P = (state − center) / half_range.
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

    /// Weights and biases of one axis's output: those of the hidden layer, which all axes share, and its own.
    pub fn parameters(&self) -> usize {
        self.neurons() * (self.inputs.len() + 1 + self.outputs.len()) + self.outputs.len()
    }

    /// Whether the parts fit together and every number is finite.
    ///
    /// # Errors
    /// One sentence that says which part does not fit.
    pub fn check(&self) -> Result<()> {
        let (inputs, axes, neurons) = (self.inputs.len(), self.outputs.len(), self.neurons());
        let shapes = matches!(inputs, 2 | 4)
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

    /// The restoring force of every axis, N or N·m, at every row of `states` (one series per input, SI).
    ///
    /// # Errors
    /// One sentence when the network does not pass [`Network::check`], or when the number of inputs or the lengths of
    /// the series differ.
    pub fn predict(&self, states: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        self.check()?;
        let rows = super::check_states(states, self.inputs.len())?;
        let mut forces = vec![vec![0.0; rows]; self.outputs.len()];
        let mut input = vec![0.0; self.inputs.len()];
        for row in 0..rows {
            for ((u, range), series) in input.iter_mut().zip(&self.inputs).zip(states) {
                *u = range.normalise(series[row]);
            }
            for (axis, force) in forces.iter_mut().enumerate() {
                force[row] = self.output_bias[axis];
            }
            for (neuron, (weights, bias)) in self
                .hidden_weights
                .iter()
                .zip(&self.hidden_bias)
                .enumerate()
            {
                let argument: f64 = weights.iter().zip(&input).map(|(w, u)| w * u).sum();
                let value = (argument + bias).tanh();
                for (force, weights) in forces.iter_mut().zip(&self.output_weights) {
                    force[row] += weights[neuron] * value;
                }
            }
            for (force, range) in forces.iter_mut().zip(&self.outputs) {
                force[row] = range.center + range.half_range * force[row];
            }
        }
        Ok(forces)
    }
}
