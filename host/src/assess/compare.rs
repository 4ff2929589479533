//! A model held against measurements: error figures per record and axis, and where the error sits.

use crate::assess::where_it_fails::{self, ErrorRecord, Place, StateName};
use crate::model::corrections;
use crate::model::file::{AxisError, ModelFile};
use crate::report::prefixed;
use crate::signal::motion::{self, Motion, low_pass};
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use crate::text::table::Table;
use serde::Serialize;
use std::collections::BTreeMap;

/// Error figures of one axis on one record; the `--json` of `compare` in full.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisFigures {
    /// 100·Σ(r−r̂)²/(N·var r) with force and prediction low-passed alike, percent; r is [`Motion::measured_force`].
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
    /// Part of the rows in which at least one input of the model is outside its training range, 0 to 1.
    pub outside_range: f64,
    /// True when the axis rests in this record, so that errors relative to its force say nothing.
    pub rests: bool,
}

/// Error figures of one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordFigures {
    /// The record's file.
    pub file: String,
    /// Verification (`train`) or validation (`validate`).
    pub role: Role,
    /// Rows compared.
    pub rows: usize,
    /// Figures by axis name.
    pub axes: BTreeMap<String, AxisFigures>,
}

/// Everything `compare` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Record by record, in the order of the study.
    pub records: Vec<RecordFigures>,
    /// On all records of a role together.
    pub verification: Vec<AxisError>,
    /// The same for records the model was not learnt from; empty when there are none.
    pub validation: Vec<AxisError>,
    /// Where most of the error sits: on validation records, or on training records when there are no others.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
}

/// An axis rests in a record when its force there is under this part of its largest RMS over all records.
pub const RESTS_BELOW: f64 = 0.03;

