//! What a simulated response comes to, in words, tables and CSV.

use super::compare::{Band, Drift};
use super::run::{DIVERGED, SETTLED};
use super::{Against, Options, RecordResponse, Response};
use crate::study::{Role, Study};
use crate::text::table::{Table, rounded};
use std::fmt::Write;

/// How far the figures may be trusted, one sentence each, without a full stop.
pub(super) fn notes(
    study: &Study,
    records: &[RecordResponse],
    drifts: &[Drift],
    options: &Options,
) -> Vec<String> {
    let mut notes = Vec::new();
    for axis in &study.axes {
        let of_axis = || drifts.iter().filter(|d| d.axis == axis.name);
        let Some(worst) = of_axis().max_by(|a, b| a.force_error.total_cmp(&b.force_error)) else {
            continue;
        };
        let unit = axis.kind.displacement_unit();
        let spring = if worst.stiffness > 0.0 {
            format!(
                "the {} {}/{unit} that hold it balance the model's force error of {} {} only {} {unit} away, and it moves {} {unit} RMS",
                rounded(worst.stiffness),
                axis.kind.force_unit(),
                rounded(worst.force_error),
                axis.kind.force_unit(),
                rounded(worst.force_error / worst.stiffness),
                rounded(worst.displacement)
            )
        } else {
            format!(
                "nothing in the model pulls it back, and its force error is {} {} RMS",
                rounded(worst.force_error),
                axis.kind.force_unit()
            )
        };
        let advice = if options.restart_s.is_some() {
            "within each restart"
        } else {
            "judge it by its velocity, or look a stated time ahead with --restart SECONDS"
        };
        notes.push(format!(
            "{} has no restoring stiffness to speak of ({spring}), so errors in force pile up into drift of the position: {advice}",
            axis.name
        ));
    }
    for record in records {
        if record.step_error > SETTLED && record.diverged.is_empty() {
            notes.push(format!(
                "{}: at {} steps per row the motion still changes by {} % of its RMS when the step is halved, so these figures are \
                 the integration's as much as the model's",
                record.file,
                record.steps_per_row,
                rounded(100.0 * record.step_error)
            ));
        }
    }
    for axis in &study.axes {
        let left: Vec<String> = records
            .iter()
            .filter_map(|record| {
                let figures = record.axes.get(&axis.name).filter(|f| !f.at_rest)?;
                Some(format!(
                    "{} % of the time in {}, first at {:.3} s",
                    rounded(100.0 * figures.outside_range),
                    record.file,
                    figures.first_outside_s?
                ))
            })
            .collect();
        if !left.is_empty() {
            notes.push(format!(
                "the simulated {} leaves the training range ({}); what the model gives there was never measured",
                axis.name,
                left.join("; ")
            ));
        }
    }
    notes
}

/// The text that `jointwatch respond` prints; `asked` says whether the record was chosen by name.
pub fn in_words(response: &Response, study: &Study, asked: bool) -> String {
    let mut text = match response.against {
        Against::Truth => String::from(
            "The simulated rig with the model in place of its joint, shaken by the same drive, against its true motion",
        ),
        Against::Measurement => String::from(
            "The body moved by the logged force with the model in place of the joint, against the measured motion",
        ),
    };
    match response.restart_s {
        Some(seconds) => {
            let _ = write!(text, ", started anew from it every {seconds} s:");
        }
        None => text.push_str(", from its first state on:"),
    }
    text.push('\n');
    text.push_str(&table(response, study).to_string());
    for record in &response.records {
        if let Some(sentence) = divergence(record, study, response.restart_s) {
            let _ = write!(text, "\n{sentence}");
        }
    }
    for record in &response.records {
        let told = asked
            || record.role == Role::Validate
            || !response.records.iter().any(|r| r.role == Role::Validate);
        if let Some(table) = spectra(record, study).filter(|_| told) {
            let _ = write!(
                text,
                "\n\nDisplacement of {} by octaves, simulated over measured amplitude and error (amplitude and phase) over measured:\n{table}",
                record.file
            );
        }
    }
    text
}

