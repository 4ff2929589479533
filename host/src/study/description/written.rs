//! A study written out in SI units: records as CSV with a column per channel, and the `study.toml`
//! that describes them.

use crate::study::{Channels, Controller, Convention, Record, Role, Study};
use std::fmt::Write;
use std::ops::Range;

/// The channels of an axis that there are, with the endings of their columns.
fn series(channels: &Channels) -> Vec<(&'static str, &[f64])> {
    let all = [
        ("displacement", Some(&channels.displacement_first)),
        ("from", channels.displacement_second.as_ref()),
        ("velocity", channels.velocity.as_ref()),
        ("position", channels.body_position.as_ref()),
        ("acceleration", channels.acceleration.as_ref()),
        ("force", Some(&channels.force)),
    ];
    let there = all.into_iter();
    there
        .filter_map(|(name, s)| Some((name, s?.as_slice())))
        .collect()
}

/// Rows of a record as CSV, each number with the digits that bring it back.
pub(crate) fn csv(record: &Record, rows: Range<usize>) -> String {
    let axes = record.axes.iter().enumerate();
    let mut columns: Vec<(String, &[f64])> = axes
        .flat_map(|(axis, channels)| {
            let named = series(channels).into_iter();
            named.map(move |(name, s)| (format!("{name}_{axis}"), s))
        })
        .collect();
    columns.extend(
        record
            .inputs
            .iter()
            .map(|(name, s)| (format!("input_{name}"), s.as_slice())),
    );
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = names.join(",");
    text.push('\n');
    for row in rows {
        for (place, (_, series)) in columns.iter().enumerate() {
            let comma = if place > 0 { "," } else { "" };
            // Writing to a string does not fail.
            let _ = write!(text, "{comma}{:e}", series[row]);
        }
        text.push('\n');
    }
    text
}

/// The `study.toml` of such records of a study.
pub(crate) fn description(study: &Study, records: &[(String, Role)]) -> String {
    let time = match study.quasi_static {
        true => "time = \"none\"".to_owned(),
        false => format!("sample_rate_hz = {:?}", study.sample_rate_hz),
    };
    let mut text = format!("name = {:?}\n{time}\n", study.name);
    let mut line = |words: String| {
        text.push_str(&words);
        text.push('\n');
    };
    if let Some(band_hz) = study.band_hz {
        line(format!("band_hz = {band_hz:?}"));
    }
    if study.leave_out_standstill {
        line("leave_out_standstill = true".into());
    }
    let channels = study.records.first().map_or(&[][..], |record| &record.axes);
    for (index, (axis, channels)) in study.axes.iter().zip(channels).enumerate() {
        line("\n[[axis]]".into());
        line(format!("name = {:?}", axis.name));
        line(format!("kind = {:?}", axis.kind.name()));
        let there = series(channels);
        let has = |name: &str| there.iter().any(|(n, _)| *n == name);
        let second = if has("from") {
            format!(", \"from_{index}\"")
        } else {
            String::new()
        };
        line(format!("displacement = [\"displacement_{index}\"{second}]"));
        let optional = [
            ("velocity", "velocity"),
            ("body_position", "position"),
            ("acceleration", "acceleration"),
        ];
        for (key, name) in optional.into_iter().filter(|(_, name)| has(name)) {
            line(format!("{key} = \"{name}_{index}\""));
        }
        let forced = study
            .records
            .iter()
            .any(|r| r.axes[index].force.iter().any(|f| *f != 0.0));
        line(if forced {
            format!("force = \"force_{index}\"")
        } else {
            "force = 0".into()
        });
        if let Some(inertia) = axis.inertia {
            line(format!("inertia = {inertia:?}"));
        }
        if axis.restoring_force == Convention::InertiaMinusForce {
            line("restoring_force = \"inertia_minus_force\"".into());
        }
        line(format!("ground_stiffness = {:?}", axis.ground_stiffness));
        line(format!("ground_damping = {:?}", axis.ground_damping));
        let Controller { kp, kd } = axis.controller;
        line(format!("controller = {{ kp = {kp:?}, kd = {kd:?} }}"));
        if let Some(step) = axis.encoder_step {
            line(format!("encoder_step = {step:?}"));
        }
    }
    for input in &study.inputs {
        line(format!(
            "\n[[input]]\nname = {:?}\ncolumn = {:?}\nunit = {:?}",
            input.name,
            format!("input_{}", input.name),
            input.unit
        ));
    }
    for (file, role) in records {
        line(format!(
            "\n[[record]]\nfile = {file:?}\nrole = {:?}",
            role.name()
        ));
    }
    if !study.base_terms.is_empty() {
        line(format!("\n[base]\nterms = {:?}", study.base_terms));
    }
    text
}
