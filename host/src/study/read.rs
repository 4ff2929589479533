//! Reading a study: description, plan, logs, time, checks.

use super::description::{Description, RecordEntry, Source};
use super::log::{Log, Request};
use super::plan::{Plan, plan};
use super::{Channels, Record, Role, Study, check, time};
use crate::text::error::{Error, Result, in_order};
use crate::text::input;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Fewest rows of a record.
const MIN_ROWS: usize = 100;

impl Study {
    /// Reads `study.toml` (or the one in the folder `path`) and all its logs, in parallel, and checks everything.
    ///
    /// # Errors
    /// One sentence of kind [`Data`](crate::text::error::Kind::Data) that names the file, the row (the line of a text file), the
    /// column and what to try; `docs/reference/study.md` lists what is refused.
    pub fn read(path: &Path) -> Result<Self> {
        let path = if path.is_dir() {
            path.join("study.toml")
        } else {
            path.to_owned()
        };
        let bytes = input::read(&path).map_err(|e| {
            Error::data(format!(
                "{} cannot be read ({e}); give the path of a study.toml or of the folder it is in",
                path.display()
            ))
        })?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let bytes = e.as_bytes();
            let before = &bytes[..e.utf8_error().valid_up_to()];
            Error::data(format!(
                "{}, line {}: this is not UTF-8 text; save study.toml as UTF-8",
                path.display(),
                1 + before.iter().filter(|b| **b == b'\n').count()
            ))
        })?;
        let source = Source {
            path: &path,
            // Some editors begin the file with a byte order mark, which TOML does not know.
            text: text.strip_prefix('\u{feff}').unwrap_or(&text),
        };
        let said = source.parse("reference/study.md")?;
        let (plan, axes) = plan(&source, &said)?;
        let folder = path.parent().unwrap_or(Path::new(".")).to_owned();
        let mut notes = check_records(&source, &said, &folder)?;
        notes.extend(axis_notes(&plan, &axes));
        let (sample_rate_hz, records) = read_records(&said, &plan, &folder, &mut notes)?;
        if let Some(band) = &said.band_hz
            && *band.get_ref() >= 0.5 * sample_rate_hz
        {
            return Err(source.wrong(
                band,
                format!(
                    "band_hz = {} is not below half the sample rate of {sample_rate_hz} Hz; lower it or leave it out",
                    band.get_ref()
                ),
            ));
        }
        let study = Self {
            name: said.name.clone().unwrap_or_else(|| folder_name(&folder)),
            sample_rate_hz,
            band_hz: said.band_hz.as_ref().map(|b| *b.get_ref()),
            axes,
            records,
            base_terms: said
                .base
                .terms
                .iter()
                .map(|t| t.get_ref().clone())
                .collect(),
            notes,
            path: path.clone(),
        };
        check::constant_channels(&study, &plan)?;
        Ok(study)
    }
}

/// A study without a name is called after its folder.
fn folder_name(folder: &Path) -> String {
    folder
        .canonicalize()
        .ok()
        .and_then(|f| f.file_name().map(|n| n.to_string_lossy().into_owned()))
        .unwrap_or_else(|| "study".to_owned())
}

