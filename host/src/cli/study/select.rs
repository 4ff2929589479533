//! `jointwatch select`: a smaller study of many records, which keeps segments that cover state
//! space, amplitude and time.

use crate::cli::console::Console;
use crate::fit::sums::{Choice, Plan, Selection};
use crate::study::further::Template;
use crate::study::long::study::LongStudy;
use crate::study::{Role, Study};
use crate::text::error::{Error, Kind, Result, in_order};
use clap::Args;
use indicatif::ProgressBar;
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Rows of a long log that are read at a time.
const STRETCH: usize = 1 << 21;
/// As many such stretches are held at once at most.
const MAX_AT_ONCE: usize = 2;

/// Options of `jointwatch select`.
#[derive(Args)]
pub(crate) struct Select {
    /// The study: its study.toml, or the folder that holds it. Its training records say what the
    /// ranges are.
    study: PathBuf,
    /// Logs to choose from in place of the study's training records; or folders that `select`
    /// wrote, to choose from their segments.
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
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the study");
        let long = LongStudy::of(&self.study)?;
        let study = match &long {
            Some(_) => Study::read(&self.study)?,
            None => Study::read_whole(&self.study)?,
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
        let mut refused = Vec::new();
        match &long {
            _ if !self.records.is_empty() => {}
            Some(long) => refused = add_stretches(&mut selection, long, &study, &working)?,
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
        if let Some(first) = refused.first() {
            console.say(format!(
                "Note: {} segments were left out; the first because {first}.",
                refused.len()
            ))?;
        }
        console.json(&selection)
    }
}

/// Adds the segments of a study with logs that are too long to be held in memory, stretch by
/// stretch; gives why some were left out.
fn add_stretches(
    selection: &mut Selection,
    long: &LongStudy,
    study: &Study,
    working: &ProgressBar,
) -> Result<Vec<String>> {
    let length_of_one = selection.rows().max(1);
    let length = length_of_one * (STRETCH.min(long.most_rows) / length_of_one).max(1);
    let training = long.records.iter().filter(|r| r.role == Role::Train);
    let stretches = training.flat_map(|record| {
        let starts = record.rows.clone().step_by(length);
        starts.map(move |start| (record, start..record.rows.end.min(start + length)))
    });
    let stretches: Vec<_> = stretches
        .filter(|(record, rows)| record.log.is_some() && rows.len() >= selection.rows())
        .collect();
    let mut refused = Vec::new();
    for (done, some) in stretches.chunks(MAX_AT_ONCE).enumerate() {
        let done = 100 * done * MAX_AT_ONCE / stretches.len();
        working.set_message(format!("choosing segments, {done} % of the log read"));
        let read = some.par_iter().map(|(record, rows)| {
            let log = record.log.unwrap_or_default();
            let read = |rows| long.stretch(log, rows, study.sample_rate_hz);
            sound(&read, rows.clone(), length_of_one)
        });
        let read: Vec<Sound> = in_order(read)?;
        for (part, (record, _)) in read.into_iter().zip(some) {
            for study in &part.studies {
                selection.add_part(study, Some(&record.rows))?;
            }
            refused.extend(part.refused);
        }
    }
    Ok(refused)
}

/// What can be used of a stretch of a log.
#[derive(Default)]
struct Sound {
    studies: Vec<Study>,
    /// Why the rest cannot.
    refused: Vec<String>,
}

/// A stretch of a log without what is refused of it: of hours one damaged row must not cost more
/// than the segment that it is in.
fn sound(
    read: &impl Fn(Range<usize>) -> Result<Study>,
    rows: Range<usize>,
    segment: usize,
) -> Result<Sound> {
    let mut found = Sound::default();
    match read(rows.clone()) {
        Ok(study) => found.studies.push(study),
        Err(e) if e.kind != Kind::Data => return Err(e),
        Err(e) if rows.len() < 2 * segment => found.refused.push(e.sentence),
        Err(_) => {
            let middle = rows.start + rows.len() / segment / 2 * segment;
            for half in [rows.start..middle, middle..rows.end] {
                let half = sound(read, half, segment)?;
                found.studies.extend(half.studies);
                found.refused.extend(half.refused);
            }
        }
    }
    Ok(found)
}

/// Adds the segments of a log, or those of a folder that was selected before.
fn add(selection: &mut Selection, template: &Template, path: &Path) -> Result<()> {
    if path.is_dir() {
        let other = Selection::read(path)?;
        return selection.merge(other, &path.display().to_string());
    }
    selection.add(&template.read(path)?)
}
