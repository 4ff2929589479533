//! What a drawing shows of one axis of one record: its motion, and its restoring force measured and
//! predicted.

use crate::model::file::ModelFile;
use crate::signal::motion::{Motion, low_pass};
use crate::study::AxisKind;
use crate::text::error::Result;

/// What a record runs along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Time since the record began, s.
    Time,
    /// Rows, where the log has no time.
    Rows,
}

impl Along {
    /// Words below an axis of a drawing.
    pub fn label(self) -> &'static str {
        match self {
            Self::Time => "time (s)",
            Self::Rows => "row",
        }
    }

    /// Words of a title.
    pub fn words(self) -> &'static str {
        match self {
            Self::Time => "over time",
            Self::Rows => "row by row",
        }
    }
}

/// One axis over one record; all series have the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisHistory {
    /// The axis's name, as in the study.
    pub axis: String,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// What the record runs along.
    pub along: Along,
    /// Since the record began: s, or rows.
    pub at: Vec<f64>,
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

/// Every axis of a record as a model sees it, the record's instruments put right
/// ([`ModelFile::corrected`]); both forces low-passed alike, as the error figures have them.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the states are not those of the model's inputs.
pub fn histories(model: &ModelFile, motion: &Motion) -> Result<Vec<AxisHistory>> {
    let predicted = model.predict_motion(motion)?;
    let band = &model.filters.band;
    let half = band.len() / 2;
    let axes = model.axes.iter().zip(predicted).enumerate();
    let histories = axes.map(|(index, (axis, predicted))| {
        let force = motion.restoring_force(index, axis.inertia, axis.restoring_force);
        let measured = low_pass(&force, band);
        let rows = half..half + measured.len();
        let (along, per_row) = match model.filters.quasi_static {
            true => (Along::Rows, 1.0),
            false => (Along::Time, motion.sample_rate_hz),
        };
        let since = |row: usize| (motion.first_row + row) as f64 / per_row;
        AxisHistory {
            axis: axis.name.clone(),
            kind: axis.kind,
            along,
            at: rows.clone().map(since).collect(),
            displacement: motion.states[2 * index][rows.clone()].to_vec(),
            velocity: motion.states[2 * index + 1][rows].to_vec(),
            measured,
            predicted: low_pass(&predicted, band),
        }
    });
    Ok(histories.collect())
}