/// Roles and overlaps, before any log is opened.
fn check_records(source: &Source<'_>, said: &Description, folder: &Path) -> Result<Vec<String>> {
    if !said.record.iter().any(|r| r.role == Role::Train) {
        return Err(Error::data(format!(
            "{}: no [[record]] has role = \"train\"; give that role to the records to learn from",
            source.path.display()
        )));
    }
    let mut notes = Vec::new();
    if !said.record.iter().any(|r| r.role == Role::Validate) {
        notes.push(
            "no record has role = \"validate\", so nothing will show how good a model is on data it has not seen"
                .to_owned(),
        );
    }
    let real = |entry: &RecordEntry| -> PathBuf {
        let path = folder.join(entry.file.get_ref());
        path.canonicalize().unwrap_or(path)
    };
    let span = |entry: &RecordEntry| {
        entry
            .rows
            .as_ref()
            .map_or([0, usize::MAX], |r| *r.get_ref())
    };
    for (i, second) in said.record.iter().enumerate() {
        for first in &said.record[..i] {
            let ([a, b], [c, d]) = (span(first), span(second));
            if real(first) != real(second) || a.max(c) >= b.min(d) {
                continue;
            }
            if first.role != second.role {
                return Err(source.wrong(
                    &second.file,
                    format!(
                        "{:?} is used to train and to validate with the same rows, so validation would show nothing; \
                         separate them with rows = […]",
                        second.file.get_ref()
                    ),
                ));
            }
            notes.push(format!(
                "{} is listed twice with the same rows, which then count twice",
                second.file.get_ref()
            ));
        }
    }
    Ok(notes)
}

fn axis_notes(plan: &Plan, axes: &[super::Axis]) -> Vec<String> {
    plan.axes
        .iter()
        .zip(axes)
        .filter(|(p, axis)| {
            p.displacement.len() == 2
                && p.body_position.is_none()
                && p.acceleration.is_none()
                && axis.inertia != Some(0.0)
        })
        .map(|(_, axis)| {
            format!(
                "axis {:?}: acceleration is derived from the relative displacement, which is right only when the far side \
                 does not accelerate; give body_position or acceleration otherwise",
                axis.name
            )
        })
        .collect()
}

/// Reads all logs, settles the sample rate, and turns them into records.
fn read_records(
    said: &Description,
    plan: &Plan,
    folder: &Path,
    notes: &mut Vec<String>,
) -> Result<(f64, Vec<Record>)> {
    let paths: Vec<PathBuf> = said
        .record
        .iter()
        .map(|entry| folder.join(entry.file.get_ref()))
        .collect();
    let requests: Vec<Request<'_>> = said
        .record
        .iter()
        .zip(&paths)
        .map(|(entry, path)| Request {
            file: entry.file.get_ref(),
            path,
            wanted: Some(&plan.wanted),
            rows: entry.rows.as_ref().map(|r| *r.get_ref()),
            columns: entry.columns.as_deref(),
        })
        .collect();
    let logs: Vec<(Log, Option<Timing>)> = in_order(requests.par_iter().map(|request| {
        let log = request.read()?;
        let timing = timing(request, &log, plan)?;
        Ok((log, timing))
    }))?;
    note_unused(&requests, &logs, notes);
    let stated = said.sample_rate_hz.as_ref().map(|r| *r.get_ref());
    let first = logs[0].1.as_ref().map(|t| t.rate);
    let rate = stated
        .or(first)
        .expect("a study has a time column or a stated rate, which was checked with its plan");
    let entries = requests.par_iter().zip(&logs).zip(&said.record);
    let records: Vec<(Record, Vec<String>)> =
        in_order(entries.map(|((request, (log, timing)), entry)| {
            if let Some(timing) = timing
                && (timing.rate / rate - 1.0).abs() > time::RATE_TOLERANCE
            {
                return Err(rate_differs(request, timing, rate, stated.is_some()));
            }
            record(request, log, timing.as_ref(), entry.role, plan, rate)
        }))?;
    Ok((
        rate,
        records
            .into_iter()
            .map(|(record, said)| {
                notes.extend(said);
                record
            })
            .collect(),
    ))
}

/// The time column of one log.
struct Timing {
    column: String,
    seconds: Vec<f64>,
    rate: f64,
    /// What to tell when the rows are even although their stamps are not.
    even: Option<String>,
}

