//! A smaller study of many records: a stated number of segments that cover state space, amplitude
//! and time.
//!
//! Every segment has a cell (where in the range it moves, how fast, how widely, how far into its
//! record) and a rank, a hash of the seed, its record and its place. Of each cell the first by rank
//! is taken, then of each the second, until the number is reached. A segment's turn only
//! grows later when others join, so a choice from choices is the choice from everything: parts
//! merge in any order, to the same bytes.

use super::plan::Plan;
use crate::signal::motion::{self, Motion};
use crate::study::description::written;
use crate::study::series::{mean, rms, spread};
use crate::study::{Record, Role, Study, own_name};
use crate::text::error::{Error, Result};
use crate::text::hexadecimal::hexadecimal;
use crate::text::{input, output};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs;
use std::ops::Range;
use std::path::Path;

/// What the list of segments says first.
const FORMAT: &str = "jointwatch-segments/1";
/// The list's file in the folder.
const LIST: &str = "segments.json";
/// Cells of the mean displacement across the range of an axis.
const PLACES: f64 = 4.0;
/// Cells of amplitude and speed below the largest, an octave each.
const OCTAVES: f64 = 5.0;
/// Cells of the time since the record began.
const TIMES: usize = 4;
/// Of so many segments one is validated on.
const VALIDATED: usize = 4;

/// How segments are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// How many are kept.
    pub segments: usize,
    /// How long each is, s.
    pub seconds: f64,
    /// Another seed chooses others.
    pub seed: u64,
}

/// Chosen segments, with what they were chosen by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Selection {
    format: String,
    plan: Plan,
    choice: Choice,
    segments: Vec<Segment>,
}

/// One segment of a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Segment {
    /// The first digits of a hash: the segment's turn within its cell, and its name.
    rank: String,
    /// The record's file, by which it is known again wherever it lies.
    file: String,
    sha256: String,
    /// The row of the record with which it begins.
    first_row: usize,
    cell: Vec<i32>,
    /// Its rows as CSV, which has a file of its own.
    #[serde(skip)]
    log: String,
}

impl Selection {
    /// A choice that holds no segment yet.
    pub fn new(plan: Plan, choice: Choice) -> Self {
        Self {
            format: FORMAT.into(),
            plan,
            choice,
            segments: Vec::new(),
        }
    }

    /// How many segments there are.
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// How many different cells they are in.
    pub fn cells(&self) -> usize {
        let cells: std::collections::BTreeSet<&[i32]> =
            self.segments.iter().map(|s| s.cell.as_slice()).collect();
        cells.len()
    }

    /// Rows of a segment.
    pub fn rows(&self) -> usize {
        (self.choice.seconds * self.plan.filters.sample_rate_hz).round() as usize
    }

    /// Cuts the training records of a study into segments, and keeps what is chosen of them and
    /// those that are there.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] for other axes or another rate,
    /// [`crate::text::error::Kind::Usage`] for segments that are shorter than the filters.
    pub fn add(&mut self, study: &Study) -> Result<()> {
        self.add_part(study, None)
    }

    /// The same of a study of a stretch of a record, of which `whole` are all rows.
    ///
    /// # Errors
    /// As [`Selection::add`].
    pub fn add_part(&mut self, study: &Study, whole: Option<&Range<usize>>) -> Result<()> {
        let plan = &self.plan;
        let axes = plan.axes.iter().map(|a| (a.name.as_str(), a.kind));
        study.check_fits(
            "the plan of the segments",
            axes,
            plan.filters.sample_rate_hz,
        )?;
        let rows = self.rows();
        let ends = plan.filters.velocity.len() - 1;
        let least = ends + 2 * plan.filters.band.len();
        if rows < least {
            return Err(Error::usage(format!(
                "--seconds {} gives {rows} rows, and this study's filters take {least} at least; give {:.2} or more",
                self.choice.seconds,
                least as f64 / plan.filters.sample_rate_hz
            )));
        }
        for (index, record) in study.records.iter().enumerate() {
            if record.role != Role::Train || record.rows < rows {
                continue;
            }
            let motion = motion::motion(study, index, record, &plan.filters)?;
            let sha256 = sha256_of(study, record);
            let count = record.rows / rows;
            for k in (0..count).filter(|k| moves(record, k * rows..(k + 1) * rows)) {
                let first_row = record.first_row + k * rows;
                let time = match whole {
                    None => TIMES * k / count,
                    Some(whole) => TIMES * (first_row - whole.start) / whole.len(),
                };
                let states = [k * rows, (k + 1) * rows - ends];
                let cell = cell(plan, &motion, states, time.min(TIMES - 1));
                self.segments.push(Segment {
                    rank: rank(self.choice.seed, sha256, first_row),
                    file: own_name(&record.file),
                    sha256: sha256.to_owned(),
                    first_row,
                    cell,
                    log: String::new(),
                });
            }
        }
        self.choose();
        // Only what was chosen is written out.
        for segment in self.segments.iter_mut().filter(|s| s.log.is_empty()) {
            let holds = |record: &&Record| {
                sha256_of(study, record) == segment.sha256
                    && (record.first_row..record.first_row + record.rows)
                        .contains(&segment.first_row)
            };
            if let Some(record) = study.records.iter().find(holds) {
                let start = segment.first_row - record.first_row;
                segment.log = written::csv(record, start..start + rows);
            }
        }
        Ok(())
    }

