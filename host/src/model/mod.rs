//! A learnt model as the host keeps it: `model.json`.

mod corrected;
pub mod corrections;
pub mod effects;
pub(crate) mod evaluator;
pub mod file;
mod fits_study;
mod network;
pub(crate) mod per_record;
mod polynomial;
pub(crate) mod powers;
pub mod scalar;
pub(crate) mod tanh;
pub mod time_history;
pub mod values;

pub use effects::{ModelEffect, ParameterValue};
pub use evaluator::Evaluator;
pub use network::Network;
pub use polynomial::exponents;

use crate::study::{AxisKind, Convention};
use crate::text::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// How one input is brought to ±1: `u = (value − center) / half_range`, over all training records
/// together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputRange {
    /// Middle of the training range, SI.
    pub center: f64,
    /// Half its width, SI; positive.
    pub half_range: f64,
}

impl InputRange {
    /// From the smallest to the largest value.
    pub(crate) fn of([low, high]: [f64; 2]) -> Self {
        Self {
            center: 0.5 * (high + low),
            half_range: 0.5 * (high - low),
        }
    }

    /// The normalised value, −1 to 1 inside the training range.
    pub fn normalise(&self, value: f64) -> f64 {
        (value - self.center) / self.half_range
    }

    /// The normalised values of a stretch of a series.
    pub(crate) fn normalise_all(&self, values: &[f64], normalised: &mut [f64]) {
        let inverse = 1.0 / self.half_range;
        for (u, value) in normalised.iter_mut().zip(values) {
            *u = (value - self.center) * inverse;
        }
    }

    /// Whether it is a range: finite, and of positive width.
    pub(crate) fn is_sound(&self) -> bool {
        self.center.is_finite() && self.half_range.is_finite() && self.half_range > 0.0
    }
}

/// What a force follows beside the motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FollowedInput {
    /// Its name in the study.
    pub name: String,
    /// Its range in the training records, in the unit that the study gives it.
    pub range: InputRange,
}

/// Σ a·u₁^i·u₂^j·u₃^k·u₄^l of normalised inputs, per axis (the paper's Eqs. 10 and 11).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polynomial {
    /// Highest exponent of each input, 0 to 3: displacement and velocity of each axis; of one axis
    /// a third may be an input of the study.
    pub orders: Vec<u8>,
    /// How each input is normalised.
    pub inputs: Vec<InputRange>,
    /// Per axis (m+1)(n+1)(o+1)(p+1) coefficients in N or N·m, the last input's exponent running
    /// fastest.
    pub coefficients: Vec<Vec<f64>>,
}

/// What the model knows about one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelAxis {
    /// The axis's name, as in the study.
    pub name: String,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// kg or kg·m²: as stated or identified, put right where the model holds an `inertia_error`.
    pub inertia: f64,
    /// True when the inertia was identified from the records, false when the study gave it.
    pub inertia_identified: bool,
    /// Which way round the equation of motion gives the restoring force.
    pub restoring_force: Convention,
}

/// The rows of a record's states, one series per input of a model.
///
/// # Errors
/// One sentence when the number of inputs or the lengths of the series differ.
pub(crate) fn check_states(states: &[&[f64]], inputs: usize) -> Result<usize> {
    if states.len() != inputs {
        return Err(Error::data(format!(
            "the model has {inputs} inputs and the record {}: use a study with the same axes",
            states.len()
        )));
    }
    let rows = states.first().map_or(0, |series| series.len());
    if states.iter().any(|series| series.len() != rows) {
        return Err(Error::data("the states of a record differ in length"));
    }
    Ok(rows)
}
