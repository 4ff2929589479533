//! A model held against measurements: error figures per record and axis, and where the error sits.

use crate::assess::where_it_fails::{self, ErrorRecord, FailingRegion, StateName};
use crate::fit::errors::Evaluated;
pub use crate::fit::errors::{AxisFigures, RecordFigures};
use crate::model::corrections;
use crate::model::file::{AxisError, ModelFile};
use crate::signal::motion::{self, Motion};
use crate::study::series::peak;
use crate::study::{Role, Study};
use crate::text::error::Result;
use crate::text::table::{Table, hertz, percent, rounded};
use crate::text::units::prefixed;
use serde::Serialize;

/// Everything `compare` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Record by record, in the order of the study.
    pub records: Vec<RecordFigures>,
    /// On all records of a role together.
    pub verification: Vec<AxisError>,
    /// The same for records the model was not learnt from; empty when there are none.
    pub validation: Vec<AxisError>,
    /// Where most of the error sits: on validation records, or on training records when there are
    /// no others.
    #[serde(rename = "where")]
    pub places: Vec<FailingRegion>,
}

impl Comparison {
    /// The role of the records that the model is judged by.
    pub(crate) fn judged_role(&self) -> Role {
        judged_role(&self.validation)
    }
}

fn judged_role(validation: &[AxisError]) -> Role {
    match validation.is_empty() {
        true => Role::Train,
        false => Role::Validate,
    }
}

/// Compares a model with every record of a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study is not one the model can be evaluated on:
/// other axes, another rate, another unit or sign.
pub fn compare(study: &Study, model: &ModelFile) -> Result<Comparison> {
    model.check_fits(study)?;
    let study = model.corrected(study)?;
    let motions = motion::motions(&study, &model.filters)?;
    model.check_motion(&study, &motions)?;
    let evaluated = Evaluated::corrected(&study, model, &motions)?;
    Ok(comparison(&study, model, &evaluated))
}

/// The same on motions of the study, as it was logged, that are already there.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when a record is shorter than the low-pass.
pub fn compare_motions(study: &Study, model: &ModelFile, motions: &[Motion]) -> Result<Comparison> {
    let evaluated = Evaluated::as_logged(study, model, motions)?;
    Ok(comparison(study, model, &evaluated))
}

fn comparison(study: &Study, model: &ModelFile, evaluated: &Evaluated<'_>) -> Comparison {
    let [verification, validation] =
        [Role::Train, Role::Validate].map(|role| evaluated.pooled(role));
    let role = judged_role(&validation);
    Comparison {
        records: evaluated.records(),
        verification,
        validation,
        places: places(study, model, evaluated, role),
    }
}

/// Where the error on the records of a role sits, axis by axis.
fn places(
    study: &Study,
    model: &ModelFile,
    evaluated: &Evaluated<'_>,
    role: Role,
) -> Vec<FailingRegion> {
    let judged: Vec<(&Motion, Vec<&[f64]>)> = evaluated.errors_of(role).collect();
    let motions: Vec<&Motion> = judged.iter().map(|(motion, _)| *motion).collect();
    let names = state_names(model, &motions);
    // The low-pass leaves out as many rows at both ends.
    let left_out = model.filters.band.len() / 2;
    let axes = model.axes.iter().enumerate();
    axes.flat_map(|(index, axis)| {
        let records: Vec<ErrorRecord<'_>> = judged
            .iter()
            .map(|(motion, errors)| {
                let record = &study.records[motion.record];
                let first = record.first_row + motion.first_row + left_out;
                let states = motion.states.iter();
                ErrorRecord {
                    file: &record.file,
                    start_s: first as f64 / study.sample_rate_hz,
                    states: states.map(|s| &s[left_out..s.len() - left_out]).collect(),
                    error: errors[index],
                }
            })
            .collect();
        let mut found = where_it_fails::find(
            &axis.name,
            &names,
            &records,
            study.sample_rate_hz,
            model.filters.band_hz,
        );
        let unit = axis.kind.force_unit();
        found.extend(where_it_fails::zero(&axis.name, unit, &records));
        found
    })
    // Without time only the state says where.
    .filter(|place| {
        !model.filters.quasi_static || place.kind != "time" && place.kind != "frequency"
    })
    .collect()
}

