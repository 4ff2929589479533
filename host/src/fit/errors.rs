//! How large a model's errors are on records: figures per record and axis, and over all records of
//! a role.

use crate::model::file::{AxisError, ModelFile};
use crate::model::{InputRange, ModelAxis};
use crate::signal::motion::{self, Motion, low_pass};
use crate::study::series::{mean, peak};
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Error figures of one axis on one record; the `--json` of `compare` in full.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisFigures {
    /// 100·Σ(r−r̂)²/(N·var r) with force and prediction low-passed alike, percent; r is
    /// [`Motion::measured_force`].
    pub nmse_percent: f64,
    /// The same without the low-pass.
    pub nmse_percent_wide_band: f64,
    /// RMS(r−r̂)/RMS(r) in the common band.
    pub relative_error: f64,
    /// RMS(r−r̂) in the common band, N or N·m.
    pub rms_error: f64,
    /// RMS(r) in the common band, N or N·m.
    pub rms_force: f64,
    /// Largest |r−r̂| in the common band, N or N·m.
    pub peak_error: f64,
    /// Part of the rows in which at least one input of the model is outside its training range, 0
    /// to 1.
    pub outside_range: f64,
    /// True when the axis rests in this record, so that errors relative to its force say nothing.
    #[serde(rename = "rests")]
    pub at_rest: bool,
}

/// Error figures of one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordFigures {
    /// The record's file, as study.toml names it.
    pub file: String,
    /// Verification (`train`) or validation (`validate`).
    pub role: Role,
    /// The row of the file where the record begins.
    pub first_row: usize,
    /// Rows that were compared.
    pub rows: usize,
    /// Figures by axis name.
    pub axes: BTreeMap<String, AxisFigures>,
}

impl RecordFigures {
    /// Its file, with the row where it begins when another one of `all` is of the same file.
    pub fn name(&self, all: &[&Self]) -> String {
        let of_file = all.iter().filter(|other| other.file == self.file);
        match of_file.count() {
            0 | 1 => self.file.clone(),
            _ => format!("{} from row {}", self.file, self.first_row),
        }
    }
}

/// An axis rests in a record when its force there is under this part of its largest RMS over all
/// records.
pub const AT_REST_BELOW: f64 = 0.03;

/// Errors of one record and axis, beside the measured force that they are held against.
struct Errors {
    /// In the common band, row by row; 0 in rows that count for nothing.
    in_band: Vec<f64>,
    of_band: Sums,
    of_wide_band: Sums,
}

/// Σ(r−r̂)², Σ(r−mean)² and Σr² of a series of errors and forces.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    error: f64,
    about_mean: f64,
    force: f64,
    rows: f64,
}

impl Sums {
    pub(crate) fn of(error: &[f64], force: &[f64]) -> Self {
        let rows = force.len().max(1) as f64;
        let mean = mean(force);
        Self {
            error: error.iter().map(|e| e * e).sum(),
            about_mean: force.iter().map(|r| (r - mean) * (r - mean)).sum(),
            force: force.iter().map(|r| r * r).sum(),
            rows,
        }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            error: self.error + other.error,
            about_mean: self.about_mean + other.about_mean,
            force: self.force + other.force,
            rows: self.rows + other.rows,
        }
    }

    pub(crate) fn nmse_percent(self) -> f64 {
        100.0 * ratio(self.error, self.about_mean)
    }

    pub(crate) fn relative_error(self) -> f64 {
        ratio(self.error, self.force).sqrt()
    }

    pub(crate) fn rms_error(self) -> f64 {
        (self.error / self.rows).sqrt()
    }

    pub(crate) fn rms_force(self) -> f64 {
        (self.force / self.rows).sqrt()
    }
}

/// A ratio that JSON can hold: an error over no force at all is as large as a number gets.
fn ratio(part: f64, whole: f64) -> f64 {
    if part == 0.0 {
        0.0
    } else {
        (part / whole).min(f64::MAX)
    }
}

/// A model evaluated along records of a study.
pub(crate) struct Evaluated<'a> {
    study: &'a Study,
    model: &'a ModelFile,
    motions: Cow<'a, [Motion]>,
    /// Per record and axis.
    errors: Vec<Vec<Errors>>,
}

impl<'a> Evaluated<'a> {
    /// Evaluates a model along motions of the study as it was logged; what the model knows to be
    /// wrong with the instruments is put right first.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a record is shorter than the low-pass.
    pub(crate) fn as_logged(
        study: &'a Study,
        model: &'a ModelFile,
        motions: &'a [Motion],
    ) -> Result<Self> {
        let corrections = model.corrections()?;
        if corrections.is_none() {
            return Self::corrected(study, model, motions);
        }
        let corrected = |motion: &Motion| {
            let record = model.corrected_record(study, motion.record, &corrections)?;
            motion::motion(study, motion.record, &record, &model.filters)
        };
        let motions: Vec<Motion> = motions.iter().map(corrected).collect::<Result<_>>()?;
        Self::corrected(study, model, motions)
    }