/// Errors of one record and axis, and the measured force that they are held against.
struct Forces {
    error: Vec<f64>,
    error_band: Vec<f64>,
    force: Vec<f64>,
    force_band: Vec<f64>,
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
        let mean = force.iter().sum::<f64>() / rows;
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

/// Compares a model with every record of a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study is not one the model can be evaluated on: other axes, another rate, another unit
/// or sign.
pub fn compare(study: &Study, model: &ModelFile) -> Result<Comparison> {
    model.check_fits(study)?;
    let study = model.corrected(study)?;
    let motions = motion::motions(&study, &model.filters)?;
    model.check_motion(&study, &motions)?;
    compare_corrected(&study, model, &motions)
}

/// The same on motions of the study, as it was logged, that are already there.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when a record is shorter than the low-pass.
pub fn compare_motions(study: &Study, model: &ModelFile, motions: &[Motion]) -> Result<Comparison> {
    let corrections = model.corrections()?;
    if corrections.is_none() {
        return compare_corrected(study, model, motions);
    }
    let corrected = |motion: &Motion| {
        let record = model.corrected_record(study, motion.record, &corrections)?;
        motion::motion(study, motion.record, &record, &model.filters)
    };
    let motions: Vec<Motion> = motions.iter().map(corrected).collect::<Result<_>>()?;
    compare_corrected(study, model, &motions)
}

/// The comparison with motions in which the instruments are right.
fn compare_corrected(study: &Study, model: &ModelFile, motions: &[Motion]) -> Result<Comparison> {
    let band = &model.filters.band;
    let mut evaluated = Vec::new();
    for motion in motions {
        if motion.rows() < 2 * band.len() {
            return Err(Error::data(format!(
                "{}: {} rows are left after differentiation, fewer than twice the low-pass's {} taps; use a longer record \
                 or a larger band_hz",
                study.records[motion.record].file,
                motion.rows(),
                band.len()
            )));
        }
        evaluated.push(evaluate(model, motion, band)?);
    }

    // What counts as rest is known only once every record has been seen.
    let largest: Vec<f64> = (0..model.axes.len())
        .map(|axis| {
            let rms = evaluated
                .iter()
                .map(|forces| root_mean_square(&forces[axis].force_band));
            rms.fold(0.0, f64::max)
        })
        .collect();
    let mut records = Vec::new();
    for (motion, forces) in motions.iter().zip(&evaluated) {
        let record = &study.records[motion.record];
        let outside = outside_range(model, motion);
        let axes = model
            .axes
            .iter()
            .zip(forces)
            .enumerate()
            .map(|(index, (axis, forces))| {
                let band = Sums::of(&forces.error_band, &forces.force_band);
                let rms_force = band.rms_force();
                let figures = AxisFigures {
                    nmse_percent: band.nmse_percent(),
                    nmse_percent_wide_band: Sums::of(&forces.error, &forces.force).nmse_percent(),
                    relative_error: band.relative_error(),
                    rms_error: band.rms_error(),
                    rms_force,
                    peak_error: peak(&forces.error_band),
                    outside_range: outside,
                    rests: rms_force < RESTS_BELOW * largest[index],
                };
                (axis.name.clone(), figures)
            });
        let axes = axes.collect();
        records.push(RecordFigures {
            file: record.file.clone(),
            role: record.role,
            rows: motion.rows(),
            axes,
        });
    }

    let pooled = |role: Role| -> Vec<AxisError> {
        let of_role = || {
            evaluated
                .iter()
                .zip(motions)
                .filter(|(_, m)| study.records[m.record].role == role)
        };
        if of_role().next().is_none() {
            return Vec::new();
        }
        let axis_error = |(index, axis): (usize, &crate::model::ModelAxis)| {
            let sums = of_role()
                .map(|(forces, _)| Sums::of(&forces[index].error_band, &forces[index].force_band))
                .fold(Sums::default(), Sums::plus);
            AxisError {
                axis: axis.name.clone(),
                nmse_percent: sums.nmse_percent(),
                relative_error: sums.relative_error(),
            }
        };
        model.axes.iter().enumerate().map(axis_error).collect()
    };
    let (verification, validation) = (pooled(Role::Train), pooled(Role::Validate));

    let role = if validation.is_empty() {
        Role::Train
    } else {
        Role::Validate
    };
    let judged = motions.iter();
    let judged = judged.filter(|motion| study.records[motion.record].role == role);
    let names = state_names(model, &judged.collect::<Vec<_>>());
    let mut places = Vec::new();
    for (index, axis) in model.axes.iter().enumerate() {
        let chosen: Vec<ErrorRecord<'_>> = motions
            .iter()
            .zip(&evaluated)
            .filter(|(motion, _)| study.records[motion.record].role == role)
            .map(|(motion, forces)| ErrorRecord {
                file: &study.records[motion.record].file,
                start_s: (study.records[motion.record].first_row
                    + motion.first_row
                    + band.len() / 2) as f64
                    / study.sample_rate_hz,
                // The low-pass leaves out as many rows at both ends.
                states: motion
                    .states
                    .iter()
                    .map(|s| &s[band.len() / 2..s.len() - band.len() / 2])
                    .collect(),
                error: &forces[index].error_band,
            })
            .collect();
        places.extend(where_it_fails::find(
            &axis.name,
            &names,
            &chosen,
            study.sample_rate_hz,
            model.filters.band_hz,
        ));
    }
    Ok(Comparison {
        records,
        verification,
        validation,
        places,
    })
}

fn evaluate(model: &ModelFile, motion: &Motion, band: &[f64]) -> Result<Vec<Forces>> {
    let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
    let predicted = model.predict(&states)?;
    let forces = model
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
            Forces {
                error_band: low_pass(&error, band),
                force_band: low_pass(&force, band),
                error,
                force,
            }
        });
    Ok(forces.collect())
}

fn outside_range(model: &ModelFile, motion: &Motion) -> f64 {
    let outside = |row: usize| {
        let inputs = model.base.inputs().iter();
        inputs
            .zip(&motion.states)
            .any(|(range, state)| range.normalise(state[row]).abs() > 1.0 + 1e-9)
    };
    (0..motion.rows()).filter(|&row| outside(row)).count() as f64 / motion.rows() as f64
}

