//! A study with a log too long to be held in memory: its channels as an overview, and stretches of
//! it as studies of their own.

use super::overview::Overview;
use crate::study::channels::calibrated::Calibrated;
use crate::study::description::{Description, RecordEntry, Source};
use crate::study::further::Template;
use crate::study::log::Request;
use crate::study::plan::{Plan, plan};
use crate::study::read::{Place, description_text};
use crate::study::readers::long::{LongLog, is_long, too_long};
use crate::study::{Role, Study};
use crate::text::error::Result;
use crate::text::input;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A study with a log too long to be held in memory.
pub struct LongStudy {
    /// The study's name, as study.toml states it.
    pub name: String,
    /// The sample rate that it states, Hz.
    pub sample_rate_hz: Option<f64>,
    /// Its long logs, each once.
    pub logs: Vec<Channels>,
    /// Its records, those of short logs as well.
    pub records: Vec<LongRecord>,
    /// As many rows are held in memory at once.
    pub most_rows: usize,
    folder: PathBuf,
    template: Template,
}

/// One `[[record]]` of study.toml.
#[derive(Clone, Debug)]
pub struct LongRecord {
    /// The file as study.toml names it.
    pub file: String,
    /// What it is used for.
    pub role: Role,
    /// Its rows in the log.
    pub rows: Range<usize>,
    /// Which of the long logs; nothing for a short one.
    pub log: Option<usize>,
}

/// What the study uses of a long log.
pub struct Channels {
    /// The file as study.toml names it.
    pub file: String,
    /// Its columns, in SI.
    pub columns: Vec<Channel>,
    path: PathBuf,
    names: Option<Vec<String>>,
    log: Arc<LongLog>,
    /// The column of time, behind the others.
    time: Option<Channel>,
}

/// A column of a log, and what makes SI of its numbers.
pub struct Channel {
    /// The column's name in the log.
    pub name: String,
    /// Its SI unit; nothing for an input.
    pub unit: String,
    place: usize,
    si: Box<dyn Fn(f64) -> f64 + Send + Sync>,
}

impl LongStudy {
    /// The study at a path, when one of its logs is too long to be read as its records ask for it;
    /// nothing where all can be read.
    ///
    /// # Errors
    /// As [`Study::read`], of the description and of what the long logs say of themselves.
    pub fn of(path: &Path) -> Result<Option<Self>> {
        let (path, text) = description_text(path)?;
        let source = Source::file(&path, &text);
        let said: Description = source.parse("reference/study.md")?;
        let (plan, _) = plan(&source, &said)?;
        let folder = path.parent().unwrap_or(Path::new(".")).to_owned();
        let most_rows = input::limit() as usize / (8 * plan.wanted.len().max(1));
        let mut long = false;
        let (mut logs, mut records) = (Vec::<Channels>::new(), Vec::new());
        for entry in &said.record {
            let file = entry.file.get_ref();
            let stated = entry.rows.as_ref().map(|rows| *rows.get_ref());
            let known = logs.iter().position(|log| log.file == *file);
            let log = match known {
                None if is_long(&folder.join(file)) => {
                    logs.push(Channels::open(entry, &plan, &folder)?);
                    Some(logs.len() - 1)
                }
                known => known,
            };
            let rows = stated.map_or(0..0, |[from, to]| from..to);
            let rows = match log {
                Some(log) if stated.is_none() => 0..logs[log].rows(),
                _ => rows,
            };
            long |= log.is_some() && rows.len() > most_rows;
            records.push(LongRecord {
                file: file.clone(),
                role: entry.role,
                rows,
                log,
            });
        }
        let name = said.name.clone();
        let name = name.unwrap_or_else(|| crate::study::read::folder_name(&folder));
        Ok(long.then(|| Self {
            name,
            sample_rate_hz: said.sample_rate_hz.as_ref().map(|rate| *rate.get_ref()),
            logs,
            records,
            template: Template::of_text(&path.to_string_lossy(), text, 0.0),
            most_rows,
            folder,
        }))
    }

