//! How well a board measures the records that its limits are set from: a description of the rig
//! that does not fit shows here, before it blinds the monitor.

use super::chained::ChainedRecord;
use crate::device::replay::{Sampled, SetUp};
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::monitor::{CHANNEL_NAMES, Faults};

/// The share of a record's samples at a rail from which the monitor doubts a channel.
const AT_RAIL: f64 = 0.005;
/// An error on the board is told from so many times that on the log's own channels on,
const TIMES: f64 = 2.0;
/// where it is this part of the RMS force.
const NOTABLE: f64 = 0.01;

/// The error of one axis on the validation records.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardError {
    /// Name of the axis.
    pub axis: String,
    /// RMS error over RMS force with the counts of this board.
    pub board: f64,
    /// The same with counts that are as fine as the log.
    pub log: f64,
}

impl BoardError {
    /// What to doubt in the description of the rig, where the board's error is much larger.
    pub fn doubt(&self) -> Option<String> {
        let percent = |part: f64| format!("{:.2} %", 100.0 * part);
        (self.board > NOTABLE && self.board > TIMES * self.log).then(|| {
            format!(
                "as this board reads the validation records, the model's error on {} is {} of the RMS force, and {} by the log itself: check \
                 the counts, gain, excitation, sensitivity, body and ground_stiffness of this axis in rig.toml, and their units",
                self.axis,
                percent(self.board),
                percent(self.log)
            )
        })
    }
}

/// The error of every axis on the validation records.
///
/// # Errors
/// As [`SetUp::new`].
pub(super) fn errors(study: &Study, set_up: &SetUp, model: &Model) -> Result<Vec<BoardError>> {
    let plain = SetUp::new(study, model)?;
    let pooled = |of: &SetUp| -> Vec<f64> {
        let mut squares = vec![[0.0; 2]; study.axes.len()];
        let validate = study.records.iter().filter(|r| r.role == Role::Validate);
        // One that is shorter than the filters says nothing.
        for replayed in validate.filter_map(|record| of.replay(study, record, model).ok()) {
            for ([error, force], axis) in squares.iter_mut().zip(&study.axes) {
                let figures = &replayed.summary.axes[&axis.name];
                let power = figures.rms_force.powi(2) * replayed.summary.outputs as f64;
                if figures.relative_error.is_finite() {
                    *error += figures.relative_error.powi(2) * power;
                    *force += power;
                }
            }
        }
        let ratio = |[error, force]: [f64; 2]| {
            if force > 0.0 {
                (error / force).sqrt()
            } else {
                0.0
            }
        };
        squares.into_iter().map(ratio).collect()
    };
    let axes = study.axes.iter().map(|axis| axis.name.clone());
    let both = pooled(set_up).into_iter().zip(pooled(&plain));
    let errors = axes.zip(both);
    let errors = errors.map(|(axis, (board, log))| BoardError { axis, board, log });
    Ok(errors.collect())
}

/// Refuses a board of which a channel stands at its rail.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with channel, axis, record and share.
pub(super) fn check_rails(study: &Study, records: &[ChainedRecord]) -> Result<()> {
    for record in records {
        for (number, axis) in study.axes.iter().enumerate() {
            for (channel, name) in CHANNEL_NAMES.iter().enumerate().take(CHANNELS) {
                let bit = Faults::bit(number, channel);
                let at_rail = |s: &&Sampled| s.faults.saturated & bit != 0;
                let share = record.samples.iter().filter(at_rail).count() as f64
                    / record.samples.len().max(1) as f64;
                if share >= AT_RAIL {
                    return Err(Error::data(format!(
                        "{}: the {name} of axis {} stands at its rail in {:.1} % of the samples of {}, so that this board cannot measure the \
                         joint: give it a wider range or a lower gain in rig.toml",
                        study.path.display(),
                        axis.name,
                        100.0 * share,
                        record.file
                    )));
                }
            }
        }
    }
    Ok(())
}