/// What the states are called in words, in the units in which they are drawn over the same records.
fn state_names(model: &ModelFile, motions: &[&Motion]) -> Vec<StateName> {
    let largest = |state: usize| {
        let series = motions.iter().filter_map(|m| m.states.get(state));
        series.fold(0.0, |most: f64, series| most.max(peak(series)))
    };
    let axes = model.axes.iter().enumerate();
    axes.flat_map(|(index, axis)| {
        let (motion, unit) = match model.filters.quasi_static {
            true => ("direction", ""),
            false => ("velocity", axis.kind.velocity_unit()),
        };
        [
            (axis.name.clone(), axis.kind.displacement_unit()),
            (format!("{motion} of {}", axis.name), unit),
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
                "{} {} NMSE, relative error {:.4}",
                e.axis,
                percent(e.nmse_percent),
                e.relative_error
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
    for axis in model.axes.iter().filter(|a| a.inertia_identified) {
        text.push_str(&relative_to_applied(&axis.name));
    }
    for (role, heading) in [
        (Role::Train, "Verification (training records)"),
        (
            Role::Validate,
            "Validation (other records; only these say how good the model is)",
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
        let table = figures_table(&records, model);
        let band = match model.filters.quasi_static {
            true => String::new(),
            false => format!(", in the band up to {}", hertz(model.filters.band_hz)),
        };
        text.push_str(&format!("{heading}{band}:\n{table}\n"));
        for worse in worse_than_the_mean(&records) {
            text.push_str(&worse);
        }
        text.push('\n');
    }
    if !comparison.places.is_empty() {
        let role = comparison.judged_role().words();
        text.push_str(&format!("Where the error on {role} records sits:\n"));
        text.push_str(&places_table(&comparison.places).to_string());
    }
    text.trim_end().to_string()
}

/// A line for every axis of a record whose force the model predicts worse than its mean would.
fn worse_than_the_mean(records: &[&RecordFigures]) -> Vec<String> {
    let axes = records
        .iter()
        .flat_map(|record| record.axes.iter().map(|axis| (&record.file, axis)));
    let worse = axes.filter(|(_, (_, figures))| !figures.at_rest && figures.nmse_percent > 100.0);
    worse
        .map(|(file, (axis, _))| {
            format!("In {file} the mean force of {axis} predicts better than the model: NMSE above 100 %.\n")
        })
        .collect()
}

/// Says which force errors are relative to where it is not the restoring force.
pub(crate) fn relative_to_applied(axis: &str) -> String {
    format!(
        "Errors on {axis} are relative to the applied force: its inertia is identified, so its restoring force is not measured by itself.\n"
    )
}

/// The figures of records, axis by axis.
fn figures_table(records: &[&RecordFigures], model: &ModelFile) -> Table {
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
                if figures.at_rest {
                    "rests".into()
                } else {
                    percent(value)
                }
            };
            table.row(vec![
                record.name(records),
                axis.name.clone(),
                percent(figures.nmse_percent),
                percent(figures.nmse_percent_wide_band),
                if figures.at_rest {
                    "rests".into()
                } else {
                    format!("{:.4}", figures.relative_error)
                },
                format!("{} {unit}", rounded(figures.peak_error)),
                format!("{} {unit}", rounded(figures.rms_force)),
                format!("{:.2} %", 100.0 * figures.outside_range),
            ]);
        }
    }
    table
}

/// Where the error sits, the largest share first.
fn places_table(places: &[FailingRegion]) -> Table {
    let mut table = Table::new(&["axis", "share of error", "of", "in"]);
    for place in places {
        let of = match place.kind {
            "state" | "zero" => format!("{:.1} % of the rows", 100.0 * place.share_of_rows),
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
    table
}
