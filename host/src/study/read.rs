//! Reading a study: description, plan, logs, time, checks.

use super::channels::calibrated::Calibrated;
use super::check::roles;
use super::check::{self, Extent};
use super::description::{Description, RecordEntry, Source};
use super::log::{Log, MemoryLog, Request};
use super::long::records::{Thinned, thin};
use super::plan::{Plan, plan};
use super::quasi_static::{ROWS_PER_SECOND, direction};
use super::readers::long::LongLog;
use super::time::pieces::MIN_ROWS;
use super::time::sampling::Sampling;
use super::time::second_logger;
use super::time::second_logger::Wants;
use super::{Record, Role, Study, time};
use crate::text::error::{Error, Result, in_order};
use crate::text::input;
use crate::text::table::first_few;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Study {
    /// Reads `study.toml` (or the one in the folder `path`) and its logs, in parallel, and checks
    /// everything. Of records with more than 2¹⁸ rows in all, stretches spread evenly are read,
    /// and a note says so.
    ///
    /// # Errors
    /// One sentence of kind [`Data`](crate::text::error::Kind::Data) that names the file, the row
    /// (the line of a text file), the column and what to try; `docs/reference/study.md` lists
    /// what is refused.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_with(path, &[])
    }

    /// Reads every row of a study, where [`Study::read`] is content with stretches of records that
    /// are longer than a fit needs.
    ///
    /// # Errors
    /// As [`Study::read`], also for a file that is too large to be held.
    pub fn read_whole(path: &Path) -> Result<Self> {
        let (path, text) = description_text(path)?;
        Self::described(&Source::file(&path, &text), Logged::Whole, &[])
    }

    /// The study that a description makes of its logs, with further `columns` as inputs.
    pub(super) fn described(
        source: &Source<'_>,
        logged: Logged<'_>,
        columns: &[&str],
    ) -> Result<Self> {
        let mut said: Description = source.parse("reference/study.md")?;
        said.take_columns(columns);
        let (plan, axes) = plan(source, &said)?;
        let folder = source.path.parent().unwrap_or(Path::new("."));
        let mut notes = roles::check(source, &said, folder)?;
        notes.extend(derived_channels(&plan, &axes));
        let (memory, thinned) = match logged {
            Logged::Files => (None, thin(&mut said, &plan, folder)?),
            Logged::Whole => (None, Thinned::default()),
            Logged::Memory(logs) => (Some(logs), Thinned::default()),
        };
        notes.extend(thinned.note);
        let logs = Place {
            folder,
            memory,
            long: &thinned.logs,
        };
        let mut study = Self::of_records(source, &said, (&plan, axes), logs)?;
        study.notes.splice(0..0, notes);
        check::constant_channels(&study, &plan, Extent::Whole)?;
        study.direct();
        study.notes.extend(check::inputs(&study));
        study.notes.extend(check::copies(&study));
        Ok(study)
    }

    /// The study of the records that a description lists, in a folder or in memory, unchecked
    /// beside one another.
    pub(super) fn of_records(
        source: &Source<'_>,
        said: &Description,
        (plan, axes): (&Plan, Vec<super::Axis>),
        logs: Place<'_>,
    ) -> Result<Self> {
        let mut notes = Vec::new();
        let Logs {
            sample_rate_hz,
            records,
            sources,
            unused,
        } = read_records(said, plan, logs, &mut notes)?;
        let integrated = said.axis.iter().map(|axis| &axis.integrate_above_hz);
        let bands = std::iter::once(("band_hz", &said.band_hz))
            .chain(integrated.map(|hz| ("integrate_above_hz", hz)));
        for (key, hz) in bands {
            if let Some(hz) = hz
                .as_ref()
                .filter(|hz| *hz.get_ref() >= 0.5 * sample_rate_hz)
            {
                return Err(source.wrong(
                    hz,
                    format!(
                        "{key} = {} is not below half the sample rate of {sample_rate_hz} Hz; lower it or leave it out",
                        hz.get_ref()
                    ),
                ));
            }
        }
        let known_hz = axes.iter().filter_map(|axis| axis.integrated_above_hz);
        let known_hz = known_hz.fold(0.0, f64::max);
        if let Some(band) = said.band_hz.as_ref().filter(|hz| *hz.get_ref() <= known_hz) {
            return Err(source.wrong(
                band,
                format!(
                    "band_hz = {} leaves nothing of a displacement that is integrated above {known_hz} Hz; raise it or leave it out, or lower \
                     integrate_above_hz",
                    band.get_ref()
                ),
            ));
        }
        Ok(Self {
            quasi_static: said.is_quasi_static(),
            name: said
                .name
                .clone()
                .unwrap_or_else(|| folder_name(logs.folder)),
            sample_rate_hz,
            band_hz: said.band_hz.as_ref().map(|b| *b.get_ref()),
            leave_out_standstill: said.leave_out_standstill,
            axes,
            inputs: said.inputs(),
            records,
            sources,
            base_terms: said
                .base
                .terms
                .iter()
                .map(|t| t.get_ref().clone())
                .collect(),
            unused,
            notes,
            path: source.path.to_owned(),
        })
    }

    /// Puts the direction of travel in the place of every velocity, where there is no time.
    pub(super) fn direct(&mut self) {
        if !self.quasi_static {
            return;
        }
        for record in &mut self.records {
            for (axis, channels) in self.axes.iter().zip(&mut record.axes) {
                let path = channels.relative_displacement();
                channels.velocity = Some(direction(&path, axis.encoder_step));
            }
        }
    }
}