    /// Evaluates a model along motions in which the instruments are right.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a record is shorter than the low-pass.
    pub(crate) fn corrected(
        study: &'a Study,
        model: &'a ModelFile,
        motions: impl Into<Cow<'a, [Motion]>>,
    ) -> Result<Self> {
        let motions = motions.into();
        let band = &model.filters.band;
        let mut errors = Vec::new();
        for motion in motions.iter() {
            if motion.rows() < 2 * band.len() {
                return Err(Error::data(format!(
                    "{}: {} rows are left after differentiation, fewer than twice the low-pass's {} taps; use a longer record \
                     or a larger band_hz",
                    study.records[motion.record].file,
                    motion.rows(),
                    band.len()
                )));
            }
            errors.push(evaluate(model, motion, band)?);
        }
        Ok(Self {
            study,
            model,
            motions,
            errors,
        })
    }

    /// The figures of every record.
    pub(crate) fn records(&self) -> Vec<RecordFigures> {
        // What counts as rest is known only once every record has been seen.
        let largest: Vec<f64> = (0..self.model.axes.len())
            .map(|axis| {
                let errors = self.errors.iter();
                let rms = errors.map(|errors| errors[axis].of_band.rms_force());
                rms.fold(0.0, f64::max)
            })
            .collect();
        let records = self.motions.iter().zip(&self.errors);
        records
            .map(|(motion, errors)| {
                let record = &self.study.records[motion.record];
                let outside = outside_range(self.model, motion);
                let axes = self.model.axes.iter().zip(errors).zip(&largest);
                RecordFigures {
                    file: record.file.clone(),
                    role: record.role,
                    first_row: record.first_row,
                    rows: motion.counted_rows(),
                    axes: axes
                        .map(|((axis, errors), &largest)| {
                            (axis.name.clone(), errors.figures(outside, largest))
                        })
                        .collect(),
                }
            })
            .collect()
    }

    /// The errors of every axis over all records of a role; empty when there are none.
    pub(crate) fn pooled(&self, role: Role) -> Vec<AxisError> {
        let of_role = || self.of_role(role);
        if of_role().next().is_none() {
            return Vec::new();
        }
        let axis_error = |(index, axis): (usize, &ModelAxis)| {
            let sums = of_role()
                .map(|(_, errors)| errors[index].of_band)
                .fold(Sums::default(), Sums::plus);
            AxisError {
                axis: axis.name.clone(),
                nmse_percent: sums.nmse_percent(),
                relative_error: sums.relative_error(),
            }
        };
        self.model.axes.iter().enumerate().map(axis_error).collect()
    }

    /// The motions of a role, each with the model's errors in the common band, per axis.
    pub(crate) fn errors_of(&self, role: Role) -> impl Iterator<Item = (&Motion, Vec<&[f64]>)> {
        self.of_role(role).map(|(motion, errors)| {
            let errors = errors.iter().map(|e| e.in_band.as_slice());
            (motion, errors.collect())
        })
    }

    fn of_role(&self, role: Role) -> impl Iterator<Item = (&Motion, &Vec<Errors>)> {
        let records = self.motions.iter().zip(&self.errors);
        records.filter(move |(motion, _)| self.study.records[motion.record].role == role)
    }
}

impl Errors {
    /// The figures of one axis; `largest` is its largest RMS force over all records.
    fn figures(&self, outside_range: f64, largest: f64) -> AxisFigures {
        let band = self.of_band;
        let rms_force = band.rms_force();
        AxisFigures {
            nmse_percent: band.nmse_percent(),
            nmse_percent_wide_band: self.of_wide_band.nmse_percent(),
            relative_error: band.relative_error(),
            rms_error: band.rms_error(),
            rms_force,
            peak_error: peak(&self.in_band),
            outside_range,
            at_rest: rms_force < AT_REST_BELOW * largest,
        }
    }
}

fn evaluate(model: &ModelFile, motion: &Motion, band: &[f64]) -> Result<Vec<Errors>> {
    let predicted = model.predict_motion(motion)?;
    let errors = model
        .axes
        .iter()
        .zip(predicted)
        .enumerate()
        .map(|(index, (axis, predicted))| {
            let restoring = motion.restoring_force(index, axis.inertia, axis.restoring_force);
            let error: Vec<f64> = restoring
                .iter()
                .zip(&predicted)
                .map(|(r, p)| r - p)
                .collect();
            let force = motion.measured_force(
                index,
                axis.inertia,
                axis.inertia_identified,
                axis.restoring_force,
            );
            let mut in_band = low_pass(&error, band);
            let sums = |error: Vec<f64>, force: Vec<f64>, taps: usize| {
                let [error, force] = [error, force].map(|s| motion.counted(s, taps, 1));
                Sums::of(&error, &force)
            };
            let of_band = sums(in_band.clone(), low_pass(&force, band), band.len());
            let still = motion.still.iter().skip(band.len() / 2);
            let still = in_band.iter_mut().zip(still).filter(|(_, still)| **still);
            still.for_each(|(error, _)| *error = 0.0);
            Errors {
                in_band,
                of_band,
                of_wide_band: sums(error, force, 1),
            }
        });
    Ok(errors.collect())
}

fn outside_range(model: &ModelFile, motion: &Motion) -> f64 {
    let states = motion.base_states(model.state_input.as_deref());
    let states = model.base.inputs().iter().zip(states);
    let followed = model.followed.iter();
    let followed = followed.filter_map(|input| Some((&input.range, motion.input(&input.name)?)));
    let all: Vec<(&InputRange, &[f64])> = states.chain(followed).collect();
    let outside = |row: &usize| {
        let mut all = all.iter();
        all.any(|(range, series)| range.normalise(series[*row]).abs() > 1.0 + 1e-9)
    };
    (0..motion.rows()).filter(outside).count() as f64 / motion.rows() as f64
}
