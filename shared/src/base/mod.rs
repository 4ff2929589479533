//! A restoring-force model as the device holds it: what its numbers mean in SI, and the base that
//! turns states into force.
//!
//! A model maps the normalised state [x, ẋ, φ, φ̇] (two axes), [x, ẋ] (one axis) or [x, ẋ, input],
//! in Q31, to one force per axis, in units of that axis's `force_per_lsb`. Everything in here is
//! calibrated and does not move while it is evaluated.

pub mod axis;
pub mod corrections;
#[cfg(feature = "fit")]
pub mod followed;
mod header;
pub mod hum;
pub mod kernels;
pub mod network;
pub mod network_quantise;
pub mod polynomial;
pub mod quantise;
mod stored;
pub mod tanh;
pub mod terms;
#[cfg(feature = "fit")]
mod terms_quantise;
#[cfg(feature = "fit")]
mod with_effects;

pub use header::{Header, Output};

use crate::base::kernels::{Kernels, Portable};
use crate::fault::{Checks, Error};
use crate::scalar::fixed::{round_shift, round_shift_32, saturate};
use crate::scalar::q::Q;
use axis::MAGNITUDE;
use corrections::ForceCorrection;
use heapless::Vec;
use network::NetworkModel;
use network_quantise::Weights;
use polynomial::PolynomialModel;
use terms::{Memory, Terms};

/// What a model's force is computed from before effects are added to it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on"
)]
pub enum Base {
    /// The paper's polynomial in powers of the states.
    Polynomial(PolynomialModel),
    /// The paper's network of tanh neurons.
    Network(NetworkModel),
    /// Nothing: the force is that of the effects alone.
    None {
        /// Axes of the model: 1 or 2.
        axes: u8,
    },
}

impl Base {
    /// Whether the force of its one axis depends on the input of that.
    #[inline]
    pub fn follows(&self) -> bool {
        match self {
            Self::Polynomial(polynomial) => polynomial.follows(),
            Self::Network(network) => network.follows(),
            Self::None { .. } => false,
        }
    }
}

/// A checked model: every evaluation is free of overflow, whatever the inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    pub(crate) header: Header,
    pub(crate) outputs: Vec<Output, 2>,
    pub(crate) base: Base,
    /// By how many places the base's force is shifted right, so that the effects fit beside it.
    pub(crate) base_shifts: [u8; 2],
    pub(crate) terms: Terms,
    pub(crate) corrections: [ForceCorrection; 2],
}

/// The most that a base may be shifted.
const MAX_BASE_SHIFT: u8 = 15;

impl Model {
    /// Puts a model without effects together and checks all of it.
    ///
    /// # Errors
    /// [`Error`] names the first quantity that is not usable or the sum that could overflow.
    pub fn new(header: Header, outputs: Vec<Output, 2>, base: Base) -> Result<Self, Error> {
        Self::with_effects(header, outputs, base, [0; 2], Terms::NONE)
    }

    /// Puts a model together and checks all of it.
    ///
    /// The base's force on an axis counts 2^shift force units; `terms` are relative to 2³¹ of them.
    /// Effects saturate: export chooses the force unit so that nothing inside the training
    /// range does.
    ///
    /// # Errors
    /// [`Error`] names the first quantity that is not usable or the sum of the base that could
    /// overflow.
    pub fn with_effects(
        header: Header,
        outputs: Vec<Output, 2>,
        base: Base,
        base_shifts: [u8; 2],
        terms: Terms,
    ) -> Result<Self, Error> {
        header.check()?;
        let mut checks = Checks::new();
        let (axes, count) = (header.axes.len() as i32, outputs.len() as i32);
        checks.whole("number of outputs (one per axis)", count, axes, axes);
        for output in &outputs {
            let (unit, most) = (output.force_per_lsb, MAGNITUDE);
            checks.within("force unit", unit, 1.0 / most, most);
            checks.within("error bound", output.error_bound, 0.0, most);
        }
        let of_base = match &base {
            Base::Polynomial(polynomial) => {
                polynomial.check()?;
                polynomial.axes()
            }
            Base::Network(network) => {
                network.check()?;
                network.axes()
            }
            Base::None { axes } => usize::from(*axes),
        };
        for (axis, shift) in base_shifts.into_iter().enumerate() {
            let moves = axis < of_base && !terms.list().is_empty();
            let most = if moves { MAX_BASE_SHIFT } else { 0 };
            let quantity = "shift of the model's base";
            checks.whole(quantity, i32::from(shift), 0, i32::from(most));
        }
        let quantity = "number of axes of the model's base";
        checks.whole(quantity, of_base as i32, axes, axes);
        for term in terms.list().iter().filter(|term| term.follows().is_some()) {
            let own = header.axes.get(term.axis());
            if own.is_none_or(|axis| axis.input.is_none()) {
                checks.say(Error::Effect {
                    tag: term.entry().tag,
                    fault: "follows an input, and its axis has none",
                });
            }
        }
        checks.done()?;
        Ok(Self {
            header,
            outputs,
            base,
            base_shifts,
            terms,
            corrections: [ForceCorrection::NONE; 2],
        })
    }