fn timing(request: &Request<'_>, log: &Log, plan: &Plan) -> Result<Option<Timing>> {
    let rows = log.values.iter().flatten().next().map_or(0, Vec::len);
    if rows < MIN_ROWS {
        return Err(request.error(format!(
            "gives {rows} rows, and a record needs at least {MIN_ROWS}; use a longer log or wider rows = […]"
        )));
    }
    let Some(channel) = &plan.time else {
        return Ok(None);
    };
    let seconds = channel
        .series(log)
        .expect("the column of time is not optional and was located before");
    let column = channel.column.clone();
    let even = || time::even_grid(request, &column, &seconds);
    let strict = time::rate_of(request, log, &column, &seconds)
        .and_then(|rate| time::gaps(request, log, &column, &seconds, rate).map(|_| rate));
    let (rate, even) = match (strict, even) {
        (Ok(rate), _) => (rate, None),
        (Err(error), even) => match even() {
            Some(even) => (even.rate_hz, Some(even.note)),
            None => return Err(error),
        },
    };
    Ok(Some(Timing {
        column,
        seconds,
        rate,
        even,
    }))
}

fn rate_differs(request: &Request<'_>, timing: &Timing, rate: f64, stated: bool) -> Error {
    let against = if stated {
        "study.toml states sample_rate_hz ="
    } else {
        "the first record has"
    };
    Error::data(format!(
        "{}, column {:?}: the times run at {} Hz but {against} {rate}; correct the rate, the unit of time, or the log",
        request.file, timing.column, timing.rate
    ))
}

fn record(
    request: &Request<'_>,
    log: &Log,
    timing: Option<&Timing>,
    role: Role,
    plan: &Plan,
    rate: f64,
) -> Result<(Record, Vec<String>)> {
    let mut notes = log.notes.clone();
    let time = plan.time.as_ref().map(|channel| channel.column.as_str());
    notes.extend(request.lone_values(log, time)?);
    notes.extend(plan.check_units(request, log)?);
    let mut gaps = Vec::new();
    notes.extend(timing.and_then(|t| t.even.clone()));
    if let Some(t) = timing.filter(|t| t.even.is_none()) {
        let (found, note) = time::gaps(request, log, &t.column, &t.seconds, rate)?;
        gaps = found;
        notes.extend(note);
    }
    let logged = log.values.iter().flatten().next().map_or(0, Vec::len);
    let mut axes = Vec::new();
    for axis in &plan.axes {
        let (mut channels, absent) = axis.channels(log, logged);
        notes.extend(absent.iter().map(|column| {
            format!(
                "{} has no column {column:?}, which is optional and counts as 0 there",
                request.file
            )
        }));
        if !gaps.is_empty() {
            every(&mut channels, |series| {
                *series = time::bridge(series, &gaps)
            });
        }
        axes.push(channels);
    }
    let record = Record {
        file: request.file.to_owned(),
        role,
        first_row: request.rows.map_or(0, |[first, _]| first),
        rows: axes[0].force.len(),
        axes,
    };
    Ok((record, notes))
}

/// Does something to every series of an axis.
fn every(channels: &mut Channels, mut change: impl FnMut(&mut Vec<f64>)) {
    change(&mut channels.displacement_first);
    change(&mut channels.force);
    let rest = [
        &mut channels.displacement_second,
        &mut channels.velocity,
        &mut channels.body_position,
        &mut channels.acceleration,
    ];
    rest.into_iter().flatten().for_each(change);
}

/// One note for all files that leave the same columns unread.
fn note_unused(requests: &[Request<'_>], logs: &[(Log, Option<Timing>)], notes: &mut Vec<String>) {
    let mut said: Vec<(&[String], Vec<&str>)> = Vec::new();
    for (request, (log, _)) in requests.iter().zip(logs) {
        if log.unused.is_empty() {
            continue;
        }
        match said.iter_mut().find(|(columns, _)| *columns == log.unused) {
            Some((_, files)) => files.push(request.file),
            None => said.push((&log.unused, vec![request.file])),
        }
    }
    for (columns, files) in said {
        let files = if files.len() == requests.len() {
            "the logs".to_owned()
        } else {
            files.join(", ")
        };
        notes.push(format!(
            "columns not used in {files}: {}",
            columns.join(", ")
        ));
    }
}
