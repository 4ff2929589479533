//! Counts in SI units as CSV, and the study.toml beside them.

use super::frames::{Counts, Heard, Run};
use super::written::{StudyFrom, Written};
use crate::model::corrections::later;
use crate::text::error::{Error, Result};
use crate::text::output;
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::wire::rig::{Rig, RigAxis};
use jointwatch_shared::wire::telemetry::Quantity;
use jointwatch_shared::wire::wiring::AxisWiring;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Fewest rows of a record.
const MIN_ROWS: usize = 100;
/// The input's place among the counts.
const INPUT: usize = CHANNELS - 1;
/// The part of a stream that validates is one of so many.
const PARTS: usize = 3;

/// One channel of an axis: the end of its column's name, its place among the counts, and what a
/// count is worth.
struct Channel {
    column: String,
    place: usize,
    step: f64,
    /// What it is at count 0.
    zero: f64,
    /// By how many samples the board reads it late, which is taken off.
    late: f64,
}

/// One axis as it is written.
struct Axis<'a> {
    name: String,
    quantity: Quantity,
    rig: &'a RigAxis,
    wiring: &'a AxisWiring,
    channels: Vec<Channel>,
}

/// Writes the study of what was heard.
pub(super) fn study(heard: &Heard, rig: &Rig, raw_force: bool, out: &Path) -> Result<StudyFrom> {
    let (axes, mut notes) = axes(heard, rig);
    let rate = rig.sample_rate_hz;
    let mut records: Vec<(Written, String)> = Vec::new();
    for run in &heard.runs {
        let number = records.len() + 1;
        match run.alarm {
            None => {
                let file = format!("run_{number}.csv");
                records.extend(record(file, run, .., heard.every, rate, &axes));
            }
            Some(alarm) => {
                let parts = [("before", 0..alarm), ("after", alarm..u64::MAX)];
                for (part, range) in parts {
                    let file = format!("alarm_{alarm}_{part}.csv");
                    records.extend(record(file, run, range, 1, rate, &axes));
                }
            }
        }
    }
    // What came before an alarm may be of the joint as it was, or not.
    let after = records.iter().any(|(r, _)| r.file.ends_with("_after.csv"));
    for (record, _) in &mut records {
        record.in_study =
            record.rows >= MIN_ROWS && !(after && record.file.ends_with("_before.csv"));
    }
    if !records.iter().any(|(record, _)| record.in_study) {
        let rows: usize = records.iter().map(|(record, _)| record.rows).sum();
        return Err(Error::data(format!(
            "the frames hold {rows} samples, and a record needs at least {MIN_ROWS}; have the device stream for longer"
        )));
    }
    notes.extend(said(heard, rig, raw_force, rate));
    let written: Vec<Written> = records.iter().map(|(record, _)| record.clone()).collect();
    let text = study_toml(&axes, &written);
    folder(out)?;
    for (record, content) in &records {
        output::write_whole(&out.join(&record.file), content.as_bytes())?;
    }
    output::write_whole(&out.join("study.toml"), text.as_bytes())?;
    Ok(StudyFrom {
        records: written,
        sample_rate_hz: rate / heard.every as f64,
        notes,
    })
}

/// Makes the folder, or takes an empty one.
fn folder(out: &Path) -> Result<()> {
    let failed = |e: std::io::Error| {
        Error::failed(format!(
            "{}: this folder could not be made ({e})",
            out.display()
        ))
    };
    fs::create_dir_all(out).map_err(failed)?;
    if fs::read_dir(out).map_err(failed)?.next().is_some() {
        return Err(Error::failed(format!(
            "{} is not empty: name another folder, or empty it first",
            out.display()
        )));
    }
    Ok(())
}

/// What a person should know of these records.
fn said(heard: &Heard, rig: &Rig, raw_force: bool, rate: f64) -> Vec<String> {
    let mut notes = Vec::new();
    let tally = &heard.tally;
    for (count, what) in [
        (tally.lost, "frames were lost on the way"),
        (tally.damaged, "frames were damaged"),
        (heard.late, "samples were not taken in time"),
        (
            heard.pieces_lost as u64,
            "pieces of the counts around an alarm did not arrive",
        ),
    ] {
        if count > 0 {
            notes.push(format!("{count} {what}; what they held is a gap"));
        }
    }
    if tally.torn_end {
        notes.push("the file ends in the middle of a frame, which is left out".to_owned());
    }
    if heard.every > 1 {
        notes.push(format!(
            "every {}th sample was streamed, so motion above {} Hz folds into the records; stream every sample",
            heard.every,
            0.5 * rate / heard.every as f64
        ));
    }
    let corrected = |axis: &RigAxis| axis.force_cross != 0.0 || axis.force_delay_samples != 0.0;
    if !raw_force && rig.axes.iter().any(corrected) {
        notes.push(
            "the rig block corrects its force channels, and how much of that is its model's doing only its blob tells; name it with --model \
             to have them as measured"
                .to_owned(),
        );
    }
    notes
}