    /// The same model for a rig whose force channels are known to be wrong; one correction per
    /// axis.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a correction that is not usable, or of an axis that the model has
    /// not.
    pub fn correcting(mut self, corrections: [ForceCorrection; 2]) -> Result<Self, Error> {
        self.correct(corrections)?;
        Ok(self)
    }

    /// [`Self::correcting`] in place.
    pub(crate) fn correct(&mut self, corrections: [ForceCorrection; 2]) -> Result<(), Error> {
        let (axes, mut checks) = (self.axes(), Checks::new());
        for correction in &corrections {
            correction.check_in(axes, &mut checks);
        }
        if let ([_], [_, second]) = (&self.header.axes[..], &corrections) {
            let wrong = i32::from(!second.is_none());
            checks.whole("corrections of an axis that is not there", wrong, 0, 0);
        }
        checks.done()?;
        self.corrections = corrections;
        Ok(())
    }

    /// Brings a polynomial learnt in `f64` to fixed point.
    ///
    /// `orders` has two entries per axis, 0 to 3 each, and of one axis a third for its input, if it
    /// follows one; `coefficients` has one slice per axis of (m+1)(n+1)(o+1)(p+1) values in N
    /// or N·m for inputs normalised to ±1, the last input's exponent running fastest. `budgets`
    /// is the largest error bound allowed per axis, in N or N·m; `f64::INFINITY` allows any.
    ///
    /// # Errors
    /// As [`PolynomialModel::quantise`] and [`Header::check`]; [`Error::Budget`] when a bound is
    /// above its budget.
    pub fn from_polynomial(
        header: Header,
        orders: &[u8],
        coefficients: &[&[f64]],
        budgets: &[f64],
    ) -> Result<Self, Error> {
        header.check()?;
        let (polynomial, outputs) = PolynomialModel::quantise(orders, coefficients)?;
        check_input(&header, polynomial.follows())?;
        let limits = outputs.iter().zip(budgets);
        for (axis, ((output, &budget), values)) in limits.zip(coefficients).enumerate() {
            if output.error_bound > budget {
                let (exponents, coefficient) = quantise::largest(polynomial.orders(), values);
                return Err(Error::Budget {
                    axis: axis as u8,
                    exponents,
                    coefficient,
                    bound: output.error_bound,
                    budget,
                });
            }
        }
        Self::new(header, outputs, Base::Polynomial(polynomial))
    }

    /// Brings a network learnt in `f64` to fixed point.
    ///
    /// `weights` has its outputs in N or N·m for inputs normalised to ±1. `budgets` is the largest
    /// error bound allowed per axis, in N or N·m; `f64::INFINITY` allows any.
    ///
    /// # Errors
    /// As [`NetworkModel::quantise`] and [`Header::check`]; [`Error::NetworkBudget`] when a bound
    /// is above its budget.
    pub fn from_network(header: Header, weights: &Weights, budgets: &[f64]) -> Result<Self, Error> {
        header.check()?;
        let (network, outputs, costs) = NetworkModel::with_costs(weights)?;
        check_input(&header, network.follows())?;
        let limits = outputs.iter().zip(costs).zip(budgets);
        for (axis, ((output, cost), &budget)) in (0..).zip(limits) {
            if let (true, Some(cost)) = (output.error_bound > budget, cost) {
                return Err(Error::NetworkBudget {
                    axis,
                    bound: output.error_bound,
                    budget,
                    neuron: cost.neuron,
                    share: cost.share,
                    reach: cost.reach,
                    weight: cost.weight,
                });
            }
        }
        Self::new(header, outputs, Base::Network(network))
    }

