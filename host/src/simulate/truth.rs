//! What truly happens in a simulated record, before any sensor makes something of it.

use super::sensors::record;
use crate::signal::motion::Motion;
use crate::study::{Record, Role};

/// What was hidden in a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The joint's states [x, ẋ, φ, φ̇], without φ on a one-axis rig; SI.
    pub states: Vec<Vec<f64>>,
    /// Restoring force per axis, N and N·m.
    pub restoring_force: Vec<Vec<f64>>,
    /// Acceleration of body 2 per axis, free of noise.
    pub acceleration: Vec<Vec<f64>>,
    /// What the shaft exerts on body 2, per axis, free of noise.
    pub force: Vec<Vec<f64>>,
}

impl Truth {
    /// The record as a model would see it through perfect sensors.
    pub fn motion(&self, record: usize, sample_rate_hz: f64) -> Motion {
        Motion {
            still: Vec::new(),
            before: Vec::new(),
            inputs: Vec::new(),
            record,
            first_row: 0,
            sample_rate_hz,
            states: self.states.clone(),
            acceleration: self.acceleration.clone(),
            ground: vec![None; self.force.len()],
            force: self.force.clone(),
        }
    }
}

/// One record before the sensors make something of it.
pub(super) struct Taken {
    /// One series per entry of [`COLUMNS`].
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) truth: Truth,
    /// What a hidden effect of the joint exerts, per axis.
    pub(super) hidden: Vec<Vec<f64>>,
}

impl Taken {
    /// The record as a study holds it, without a name.
    pub(super) fn record(&self, axes: usize) -> Record {
        record("", Role::Train, &self.columns, axes)
    }
}
