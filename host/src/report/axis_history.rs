//! What a drawing shows of one axis of one record: its motion, and its restoring force measured and predicted.

use crate::model::file::ModelFile;
use crate::signal::motion::{Motion, low_pass};
use crate::study::AxisKind;
use crate::text::error::Result;

/// One axis over one record; all series have the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisHistory {
    /// The axis's name.
    pub axis: String,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// Since the record began, s.
    pub time_s: Vec<f64>,
    /// Relative displacement, m or rad, wide-band.
    pub displacement: Vec<f64>,
    /// Relative velocity, m/s or rad/s, wide-band.
    pub velocity: Vec<f64>,
    /// Measured restoring force in the common band, N or N·m.
    pub measured: Vec<f64>,
    /// The model's, in the same band, N or N·m.
    pub predicted: Vec<f64>,
}

impl AxisHistory {
    /// What the model leaves of the measured force, row by row, N or N·m.
    pub fn residual(&self) -> Vec<f64> {
        let forces = self.measured.iter().zip(&self.predicted);
        forces
            .map(|(measured, predicted)| measured - predicted)
            .collect()
    }
}

/// Every axis of a record as a model sees it, the record's instruments put right ([`ModelFile::corrected`]); both forces low-passed alike, as the error figures have them.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the states are not those of the model's inputs.
pub fn histories(model: &ModelFile, motion: &Motion) -> Result<Vec<AxisHistory>> {
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let predicted = model.predict(&states)?;
    let band = &model.filters.band;
    let half = band.len() / 2;
    let axes = model.axes.iter().zip(predicted).enumerate();
    let histories = axes.map(|(index, (axis, predicted))| {
        let force = motion.restoring_force(index, axis.inertia, axis.restoring_force);
        let measured = low_pass(&force, band);
        let rows = half..half + measured.len();
        let seconds = |row: usize| (motion.first_row + row) as f64 / motion.sample_rate_hz;
        AxisHistory {
            axis: axis.name.clone(),
            kind: axis.kind,
            time_s: rows.clone().map(seconds).collect(),
            displacement: motion.states[2 * index][rows.clone()].to_vec(),
            velocity: motion.states[2 * index + 1][rows].to_vec(),
            measured,
            predicted: low_pass(&predicted, band),
        }
    });
    Ok(histories.collect())
}