/// The axes with the channels that are wired.
fn axes<'a>(heard: &Heard, rig: &'a Rig) -> (Vec<Axis<'a>>, Vec<String>) {
    let mut notes = Vec::new();
    if heard.axes.len() != rig.axes.len() {
        notes.push(
            "the frames do not tell the names of the axes; those in study.toml are guessed"
                .to_owned(),
        );
    }
    let axes = rig.axes.iter().zip(&rig.wiring.axes).enumerate();
    let axes = axes.map(|(number, (axis, wiring))| {
        let turns = wiring.acceleration[1].is_some();
        let (name, quantity) = match heard.axes.get(number) {
            Some(told) => (told.name.to_string(), told.kind),
            None if turns => ("phi".to_owned(), Quantity::Rotation),
            None => (format!("axis{number}"), Quantity::Translation),
        };
        let (length, force) = match quantity {
            Quantity::Translation => ("m", "N"),
            Quantity::Rotation => ("rad", "Nm"),
        };
        let has_own_body = wiring.body.is_some() && wiring.body != wiring.near;
        let channels = [
            (true, "far", length.to_owned(), axis.displacement_step),
            (
                wiring.near.is_some(),
                "near",
                length.to_owned(),
                axis.displacement_step,
            ),
            (has_own_body, "body", length.to_owned(), axis.body_step),
            (
                axis.acceleration_step > 0.0,
                "a",
                format!("{length}_s2"),
                axis.acceleration_step,
            ),
            (true, "F", force.to_owned(), axis.force_step),
            (
                wiring.input.is_some(),
                "input",
                String::new(),
                axis.input_step,
            ),
        ];
        let delays = axis.delays;
        let late = [
            delays.displacement,
            delays.displacement,
            delays.body,
            delays.acceleration,
            axis.force_delay_samples,
            delays.input,
        ];
        let channels = channels.into_iter().enumerate();
        let channels = channels.filter(|(_, (wired, ..))| *wired);
        Axis {
            channels: channels
                .map(|(place, (_, what, unit, step))| Channel {
                    column: format!("{name}_{what}_{unit}").trim_end_matches('_').into(),
                    place,
                    step,
                    zero: if place == INPUT { axis.input_zero } else { 0.0 },
                    late: late[place],
                })
                .collect(),
            name,
            quantity,
            rig: axis,
            wiring,
        }
    });
    (axes.collect(), notes)
}

