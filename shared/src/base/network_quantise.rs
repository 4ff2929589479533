//! From a network in newtons to one in integers: the scale of each neuron and axis, the stored
//! words, and the bound of the error.
//!
//! A sum of 64 bits has the weights at twice the scale of its result, so the scale is the largest
//! at which neither a word leaves 32 bits nor the sum 64, for any input. That of an axis may be any
//! real number; that of a neuron is 2³⁷ over a whole number, the steps of the tanh table. Every
//! neuron has its own, so a steep one does not coarsen the others.

use super::axis::MAGNITUDE;
use super::header::Output;
use super::network::{HALF, NEURONS, NetworkModel, Neuron};
use crate::base::tanh::{MAX_ERROR, STEPS_PER_UNIT};
use crate::fault::Error;
use crate::scalar::fixed::round_to_i64;
use heapless::Vec;

/// 2³¹: what a Q31 number's integer stands for at 1.
const RAIL: f64 = 2_147_483_648.0;
/// 2³²: by how much the places of a bias are above those of its sum's result.
const HIGH_WORD: f64 = 4_294_967_296.0;
/// 2³⁷: the table's steps for a scale of 1.
const STEPS: f64 = STEPS_PER_UNIT as f64 * HIGH_WORD;
/// What half a word may reach.
const WORD_LIMIT: f64 = RAIL / 2.0 - 1.0;
/// What the result of a sum may reach before roundings: 40 words add at most ½·½ each, the bias and
/// its half less than 2.
const SUM_LIMIT: f64 = RAIL - 16.0;

/// The largest weight or bias of a neuron: five of them need 2³⁷·5e7/2³¹ = 3.2e9 table steps, which
/// is below 2³².
const LARGEST: f64 = 1e7;

/// A network learnt in `f64`, with its outputs in N or N·m for inputs normalised to ±1.
#[derive(Clone, Copy, Debug)]
pub struct Weights<'a> {
    /// W1: two or four per neuron, or three of one axis with the input that it follows, the input
    /// running fastest; no unit.
    pub hidden: &'a [f64],
    /// b1: one per neuron; no unit.
    pub hidden_bias: &'a [f64],
    /// W2: one slice per axis, with one weight per neuron, N or N·m.
    pub output: &'a [&'a [f64]],
    /// b2: one per axis, N or N·m.
    pub output_bias: &'a [f64],
}

/// What fixed point costs the force of one axis, and the neuron that is to blame for most of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cost {
    /// The neuron, from 0.
    pub(crate) neuron: u8,
    /// What it contributes to the bound, N or N·m.
    pub(crate) share: f64,
    /// The largest size of its argument: Σ|w| + |b|.
    pub(crate) reach: f64,
    /// Its output weight, N or N·m.
    pub(crate) weight: f64,
}

/// The most expensive neuron of each axis.
pub(crate) type Costs = [Option<Cost>; 2];

/// By how much storing the words of a neuron moves its argument, and how large that can be.
#[derive(Clone, Copy)]
struct Argument {
    moved: f64,
    reach: f64,
}

impl NetworkModel {
    /// Brings a network in N or N·m to fixed point, and says what one unit of each output is and
    /// how far off it may be.
    ///
    /// An axis whose weights and bias are all 0 gets the unit 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the number of axes or neurons, a bias or a sum of weights,
    /// [`Error::WeightCount`], and [`Error::Weight`] for the first that is not a number or too
    /// large.
    pub fn quantise(weights: &Weights) -> Result<(Self, Vec<Output, 2>), Error> {
        Self::with_costs(weights).map(|(model, outputs, _)| (model, outputs))
    }