    /// What the model says about itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// One entry per axis: force unit and error bound.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// What the force is computed from.
    pub fn base(&self) -> &Base {
        &self.base
    }

    /// Axes: 1 or 2.
    pub fn axes(&self) -> usize {
        self.header.axes.len()
    }

    /// The effects that add to the base.
    pub fn terms(&self) -> &Terms {
        &self.terms
    }

    /// What is known to be wrong with the force channels of the rig that the model was learnt on;
    /// one per axis.
    pub fn corrections(&self) -> &[ForceCorrection; 2] {
        &self.corrections
    }

    /// The force on each axis, in units of its [`Output::force_per_lsb`], for the normalised inputs
    /// [x, ẋ, φ, φ̇] in Q31 of a joint that has rested until then: effects with memory begin
    /// at 0. What effects follow beside the motion is in the middle of its range.
    ///
    /// Of a one-axis model the third input is that which its base follows, the last is not read and
    /// the second output is 0. Integers only, no division, nothing overflows; without effects,
    /// no branch on an input.
    #[inline]
    pub fn evaluate(&self, u: &[i32; 4]) -> [i32; 2] {
        self.evaluate_by::<Portable>(u)
    }

    /// [`Self::evaluate`] with a board's kernels.
    #[inline]
    pub fn evaluate_by<K: Kernels>(&self, u: &[i32; 4]) -> [i32; 2] {
        if self.terms.list().is_empty() {
            return self.of_base::<K>(u);
        }
        self.step_by::<K>(&mut Memory::default(), u)
    }

    /// The force at the next sample of a motion; as [`Self::evaluate`], but effects with memory go
    /// on from `memory`, and those that follow an input take the one that [`Memory::follow`]
    /// was told.
    #[inline]
    pub fn step(&self, memory: &mut Memory, u: &[i32; 4]) -> [i32; 2] {
        self.step_by::<Portable>(memory, u)
    }

    /// [`Self::step`] with a board's kernels.
    #[inline]
    pub fn step_by<K: Kernels>(&self, memory: &mut Memory, u: &[i32; 4]) -> [i32; 2] {
        let base = self.of_base::<K>(u);
        if self.terms.list().is_empty() {
            return base;
        }
        let [f, g] = self.terms.forces(memory, u);
        let [first, second] = base;
        let [s, t] = self.base_shifts;
        [with_effect(first, s, f), with_effect(second, t, g)]
    }

    #[inline]
    fn of_base<K: Kernels>(&self, u: &[i32; 4]) -> [i32; 2] {
        match &self.base {
            Base::Polynomial(polynomial) => polynomial.evaluate_by::<K>(u),
            Base::Network(network) => network.evaluate_by::<K>(u),
            Base::None { .. } => [0; 2],
        }
    }
}

/// Refuses a base that follows an input where its axis has none. A device that holds such a model
/// takes the middle of the range for it.
fn check_input(header: &Header, follows: bool) -> Result<(), Error> {
    let without = header.axes.iter().all(|axis| axis.input.is_none());
    let lacks = f64::from(u8::from(follows && without));
    let quantity = "inputs that a base follows and its axis has not";
    Error::unless_within(quantity, lacks, 0.0, 0.0)
}

/// The base's force, shifted, and what the effects add: half of 2³² is 2³¹ force units.
fn with_effect(base: i32, shift: u8, effect: Q) -> i32 {
    let base = round_shift_32(base, u32::from(shift.min(MAX_BASE_SHIFT)));
    // Under 2³¹ and 2⁶² in size.
    saturate(i64::from(base) + round_shift(effect.raw(), 1)).0
}
