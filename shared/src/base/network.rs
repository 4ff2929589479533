//! A network of tanh neurons in integers: up to 40 of them for one axis or two, the same bits on
//! every machine.
//!
//! T = W2·tanh(W1·P + b1) + b2 (the paper's Eqs. 14 and 15), with the force in newtons folded into
//! W2 and b2.
//!
//! Both layers are the same sum: words times Q31 numbers, added up exactly in 64 bits on top of the
//! bias, of which the high word is the result. The bias brings the half that makes cutting off the
//! low word round. One multiplication with addition is one instruction on a Cortex-M4 (`SMLAL`),
//! and a neuron has one rounding where a sum of rounded products would have four.
//! `docs/explanation/numerics.md` derives the scales and the error; [`NetworkModel::check`] proves
//! that no sum leaves its 64 bits for the words at hand.

pub use super::stored::Neuron;

use super::kernels::{Kernels, Portable};
use crate::fault::{Checks, Error};
use heapless::Vec;

/// The most neurons that a network on the device has: the paper's 40.
pub const NEURONS: usize = 40;

/// The half that is part of every bias, so that the high word of the sum is the rounded one.
pub(crate) const HALF: i64 = 1 << 31;

/// A network in fixed point, for one or two axes.
///
/// With A the scale of an axis, which is any real number, an output weight is stored as 2·A·v and
/// the output's bias as 2³²·A·b + 2³¹; the force is the output over A.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkModel {
    pub(crate) axes: u8,
    pub(crate) neurons: Vec<Neuron, NEURONS>,
    pub(crate) output_bias: [i64; 2],
}

impl NetworkModel {
    /// Axes: 1 or 2.
    pub fn axes(&self) -> usize {
        usize::from(self.axes)
    }

    /// The stored neurons, 1 to [`NEURONS`].
    pub fn neurons(&self) -> &[Neuron] {
        &self.neurons
    }

    /// The stored bias of each axis's force; 0 for an axis that is not there.
    pub fn output_bias(&self) -> [i64; 2] {
        self.output_bias
    }

    /// Whether the force of one axis depends on its input.
    pub fn follows(&self) -> bool {
        let mut inputs = self.neurons.iter().map(|neuron| neuron.weights[2]);
        self.axes == 1 && inputs.any(|word| word != 0)
    }

    /// The force on each axis, in units of its `force_per_lsb`, for inputs [x, ẋ, φ, φ̇] in Q31.
    ///
    /// A one-axis network reads [x, ẋ], the third where it follows an input, and leaves the second
    /// output at 0. The instructions that run are the same for all inputs: no branch depends on
    /// one. Nothing overflows and nothing has to be saturated, because [`Self::check`] has
    /// bounded every sum for all inputs.
    #[inline]
    pub fn evaluate(&self, u: &[i32; 4]) -> [i32; 2] {
        self.evaluate_by::<Portable>(u)
    }

    /// [`Self::evaluate`] with a board's kernels.
    #[inline]
    pub fn evaluate_by<K: Kernels>(&self, u: &[i32; 4]) -> [i32; 2] {
        let [first, second] = if self.axes == 1 {
            K::sum_of_neurons::<1>(&self.neurons, self.output_bias, u)
        } else {
            K::sum_of_neurons::<2>(&self.neurons, self.output_bias, u)
        };
        [(first >> 32) as i32, (second >> 32) as i32]
    }

    /// Proves that no input can overflow any sum of the evaluation, and that the rest of the model
    /// is what it states.
    ///
    /// Inputs and tanh are at most 2³¹ in size, so a sum is at most |bias| + 2³¹·Σ|word|; where
    /// that is below 2⁶³, every partial sum fits 64 bits and its high word fits 32.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for axes, the number of neurons and a table scale of 0,
    /// [`Error::Weight`] for a word of an axis that is not there, [`Error::WeightOverflow`] for
    /// the sum that could overflow.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.whole("number of axes", i32::from(self.axes), 1, 2);
        let count = self.neurons.len() as i32;
        checks.whole("number of neurons", count, 1, NEURONS as i32);
        for (number, neuron) in (0..).zip(&self.neurons) {
            let (steps, most) = (u64::from(neuron.steps), u64::from(u32::MAX));
            checks.long("table steps of a neuron", steps, 1, most);
            if self.axes == 1 {
                let [.., d] = neuron.weights;
                let [.., v] = neuron.outputs;
                for (place, word) in [("weight of an input", d), ("output weight", v)] {
                    if word != 0 {
                        return Err(Error::Weight {
                            place,
                            neuron: number,
                            seen: f64::from(word),
                        });
                    }
                }
            }
            if !sum_fits(neuron.bias, neuron.weights) {
                let sum = "argument of neuron";
                return Err(Error::WeightOverflow { sum, number });
            }
        }
        for ((axis, &bias), sum) in (0..).zip(&self.output_bias).zip(["force of axis"; 2]) {
            let words = self.neurons.iter().filter_map(|n| n.outputs.get(axis));
            if !sum_fits(bias, words.copied()) {
                let number = axis as u8;
                return Err(Error::WeightOverflow { sum, number });
            }
        }
        if self.axes == 1 {
            let [_, bias] = self.output_bias;
            let quantity = "output bias of an axis that is not there";
            checks.long(quantity, bias.unsigned_abs(), 0, 0);
        }
        checks.done()
    }
}

/// Whether `bias` + Σ word·p fits 64 bits for every |p| ≤ 2³¹, however the sum is taken.
fn sum_fits(bias: i64, words: impl IntoIterator<Item = i32>) -> bool {
    let sizes: u64 = words.into_iter().map(|w| u64::from(w.unsigned_abs())).sum();
    // At most 40·2³¹·2³¹ + 2⁶³, so it is computed in 128 bits.
    u128::from(bias.unsigned_abs()) + (u128::from(sizes) << 31) <= i64::MAX as u128
}