/// The path and the text of a `study.toml`, or of the one in a folder.
pub(super) fn description_text(path: &Path) -> Result<(PathBuf, String)> {
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
    // Some editors begin the file with a byte order mark, which TOML does not know.
    let text = match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    };
    Ok((path, text))
}

/// A study without a name is called after its folder.
pub(super) fn folder_name(folder: &Path) -> String {
    folder
        .canonicalize()
        .ok()
        .and_then(|f| f.file_name().map(|n| n.to_string_lossy().into_owned()))
        .unwrap_or_else(|| "study".to_owned())
}

/// What is said of every axis whose displacement is integrated, or whose acceleration is derived
/// from a relative displacement.
fn derived_channels(plan: &Plan, axes: &[super::Axis]) -> Vec<String> {
    let said = plan.axes.iter().zip(axes).flat_map(|(channels, axis)| {
        let integrated = match channels.integrate_above_hz {
            Some(hz) => Some(format!(
                "the displacement is the acceleration integrated twice above {hz} Hz: where the joint rests and what moves slower is not \
                 known"
            )),
            None => channels.displacement.is_empty().then(|| {
                "the displacement is the integral of the velocity, from 0 at the beginning of every record, so little is known of what \
                 depends on place"
                    .into()
            }),
        };
        let is_derived = channels.displacement.len() == 2
            && channels.body_position.is_none()
            && channels.acceleration.is_none()
            && axis.inertia != Some(0.0);
        let derived = is_derived.then(|| {
            "acceleration is derived from the relative displacement, which is right only when the far side does not accelerate; give \
             body_position or acceleration otherwise"
                .into()
        });
        let all = [integrated, derived].into_iter().flatten();
        all.map(|what: String| format!("axis {:?}: {what}", axis.name))
    });
    said.collect()
}

/// Where a study's logs are, and how much is read of them.
pub(super) enum Logged<'a> {
    /// Files, of which stretches are read where they are long.
    Files,
    /// Files, every row of them.
    Whole,
    /// Columns that are in memory, one log for each name that the description calls a file.
    Memory(&'a [MemoryLog]),
}

/// Where the logs of a description are.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    /// The folder of their files.
    pub(super) folder: &'a Path,
    /// Those that are no files.
    pub(super) memory: Option<&'a [MemoryLog]>,
    /// Those that are opened already because they are too long to be read whole.
    pub(super) long: &'a [Arc<LongLog>],
}

/// What all logs together give.
struct Logs {
    sample_rate_hz: f64,
    records: Vec<Record>,
    sources: Vec<super::Source>,
    /// Columns that every one has and no channel uses.
    unused: Vec<String>,
}

/// The logs that are too long to be read whole, each opened once: several records may be stretches
/// of one. Some are `known` already.
fn opened_once(requests: &[Request<'_>], known: &[Arc<LongLog>]) -> Result<Vec<Arc<LongLog>>> {
    let mut long = known.to_vec();
    for request in requests {
        if !long.iter().any(|log| log.is_at(request.path)) {
            long.extend(LongLog::where_needed(request)?.map(Arc::new));
        }
    }
    Ok(long)
}

/// What is wanted of every log.
fn requests<'a>(
    said: &'a Description,
    plan: &'a Plan,
    paths: &'a [PathBuf],
    memory: Option<&'a [MemoryLog]>,
) -> Vec<Request<'a>> {
    let entries = said.record.iter().zip(paths);
    let request = |(entry, path): (&'a RecordEntry, &'a PathBuf)| Request {
        memory: memory.and_then(|logs| logs.iter().find(|log| log.name == *entry.file.get_ref())),
        sparse: plan.resample_hz.is_some(),
        ..entry.request(path, Some(&plan.wanted))
    };
    entries.map(request).collect()
}

