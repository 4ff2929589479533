//! How a network is trained: its size, its restarts, where it stops.

use super::restarts::MAX_RESTARTS;
use super::stages::Limits;
use crate::text::error::{Error, Result};

/// How many neurons the hidden layer has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neurons {
    /// So many, 1 to [`MAX_NEURONS`].
    Fixed(usize),
    /// As many as leaving out one record at a time asks for.
    Auto,
}

/// The largest hidden layer: the time per step grows with the square of its size.
pub const MAX_NEURONS: usize = 200;

/// Size, regularisation and effort of a training.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkOptions {
    /// Neurons in the hidden layer.
    pub neurons: Neurons,
    /// Trainings from different random weights, of which the one with the largest evidence is
    /// kept; at least 1.
    pub restarts: usize,
    /// Seed of the random weights; restart i takes this plus i.
    pub seed: u64,
    /// The last stage ends when two steps in a row each lower the merit by less than this share;
    /// every stage before it has twice the tolerance of the next.
    pub tolerance: f64,
    /// Steps after which a stage ends in any case.
    pub steps_per_stage: usize,
    /// The input of the study that is the third state of a network of one axis.
    /// `identify::network` takes the study's only one where this is `None`, and none for
    /// `none`.
    pub input: Option<String>,
}

impl Default for NetworkOptions {
    /// The paper's forty neurons, five restarts.
    fn default() -> Self {
        let limits = Limits::default();
        Self {
            neurons: Neurons::Fixed(40),
            restarts: 5,
            seed: 1,
            tolerance: limits.tolerance,
            steps_per_stage: limits.steps_per_stage,
            input: None,
        }
    }
}

impl NetworkOptions {
    pub(super) fn limits(&self) -> Limits {
        Limits {
            tolerance: self.tolerance,
            steps_per_stage: self.steps_per_stage,
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        if let Neurons::Fixed(neurons) = self.neurons
            && !(1..=MAX_NEURONS).contains(&neurons)
        {
            return Err(Error::usage(format!(
                "a network has 1 to {MAX_NEURONS} neurons, not {neurons}"
            )));
        }
        if !(1..=MAX_RESTARTS).contains(&self.restarts) {
            return Err(Error::usage(format!(
                "a training has 1 to {MAX_RESTARTS} restarts, not {}",
                self.restarts
            )));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) || self.steps_per_stage == 0 {
            return Err(Error::usage(
                "a training needs a tolerance between 0 and 1 and at least one step per stage",
            ));
        }
        Ok(())
    }
}

/// Weights and biases of a network.
pub(super) fn parameters(inputs: usize, neurons: usize, outputs: usize) -> usize {
    neurons * (inputs + 1 + outputs) + outputs
}