    /// Some rows of a long log as a record to learn from, of a study that runs at this rate.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn stretch(&self, log: usize, rows: Range<usize>, sample_rate_hz: f64) -> Result<Study> {
        let (path, text) = (self.template.path(), self.template.text());
        let template = Template::of_text(&path.to_string_lossy(), text.to_owned(), sample_rate_hz);
        let long = self.opened();
        let logs = Place {
            folder: &self.folder,
            memory: None,
            long: &long,
        };
        template.of_one(&self.logs[log].file, Some([rows.start, rows.end]), logs)
    }

    fn opened(&self) -> Vec<Arc<LongLog>> {
        self.logs.iter().map(|log| Arc::clone(&log.log)).collect()
    }
}

impl Channels {
    fn open(entry: &RecordEntry, plan: &Plan, folder: &Path) -> Result<Self> {
        let file = entry.file.get_ref();
        let path = folder.join(file);
        let request = Request {
            rows: None,
            sparse: plan.resample_hz.is_some(),
            ..entry.request(&path, Some(&plan.wanted))
        };
        let Some(log) = LongLog::open(&request)? else {
            return Err(request.error(too_long(&request)));
        };
        let known = log.columns();
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        let places = request.locate(&names)?;
        let channel = |channel: &Calibrated| {
            let place = places[channel.place]?;
            Some(Channel {
                name: channel.column.clone(),
                unit: channel.unit(),
                place,
                si: Box::new(channel.si(known[place].1)),
            })
        };
        let mut columns: Vec<Channel> = Vec::new();
        for channel in plan.channels().filter_map(channel) {
            // One column may serve as two channels.
            if !columns.iter().any(|c| c.place == channel.place) {
                columns.push(channel);
            }
        }
        let time = plan.time.as_ref().and_then(channel);
        Ok(Self {
            file: file.clone(),
            columns,
            names: entry.columns.clone(),
            log: Arc::new(log),
            time,
            path,
        })
    }

    /// Rows of the log.
    pub fn rows(&self) -> usize {
        self.log.rows()
    }

    /// Its format, in words.
    pub fn format(&self) -> &str {
        self.log.format()
    }

    /// The stretches of rows that are best read one at a time.
    pub fn blocks(&self) -> Vec<Range<usize>> {
        self.log.blocks()
    }

    /// An overview of its channels, and of its time behind them, of which nothing was read yet.
    pub fn overview(&self) -> Overview {
        Overview::new(self.all().count(), self.rows())
    }

    fn all(&self) -> impl Iterator<Item = &Channel> {
        self.columns.iter().chain(&self.time)
    }

    /// Whether the study names a column of time; it is then the last channel.
    pub fn has_time(&self) -> bool {
        self.time.is_some()
    }

    /// Extremes of a channel, or of the time behind the last, as the log has them, in SI.
    pub fn in_si(&self, channel: usize, [low, high]: [f64; 2]) -> [f64; 2] {
        let si = |v| self.all().nth(channel).map_or(v, |c| (c.si)(v));
        let [a, b] = [si(low), si(high)];
        // A sensor that was mounted the other way round has a negative scale.
        if low <= high {
            [a.min(b), a.max(b)]
        } else {
            [low, high]
        }
    }

    fn places(&self) -> Vec<usize> {
        self.all().map(|c| c.place).collect()
    }

    /// Some rows of its channels as logged, the time behind them.
    ///
    /// # Errors
    /// One sentence: the file cannot be read, or is damaged.
    pub fn read(&self, rows: Range<usize>) -> Result<Vec<Vec<f64>>> {
        self.log.stretch(&self.request(), &self.places(), rows)
    }

    /// What an overview takes in of some rows.
    ///
    /// # Errors
    /// One sentence: the file cannot be read, or is damaged.
    pub fn condensed(&self, rows: Range<usize>, into: &Overview) -> Result<Vec<Vec<[f64; 2]>>> {
        let places = self.places();
        let mut all = Vec::new();
        for some in self.log.together(&places) {
            let series = self.log.stretch(&self.request(), some, rows.clone())?;
            all.extend(into.condensed(rows.start, &series));
        }
        Ok(all)
    }

    fn request(&self) -> Request<'_> {
        Request {
            file: &self.file,
            path: &self.path,
            wanted: None,
            rows: None,
            columns: self.names.as_deref(),
            memory: None,
            sparse: true,
        }
    }
}