fn table(response: &Response, study: &Study) -> Table {
    let mut heading = vec![
        "record",
        "role",
        "axis",
        "displacement NMSE",
        "velocity NMSE",
        "peak error",
        "RMS displacement",
        "outside range",
    ];
    let diverged = response.records.iter().any(|r| !r.diverged.is_empty());
    if diverged {
        heading.push("simulated");
    }
    let mut table = Table::new(&heading);
    for record in &response.records {
        let role = record.role.name();
        for axis in &study.axes {
            let Some(figures) = record.axes.get(&axis.name) else {
                continue;
            };
            let unit = axis.kind.displacement_unit();
            let percent = |value: f64| {
                if figures.at_rest {
                    "rests".into()
                } else if value < 1e6 {
                    format!("{value:.3} %")
                } else {
                    format!("{value:.1e} %")
                }
            };
            let mut row = vec![
                record.file.clone(),
                role.into(),
                axis.name.clone(),
                percent(figures.displacement_nmse_percent),
                percent(figures.velocity_nmse_percent),
                format!("{} m{unit}", rounded(1e3 * figures.peak_error)),
                format!("{} m{unit}", rounded(1e3 * figures.rms_displacement)),
                format!("{:.2} %", 100.0 * figures.outside_range),
            ];
            if diverged {
                row.push(format!("{:.1} %", 100.0 * record.simulated));
            }
            table.row(row);
        }
    }
    table
}

/// The sentence about a record whose simulation did not come to its end.
fn divergence(record: &RecordResponse, study: &Study, restart_s: Option<f64>) -> Option<String> {
    let first = record.diverged.first()?;
    let kind = study.axes.iter().find(|a| a.name == first.axis)?.kind;
    let unit = match first.state {
        "displacement" => kind.displacement_unit(),
        _ => kind.velocity_unit(),
    };
    let how = if first.value.is_finite() {
        format!(
            "the {} of {} reached {} {unit}, more than {DIVERGED} half-ranges from the middle of what the model was trained on",
            first.state,
            first.axis,
            rounded(first.value)
        )
    } else {
        format!(
            "the {} of {} grew beyond all numbers within one sample",
            first.state, first.axis
        )
    };
    let then = if restart_s.is_some() {
        let times = match record.diverged.len() {
            1 => "once".to_string(),
            count => format!("{count} times"),
        };
        format!(
            "in all this happened {times}, each time up to the next restart; the figures cover the {:.1} % of the record that was simulated",
            100.0 * record.simulated
        )
    } else {
        format!(
            "the simulation stops there, and the figures cover the {:.1} % of the record before",
            100.0 * record.simulated
        )
    };
    Some(format!(
        "{}: the simulation diverged at {:.3} s: {how}; {then}.",
        record.file, first.time_s
    ))
}

fn spectra(record: &RecordResponse, study: &Study) -> Option<Table> {
    let axes: Vec<(&str, &[Band])> = study
        .axes
        .iter()
        .filter_map(|axis| Some((axis.name.as_str(), record.axes.get(&axis.name)?)))
        .map(|(name, figures)| (name, figures.spectrum.as_slice()))
        .filter(|(_, bands)| !bands.is_empty())
        .collect();
    let mut centers: Vec<f64> = axes
        .iter()
        .flat_map(|(_, bands)| bands.iter().map(|b| b.center_hz))
        .collect();
    centers.sort_by(f64::total_cmp);
    centers.dedup();
    if centers.is_empty() {
        return None;
    }
    let mut heading = vec!["octave".to_string()];
    for (name, _) in &axes {
        heading.push(format!("{name} amplitude"));
        heading.push(format!("{name} error"));
    }
    let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
    let mut table = Table::new(&heading);
    for center in centers {
        let mut row = vec![format!("{center} Hz")];
        for (_, bands) in &axes {
            match bands.iter().find(|b| b.center_hz == center) {
                Some(band) => {
                    row.push(format!("{:.3}", band.ratio));
                    row.push(format!("{:.3}", band.relative_error));
                }
                None => row.extend(["".into(), "".into()]),
            }
        }
        table.row(row);
    }
    Some(table)
}

/// Time, simulated and measured states of one record, row by row; cells are empty where the
/// simulation had diverged.
pub fn as_csv(record: &RecordResponse, study: &Study) -> String {
    let mut text = String::from("time_s");
    for axis in &study.axes {
        let units = [axis.kind.displacement_unit(), axis.kind.velocity_unit()];
        for (state, unit) in ["displacement", "velocity"].iter().zip(units) {
            let (name, unit) = (&axis.name, unit.replace('/', "_"));
            let _ = write!(
                text,
                ",{name}_{state}_simulated_{unit},{name}_{state}_measured_{unit}"
            );
        }
    }
    text.push('\n');
    for row in 0..record.rows {
        let _ = write!(
            text,
            "{}",
            record.start_s + row as f64 / study.sample_rate_hz
        );
        for (simulated, measured) in record.states.iter().zip(&record.measured) {
            if simulated[row].is_finite() {
                let _ = write!(text, ",{:e}", simulated[row]);
            } else {
                text.push(',');
            }
            let _ = write!(text, ",{:e}", measured[row]);
        }
        text.push('\n');
    }
    text
}