    /// Adds the segments of another selection, which `from` names in messages, and chooses anew.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when it was made with another study or chosen otherwise.
    pub fn merge(&mut self, other: Self, from: &str) -> Result<()> {
        if let Some(how) = self.plan.difference(&other.plan) {
            return Err(Error::data(format!(
                "{from} is {how} than the segments before it; select all of them with one study"
            )));
        }
        if self.choice != other.choice {
            return Err(Error::data(format!(
                "{from} was chosen with another number, length or seed; select with the same --segments, --seconds and --seed"
            )));
        }
        self.segments.extend(other.segments);
        self.choose();
        Ok(())
    }

    fn choose(&mut self) {
        let segments = &mut self.segments;
        segments.sort_by(|a, b| (&a.cell, &a.rank).cmp(&(&b.cell, &b.rank)));
        segments.dedup_by(|a, b| a.rank == b.rank && a.cell == b.cell);
        let mut turns: Vec<(usize, Segment)> = Vec::with_capacity(segments.len());
        for segment in segments.drain(..) {
            let turn = match turns.last() {
                Some((turn, last)) if last.cell == segment.cell => turn + 1,
                _ => 0,
            };
            turns.push((turn, segment));
        }
        turns.sort_by(|a, b| (a.0, &a.1.rank).cmp(&(b.0, &b.1.rank)));
        turns.truncate(self.choice.segments);
        segments.extend(turns.into_iter().map(|(_, segment)| segment));
        segments.sort_by(|a, b| a.rank.cmp(&b.rank));
    }

    /// Writes them into a new folder: a study.toml, a log each, and the list by which they merge.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when the folder is there and not empty, or cannot be
    /// written.
    pub fn write(&self, study: &Study, folder: &Path) -> Result<()> {
        let failed = |e: std::io::Error| {
            Error::failed(format!("{}: could not be written ({e})", folder.display()))
        };
        output::check_free(folder).map_err(failed)??;
        fs::create_dir_all(folder).map_err(failed)?;
        let mut records = Vec::new();
        for (place, segment) in self.segments.iter().enumerate() {
            let file = format!("{}.csv", segment.rank);
            output::write_whole(&folder.join(&file), segment.log.as_bytes())?;
            let validated = place % VALIDATED == VALIDATED - 1;
            records.push((
                file,
                if validated {
                    Role::Validate
                } else {
                    Role::Train
                },
            ));
        }
        let text = written::description(study, &records);
        output::write_whole(&folder.join(LIST), output::json_text(self)?.as_bytes())?;
        output::write_whole(&folder.join("study.toml"), text.as_bytes())
    }

    /// Reads a folder that [`Selection::write`] wrote.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when there is no list, or one of another version, or a
    /// log is missing.
    pub fn read(folder: &Path) -> Result<Self> {
        let wrong = |what: String| {
            Error::data(format!(
                "{}: {what}; give a folder that `jointwatch select` wrote",
                folder.display()
            ))
        };
        let text = input::read_to_string(&folder.join(LIST))
            .map_err(|e| wrong(format!("its list of segments cannot be read ({e})")))?;
        let mut read: Self = serde_json::from_str(&text)
            .map_err(|e| wrong(format!("its list of segments cannot be read ({e})")))?;
        if read.format != FORMAT {
            return Err(wrong(format!(
                "its format is '{}' where this version reads '{FORMAT}'",
                read.format
            )));
        }
        read.plan.check().map_err(wrong)?;
        for segment in &mut read.segments {
            let path = folder.join(format!("{}.csv", segment.rank));
            segment.log = input::read_to_string(&path).map_err(|e| {
                wrong(format!(
                    "the segment {} cannot be read ({e})",
                    path.display()
                ))
            })?;
        }
        Ok(read)
    }
}

/// Whether any axis moves; a study of what stands still would be refused.
fn moves(record: &Record, rows: Range<usize>) -> bool {
    record.axes.iter().any(|channels| {
        let displacement = &channels.displacement_first[rows.clone()];
        displacement.windows(2).any(|pair| pair[0] != pair[1])
    })
}

/// By what a record's file is known again, wherever it lies.
fn sha256_of<'a>(study: &'a Study, record: &Record) -> &'a str {
    let mut sources = study.sources.iter();
    let source = sources.find(|source| source.file == record.file);
    source.map_or("", |source| &source.sha256)
}

fn rank(seed: u64, sha256: &str, first_row: usize) -> String {
    let digest = Sha256::digest(format!("{seed} {sha256} {first_row}"));
    hexadecimal(&digest[..8])
}

/// Where a segment moves, how widely, how fast, and when.
fn cell(plan: &Plan, motion: &Motion, [start, end]: [usize; 2], time: usize) -> Vec<i32> {
    let mut cell = vec![time as i32];
    let octave = |share: f64| (share.log2().max(-OCTAVES)).floor() as i32;
    for (axis, states) in motion.states.chunks_exact(2).enumerate() {
        let [place, speed] = [0, 1].map(|state| {
            let range = plan.inputs[2 * axis + state];
            let series = &states[state][start..end.min(states[state].len())];
            let values = series.iter().map(|v| range.normalise(*v));
            values.collect::<Vec<f64>>()
        });
        let mean = mean(&place);
        cell.push((0.5 * (mean + 1.0) * PLACES).floor().clamp(-1.0, PLACES) as i32);
        cell.push(octave(spread(&place)));
        cell.push(octave(rms(&speed)));
    }
    cell
}