/// What the states are called in words, in the units in which they are drawn over the same records.
fn state_names(model: &ModelFile, motions: &[&Motion]) -> Vec<StateName> {
    let largest = |state: usize| {
        let series = motions.iter().filter_map(|m| m.states.get(state));
        series.fold(0.0, |most: f64, series| most.max(peak(series)))
    };
    let axes = model.axes.iter().enumerate();
    axes.flat_map(|(index, axis)| {
        let velocity = format!("velocity of {}", axis.name);
        [
            (axis.name.clone(), axis.kind.displacement_unit()),
            (velocity, axis.kind.velocity_unit()),
        ]
        .into_iter()
        .enumerate()
        .map(move |(offset, (name, unit))| {
            let (unit, factor) = prefixed(unit, largest(2 * index + offset));
            StateName { name, unit, factor }
        })
    })
    .collect()
}

/// The largest magnitude in a series.
pub(crate) fn peak(series: &[f64]) -> f64 {
    series.iter().fold(0.0, |most, value| most.max(value.abs()))
}

fn root_mean_square(series: &[f64]) -> f64 {
    (series.iter().map(|v| v * v).sum::<f64>() / series.len() as f64).sqrt()
}

/// Prints one line per axis under a heading.
///
/// # Errors
/// What `say` gives.
pub fn say_summary(
    errors: &[AxisError],
    heading: &str,
    say: impl Fn(String) -> Result<()>,
) -> Result<()> {
    let words: Vec<String> = errors
        .iter()
        .map(|e| {
            format!(
                "{} {:.3} % NMSE, relative error {:.4}",
                e.axis, e.nmse_percent, e.relative_error
            )
        })
        .collect();
    say(format!("{heading}: {}.", words.join("; ")))
}

/// The text that `jointwatch compare` prints.
pub fn in_words(comparison: &Comparison, model: &ModelFile) -> String {
    let mut text = String::new();
    for correction in corrections::in_words(&model.effects) {
        text.push_str(&format!("Corrected in the study's data: {correction}.\n"));
    }
    for (role, heading) in [
        (
            Role::Train,
            "Verification (records the model was learnt from)",
        ),
        (
            Role::Validate,
            "Validation (records it has not seen; only these say how good it is)",
        ),
    ] {
        let records: Vec<&RecordFigures> = comparison
            .records
            .iter()
            .filter(|r| r.role == role)
            .collect();
        if records.is_empty() {
            continue;
        }
        let mut table = Table::new(&[
            "record",
            "axis",
            "NMSE",
            "wide-band",
            "relative error",
            "peak error",
            "RMS force",
            "outside range",
        ]);
        for record in records {
            for axis in &model.axes {
                let Some(figures) = record.axes.get(&axis.name) else {
                    continue;
                };
                let unit = axis.kind.force_unit();
                let percent = |value: f64| {
                    if figures.rests {
                        "rests".into()
                    } else {
                        format!("{value:.3} %")
                    }
                };
                table.row(vec![
                    record.file.clone(),
                    axis.name.clone(),
                    percent(figures.nmse_percent),
                    percent(figures.nmse_percent_wide_band),
                    if figures.rests {
                        "rests".into()
                    } else {
                        format!("{:.4}", figures.relative_error)
                    },
                    format!("{} {unit}", where_it_fails::significant(figures.peak_error)),
                    format!("{} {unit}", where_it_fails::significant(figures.rms_force)),
                    format!("{:.2} %", 100.0 * figures.outside_range),
                ]);
            }
        }
        text.push_str(&format!(
            "{heading}, in the band up to {:.0} Hz:\n{table}\n\n",
            model.filters.band_hz
        ));
    }
    if !comparison.places.is_empty() {
        let role = if comparison.validation.is_empty() {
            "training"
        } else {
            "validation"
        };
        text.push_str(&format!("Where the error on {role} records sits:\n"));
        let mut table = Table::new(&["axis", "share of error", "of", "in"]);
        for place in &comparison.places {
            let of = match place.kind {
                "state" => format!("{:.1} % of the rows", 100.0 * place.share_of_rows),
                "time" => format!("{:.1} % of the time", 100.0 * place.share_of_rows),
                _ => format!("{:.1} % of the band", 100.0 * place.share_of_rows),
            };
            table.row(vec![
                place.axis.clone(),
                format!("{:.0} %", 100.0 * place.share_of_error),
                of,
                place.region.clone(),
            ]);
        }
        text.push_str(&table.to_string());
    }
    text.trim_end().to_string()
}