    /// As [`Self::quantise`], and what dominates each axis's bound.
    pub(crate) fn with_costs(weights: &Weights) -> Result<(Self, Vec<Output, 2>, Costs), Error> {
        let (axes, inputs) = weights.check_counts()?;
        let mut model = Self {
            axes: axes as u8,
            neurons: Vec::new(),
            output_bias: [0; 2],
        };
        let mut arguments = [Argument {
            moved: 0.0,
            reach: 0.0,
        }; NEURONS];
        let hidden = weights.hidden.chunks_exact(inputs).zip(weights.hidden_bias);
        for ((number, (inputs, &bias)), place) in (0..).zip(hidden).zip(&mut arguments) {
            let (neuron, argument) = neuron(number, inputs, bias)?;
            *place = argument;
            // The capacity is the number of places.
            let _ = model.neurons.push(neuron);
        }
        let mut outputs = Vec::new();
        let mut costs = [None; 2];
        let learnt = weights.output.iter().zip(weights.output_bias);
        for ((axis, (values, &bias)), cost) in learnt.enumerate().zip(&mut costs) {
            let (output, dominant) = model.set_axis(axis, values, bias, &arguments)?;
            *cost = dominant;
            // The capacity is two and there are at most two axes.
            let _ = outputs.push(output);
        }
        model.check()?;
        Ok((model, outputs, costs))
    }

    /// Stores the output weights of one axis and adds up what its force may be off by.
    fn set_axis(
        &mut self,
        axis: usize,
        values: &[f64],
        bias: f64,
        arguments: &[Argument; NEURONS],
    ) -> Result<(Output, Option<Cost>), Error> {
        let (mut sum, mut largest) = (bias.abs(), 0.0_f64);
        Error::unless_within("output bias of the network", bias, -MAGNITUDE, MAGNITUDE)?;
        for (neuron, &seen) in (0..).zip(values) {
            if seen.is_nan() || seen.abs() > MAGNITUDE {
                let place = "output weight";
                return Err(Error::Weight {
                    place,
                    neuron,
                    seen,
                });
            }
            sum += seen.abs();
            largest = largest.max(seen.abs());
        }
        if sum != 0.0 {
            let quantity = "sum of the sizes of the output weights and the bias";
            Error::unless_within(quantity, sum, 1e-50, MAGNITUDE)?;
        }
        let scale = if sum == 0.0 {
            1.0
        } else {
            largest_scale(sum, largest)
        };
        let (stored_bias, bias_error) = stored_bias(bias, scale);
        if let Some(place) = self.output_bias.get_mut(axis) {
            *place = stored_bias;
        }
        let mut error_bound = bias_error + 0.5 / scale;
        let mut dominant: Option<Cost> = None;
        let neurons = (0..).zip(&mut self.neurons).zip(values).zip(arguments);
        for (((number, neuron), &weight), argument) in neurons {
            let (word, value) = stored_word(weight, scale);
            if let Some(place) = neuron.outputs.get_mut(axis) {
                *place = word;
            }
            // tanh is at most 1 and its slope is at most 1.
            let share = (weight - value).abs() + value.abs() * (argument.moved + neuron.error());
            error_bound += share;
            if dominant.is_none_or(|known| share > known.share) {
                dominant = Some(Cost {
                    neuron: number,
                    share,
                    reach: argument.reach,
                    weight,
                });
            }
        }
        let output = Output {
            force_per_lsb: 1.0 / scale,
            // These differences of f64 are themselves off by 2⁻⁵² of a weight or bias, the bound is
            // above 2⁻³².
            error_bound: error_bound * (1.0 + 1e-5),
        };
        Ok((output, dominant))
    }

    /// The largest difference between an output and the real network of the stored words, in units
    /// of the output.
    ///
    /// It holds for every real input in [−1, 1], rounded to Q31 on the way in. The causes: that
    /// rounding, in which 1.0 becomes 1 − 2⁻³¹; half a unit of every argument; the table; and
    /// half a unit of the output. The rounding of weights and biases to words is not in it;
    /// [`Output::error_bound`] has both.
    pub fn error_bound_lsb(&self, axis: usize) -> f64 {
        let of_neuron = |neuron: &Neuron| {
            let word = neuron.outputs.get(axis).map_or(0, |w| w.unsigned_abs());
            0.5 * f64::from(word) * neuron.error()
        };
        0.5 + self.neurons().iter().map(of_neuron).sum::<f64>()
    }
}