/// One record as CSV; none where no sample falls into the range.
fn record(
    file: String,
    run: &Run,
    range: impl std::ops::RangeBounds<u64>,
    every: u64,
    rate: f64,
    axes: &[Axis<'_>],
) -> Option<(Written, String)> {
    let mut text = String::from("t_s");
    for channel in axes.iter().flat_map(|axis| &axis.channels) {
        let _ = write!(text, ",{}", channel.column);
    }
    text.push('\n');
    let mut written = Written {
        file,
        rows: 0,
        gaps: 0,
        missing: 0,
        in_study: false,
    };
    // Samples without a gap between them.
    let mut stretch: Vec<(u64, &Counts)> = Vec::new();
    for (number, counts) in run.samples.range(range) {
        // A stream that was asked for anew may come more often than most of it did.
        let next = stretch.last().map_or(*number, |(last, _)| last + every);
        let distance = number.saturating_sub(next);
        if distance > 0 {
            written.gaps += 1;
            written.missing += distance / every;
            rows(&mut text, &stretch, (rate, every), axes);
            stretch.clear();
        }
        written.rows += 1;
        stretch.push((*number, counts));
    }
    rows(&mut text, &stretch, (rate, every), axes);
    (written.rows > 0).then_some((written, text))
}

/// Rows of samples without a gap, every channel put in time.
fn rows(
    text: &mut String,
    stretch: &[(u64, &Counts)],
    (rate, every): (f64, u64),
    axes: &[Axis<'_>],
) {
    let mut columns = Vec::new();
    for (number, axis) in axes.iter().enumerate() {
        for channel in &axis.channels {
            let value = |(_, counts): &(u64, &Counts)| {
                channel.zero + f64::from(counts[number][channel.place]) * channel.step
            };
            let values: Vec<f64> = stretch.iter().map(value).collect();
            columns.push(match channel.late == 0.0 {
                true => values,
                false => later(&values, channel.late / every as f64),
            });
        }
    }
    for (row, (number, _)) in stretch.iter().enumerate() {
        let _ = write!(text, "{:?}", *number as f64 / rate);
        for column in &columns {
            let _ = write!(text, ",{:?}", column[row]);
        }
        text.push('\n');
    }
}

fn study_toml(axes: &[Axis<'_>], records: &[Written]) -> String {
    let mut text = String::from(
        "# Written by `jointwatch study-from` from what a device sent. `jointwatch study` explains the keys.\n\
         name = \"from a device\"\ntime = \"t_s\"\n",
    );
    for axis in axes {
        axis_toml(&mut text, axis);
    }
    let mut in_study = records.iter().filter(|record| record.in_study).peekable();
    let only = records.iter().filter(|record| record.in_study).count() == 1;
    while let Some(record) = in_study.next() {
        let file = &record.file;
        let mut entry = |role: &str, rows: String| {
            let _ = write!(
                text,
                "\n[[record]]\nfile = \"{file}\"\nrole = \"{role}\"\n{rows}"
            );
        };
        let enough = record.rows >= 2 * PARTS * MIN_ROWS;
        let split = record.rows - record.rows / PARTS;
        match (only, in_study.peek()) {
            // What is around an alarm is short: errors come from blocks that are held out.
            (true, _) if enough && !file.starts_with("alarm_") => {
                entry("train", format!("rows = [0, {split}]\n"));
                entry("validate", format!("rows = [{split}, {}]\n", record.rows));
            }
            (false, None) => entry("validate", String::new()),
            _ => entry("train", String::new()),
        }
    }
    for record in records.iter().filter(|record| !record.in_study) {
        let _ = write!(
            text,
            "\n# {}: {}.\n# [[record]]\n# file = \"{}\"\n# role = \"train\"\n",
            record.file,
            match record.rows >= MIN_ROWS {
                true => "from before the alarm, when the joint may have been as it is now or not",
                false => "too short for a record",
            },
            record.file
        );
    }
    let terms: Vec<String> = axes
        .iter()
        .flat_map(|axis| ["stiffness", "viscous"].map(|term| format!("\"{term}@{}\"", axis.name)))
        .collect();
    let _ = write!(
        text,
        "\n# The physics you believe in; `jointwatch effects` lists all.\n[base]\nterms = [{}]   # guessed\n",
        terms.join(", ")
    );
    text
}

fn axis_toml(text: &mut String, axis: &Axis<'_>) {
    let column = |place: usize| {
        let found = axis.channels.iter().find(|c| c.place == place);
        found.map(|c| format!("\"{}\"", c.column))
    };
    let kind = match axis.quantity {
        Quantity::Translation => "translation",
        Quantity::Rotation => "rotation",
    };
    let displacement: Vec<String> = [0, 1].into_iter().filter_map(column).collect();
    let _ = write!(
        text,
        "\n[[axis]]\nname = \"{}\"\nkind = \"{kind}\"\ndisplacement = [{}]\n",
        axis.name,
        displacement.join(", ")
    );
    let body = match axis.wiring.body {
        Some(body) if Some(body) == axis.wiring.near => column(1),
        _ => column(2),
    };
    for (key, column) in [
        ("body_position", body),
        ("acceleration", column(3)),
        ("force", column(4)),
    ] {
        if let Some(column) = column {
            let _ = writeln!(text, "{key} = {column}");
        }
    }
    let rig = axis.rig;
    let _ = writeln!(text, "inertia = {:?}", rig.inertia);
    if rig.inertia_minus_force {
        text.push_str("restoring_force = \"inertia_minus_force\"\n");
    }
    for (key, value) in [
        ("ground_stiffness", rig.ground_stiffness),
        ("ground_damping", rig.ground_damping),
    ] {
        if value != 0.0 {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
    let _ = writeln!(text, "encoder_step = {:?}", rig.displacement_step);
    if let Some(column) = column(INPUT) {
        let _ = write!(text, "\n[[input]]\nname = {column}\ncolumn = {column}\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_come_more_often_than_the_rest_are_no_gap() {
        let numbers = [0, 10, 20, 21, 22, 32, 62];
        let samples = numbers.map(|number| (number, Counts::default()));
        let run = Run {
            samples: samples.into_iter().collect(),
            alarm: None,
        };
        let (written, _) = record("run.csv".into(), &run, .., 10, 1000.0, &[]).unwrap();
        assert_eq!((written.rows, written.gaps, written.missing), (7, 1, 2));
    }
}