/// Reads all logs, settles the sample rate, and turns them into records.
fn read_records(
    said: &Description,
    plan: &Plan,
    place: Place<'_>,
    notes: &mut Vec<String>,
) -> Result<Logs> {
    let Place { folder, memory, .. } = place;
    let files = said.record.iter().map(|entry| entry.file.get_ref());
    let paths: Vec<PathBuf> = files.map(|file| folder.join(file)).collect();
    let requests = requests(said, plan, &paths, memory);
    let long = opened_once(&requests, place.long)?;
    let long_of = |request: &Request<'_>| long.iter().find(|log| log.is_at(request.path));
    let wants = Wants {
        wanted: &plan.wanted,
        time: plan.time.as_ref(),
        clocks: &plan.clocks,
        loggers: &plan.loggers,
    };
    let logs: Vec<(Log, Option<Sampling>)> = in_order(requests.par_iter().map(|request| {
        let log = second_logger::read(
            request,
            long_of(request).map(Arc::as_ref),
            wants,
            (folder, memory),
        )?;
        check_length(request, &log)?;
        let sampling = Sampling::of(request, &log, plan)?;
        Ok((log, sampling))
    }))?;
    let unused = unused(&requests, &logs, notes);
    let stated = said.sample_rate_hz.as_ref().map(|r| *r.get_ref());
    let stated = stated.or(said.is_quasi_static().then_some(ROWS_PER_SECOND));
    let first = logs[0].1.as_ref().map(|t| t.rate_hz);
    let rate = stated
        .or(first)
        .expect("a study has a time column or a stated rate, which was checked with its plan");
    let column = plan.time.as_ref().map_or("", |t| &t.column);
    let entries = requests.par_iter().zip(logs).zip(&said.record);
    let read: Vec<Read> = in_order(entries.map(|((request, (log, sampling)), entry)| {
        let sampling = sampling.unwrap_or_else(|| Sampling::stated(rate, rows_of(&log)));
        if (sampling.rate_hz / rate - 1.0).abs() > time::RATE_TOLERANCE {
            return Err(rate_differs(
                request,
                column,
                sampling.rate_hz,
                rate,
                stated.is_some(),
            ));
        }
        records(request, &log, &sampling, entry.role, plan)
    }))?;
    let mut records = Vec::new();
    let mut sources = Vec::new();
    for log in read {
        records.extend(log.records);
        sources.push(log.source);
        for note in log.notes {
            // Stretches of one log may say the same of it.
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    Ok(Logs {
        sample_rate_hz: rate,
        records,
        sources,
        unused,
    })
}

/// Rows of a log whose columns are all of one length.
fn rows_of(log: &Log) -> usize {
    log.values.iter().flatten().next().map_or(0, Vec::len)
}

fn check_length(request: &Request<'_>, log: &Log) -> Result<()> {
    let rows = rows_of(log);
    if rows >= MIN_ROWS {
        return Ok(());
    }
    Err(request.error(format!(
        "gives {rows} rows, and a record needs at least {MIN_ROWS}; use a longer log or wider rows = […]"
    )))
}

fn rate_differs(request: &Request<'_>, column: &str, found: f64, rate: f64, stated: bool) -> Error {
    let against = if stated {
        "study.toml states sample_rate_hz ="
    } else {
        "the first record has"
    };
    Error::data(format!(
        "{}, column {column:?}: the times run at {found} Hz but {against} {rate}; correct the rate, the unit of time, or the log, or \
         bring all records to one rate with time = {{ column = {column:?}, resample_hz = {} }}",
        request.file,
        found.min(rate)
    ))
}

/// What one `[[record]]` gives.
struct Read {
    records: Vec<Record>,
    source: super::Source,
    notes: Vec<String>,
}

fn records(
    request: &Request<'_>,
    log: &Log,
    sampling: &Sampling,
    role: Role,
    plan: &Plan,
) -> Result<Read> {
    let mut notes = log.notes.clone();
    let time = plan.time.as_ref().map(|channel| channel.column.as_str());
    notes.extend(request.lone_values(log, time, plan.quasi_static)?);
    notes.extend(plan.check_units(request, log)?);
    let done = sampling.done.iter();
    notes.extend(done.map(|done| format!("{}: {done}", request.file)));
    let first_row = request.rows.map_or(0, |[first, _]| first);
    let mut records = Vec::new();
    for (piece, (begins, rows)) in sampling.pieces().into_iter().enumerate() {
        let mut axes = Vec::new();
        for axis in &plan.axes {
            let series = |channel: &Calibrated| sampling.series(piece, channel, log);
            let (channels, absent) = axis.channels((rows, 1.0 / sampling.rate_hz), series);
            axes.push(channels);
            if piece > 0 {
                continue;
            }
            notes.extend(absent.iter().map(|column| {
                format!(
                    "{} has no column {column:?}, which is optional and counts as 0 there",
                    request.file
                )
            }));
        }
        let inputs = plan.inputs.iter().filter_map(|(name, channel)| {
            Some((name.clone(), sampling.series(piece, channel, log)?))
        });
        records.push(Record {
            file: request.file.to_owned(),
            role,
            first_row: first_row + begins,
            rows,
            axes,
            inputs: inputs.collect(),
        });
    }
    let source = super::Source {
        file: request.file.to_owned(),
        role,
        rows: [first_row, first_row + rows_of(log)],
        sha256: log.sha256.clone(),
        time: sampling.done.clone(),
        clocks: log.others.iter().map(|other| other.clock.clone()).collect(),
    };
    Ok(Read {
        records,
        source,
        notes,
    })
}

/// The columns that every log leaves unread; one note for all files that leave the same ones.
fn unused(
    requests: &[Request<'_>],
    logs: &[(Log, Option<Sampling>)],
    notes: &mut Vec<String>,
) -> Vec<String> {
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
            first_few(columns, 8)
        ));
    }
    let mut everywhere = logs
        .first()
        .map_or(Vec::new(), |(log, _)| log.unused.clone());
    everywhere.retain(|column| logs.iter().all(|(log, _)| log.unused.contains(column)));
    everywhere
}