impl Neuron {
    /// The largest difference between the neuron's tanh and the real one of the stored words, for
    /// real inputs in [−1, 1].
    fn error(&self) -> f64 {
        let scale = STEPS / f64::from(self.steps);
        let sizes: f64 = self
            .weights
            .iter()
            .map(|w| f64::from(w.unsigned_abs()))
            .sum();
        // An input is off by at most 2⁻³¹, of which most is 1.0 becoming 1 − 2⁻³¹; the slope of
        // tanh is at most 1.
        (0.5 * sizes / RAIL + 0.5) / scale + MAX_ERROR
    }
}

impl Weights<'_> {
    /// The numbers of axes and inputs, if everything is there that they ask for.
    fn check_counts(&self) -> Result<(usize, usize), Error> {
        let (axes, neurons) = (self.output.len(), self.hidden_bias.len());
        Error::unless_within("number of axes", axes as f64, 1.0, 2.0)?;
        Error::unless_within("number of neurons", neurons as f64, 1.0, NEURONS as f64)?;
        let count = |place, seen, wanted| match seen == wanted {
            true => Ok(()),
            false => Err(Error::WeightCount {
                place,
                seen,
                wanted,
            }),
        };
        let mut inputs = 2 * axes;
        if self.hidden.len() == 3 * neurons && axes == 1 {
            inputs = 3;
        }
        count("hidden weights", self.hidden.len(), inputs * neurons)?;
        count("output biases", self.output_bias.len(), axes)?;
        for values in self.output {
            count("output weights of an axis", values.len(), neurons)?;
        }
        Ok((axes, inputs))
    }
}

/// One neuron without its outputs, and what its argument is worth.
fn neuron(number: u8, inputs: &[f64], bias: f64) -> Result<(Neuron, Argument), Error> {
    let (mut reach, mut largest) = (bias.abs(), 0.0_f64);
    let all = inputs.iter().map(|w| ("weight of an input", w));
    for (place, &seen) in all.chain([("bias", &bias)]) {
        if seen.is_nan() || seen.abs() > LARGEST {
            let neuron = number;
            return Err(Error::Weight {
                place,
                neuron,
                seen,
            });
        }
    }
    for weight in inputs {
        reach += weight.abs();
        largest = largest.max(weight.abs());
    }
    // Rounded up, so that the scale is not above its limit.
    let least = STEPS / largest_scale(reach, largest);
    let cut = least as u32;
    let steps = (cut + u32::from(f64::from(cut) < least)).max(1);
    let scale = STEPS / f64::from(steps);
    let (bias, bias_error) = stored_bias(bias, scale);
    let mut weights = [0; 4];
    let mut moved = bias_error;
    for (place, &weight) in weights.iter_mut().zip(inputs) {
        let (word, value) = stored_word(weight, scale);
        *place = word;
        moved += (weight - value).abs();
    }
    let neuron = Neuron {
        weights,
        outputs: [0; 2],
        bias,
        steps,
    };
    Ok((neuron, Argument { moved, reach }))
}

/// The largest scale of a sum of `sum` in size whose largest word is `largest`; infinite for a sum
/// of zeros.
fn largest_scale(sum: f64, largest: f64) -> f64 {
    (SUM_LIMIT / sum).min(WORD_LIMIT / largest)
}

/// A weight as stored at twice the scale of its sum, and the value that the word stands for.
fn stored_word(value: f64, scale: f64) -> (i32, f64) {
    // The scale keeps every word a unit away from the rails.
    let word = round_to_i64(2.0 * scale * value) as i32;
    (word, f64::from(word) / (2.0 * scale))
}

/// A bias as stored, with the half that rounds, and how far it is off.
fn stored_bias(bias: f64, scale: f64) -> (i64, f64) {
    let fine = HIGH_WORD * scale;
    let word = round_to_i64(bias * fine);
    (word + HALF, (bias - word as f64 / fine).abs())
}
