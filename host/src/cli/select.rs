//! `jointwatch select`: a smaller study of many records, which keeps segments that cover state space, amplitude and time.

use super::console::Console;
use crate::fit::sums::{Choice, Plan, Selection};
use crate::study::long_study::LongStudy;
use crate::study::{Role, Study};
use crate::study::further::Template;
use crate::text::error::{Error, Result, in_order};
use clap::Args;
use indicatif::ProgressBar;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Rows of a long log that are read at a time.
const STRETCH: usize = 1 << 21;
/// As many such stretches are held at once at most.
const MOST_AT_ONCE: usize = 2;

/// Options of `jointwatch select`.
#[derive(Args)]
pub(crate) struct Select {
    /// The study: its study.toml, or the folder that holds it. Its training records say what the ranges are.
    study: PathBuf,
    /// Logs to choose from in place of the study's training records; or folders that `select` wrote, to choose from their segments.
    #[arg(value_name = "RECORD|FOLDER")]
    records: Vec<PathBuf>,
    /// How many segments to keep; of four one is validated on.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    segments: u32,
    /// How long each is.
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    seconds: f64,
    /// Another seed chooses other segments.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// The folder to write: study.toml, a log per segment, and the list by which folders merge.
    #[arg(short, long, value_name = "DIR", default_value = "selected")]
    output: PathBuf,
}

impl Select {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the study");
        let long = LongStudy::of(&self.study)?;
        let study = match &long {
            Some(long) => long.sampled()?,
            None => Study::read(&self.study)?,
        };
        let template = Template::of_study(&study)?;
        let plan = Plan::of(&study, &template)?;
        if !(self.seconds.is_finite() && self.seconds > 0.0) {
            return Err(Error::usage(
                "--seconds takes a positive number, the length of a segment",
            ));
        }
        let choice = Choice {
            segments: self.segments as usize,
            seconds: self.seconds,
            seed: self.seed,
        };
        let mut selection = Selection::new(plan, choice);
        working.set_message("choosing segments");
        match &long {
            _ if !self.records.is_empty() => {}
            Some(long) => add_stretches(&mut selection, long, &study, &working)?,
            None => selection.add(&study)?,
        }
        for path in &self.records {
            add(&mut selection, &template, path)?;
        }
        if selection.is_empty() {
            return Err(Error::data(format!(
                "no record is as long as a segment of {} s; give a shorter --seconds or longer records",
                self.seconds
            )));
        }
        selection.write(&study, &self.output)?;
        working.finish_and_clear();
        console.say(format!(
            "{} segments of {} s from {} cells of place, amplitude, speed and time.\nStudy written to {}.",
            selection.len(),
            self.seconds,
            selection.cells(),
            self.output.display()
        ))?;
        console.json(&selection)
    }
}

/// Adds the segments of a study with logs that are too long to be held in memory, stretch by stretch.
fn add_stretches(
    selection: &mut Selection,
    long: &LongStudy,
    study: &Study,
    working: &ProgressBar,
) -> Result<()> {
    let length = selection.rows().max(1);
    let length = length * (STRETCH / length).max(1);
    let training = long.records.iter().filter(|r| r.role == Role::Train);
    let stretches = training.flat_map(|record| {
        let starts = record.rows.clone().step_by(length);
        starts.map(move |start| (record, start..record.rows.end.min(start + length)))
    });
    let stretches: Vec<_> = stretches
        .filter(|(record, rows)| record.log.is_some() && rows.len() >= selection.rows())
        .collect();
    for (done, some) in stretches.chunks(MOST_AT_ONCE).enumerate() {
        let done = 100 * done * MOST_AT_ONCE / stretches.len();
        working.set_message(format!("choosing segments, {done} % of the log read"));
        let read = some.par_iter().map(|(record, rows)| {
            let log = record.log.unwrap_or_default();
            long.stretch(log, rows.clone(), study.sample_rate_hz)
        });
        let read: Vec<Study> = in_order(read)?;
        for (part, (record, _)) in read.iter().zip(some) {
            selection.add_part(part, Some(&record.rows))?;
        }
    }
    Ok(())
}

/// Adds the segments of a log, or those of a folder that was selected before.
fn add(selection: &mut Selection, template: &Template, path: &Path) -> Result<()> {
    if path.is_dir() {
        let other = Selection::read(path)?;
        return selection.merge(other, &path.display().to_string());
    }
    selection.add(&template.read(path)?)
}
