//! A look at a log before any study names its columns: what they are called, their units, ranges
//! and sampling.

use super::channels::naming::{self, Named};
use super::channels::signs::{sign_bit, signed};
use super::channels::units::{Quantity, is_bare};
use super::joined::with_a_heading;
use super::log::{Column, Request};
use super::readers::long::LongLog;
use super::series::{extent, spread};
use super::time::Stamps;
use super::time::pieces::restarts;
use crate::text::error::{Error, Result};
use std::ops::Range;
use std::path::Path;

/// No log of a joint is shorter, s, where its unit of time is to be told.
const A_MOMENT_S: f64 = 0.5;
/// No log of a joint has a longer step, s, where its unit of time is to be told.
const LONG_STEP_S: f64 = 0.2;
/// Levels of a command or a switch.
const FEW_LEVELS: usize = 8;
/// Values nearer to each other than this part of their RMS are one level.
const LEVEL: f64 = 0.05;
/// Rows of a long log that are looked at.
const BEGINNING: usize = 1 << 18;

/// One column, looked at.
#[derive(Clone, Debug)]
pub struct SurveyedColumn {
    /// As the file names it.
    pub name: String,
    /// The unit, from a row of units, the file's own entry, or the name.
    pub unit: Option<String>,
    /// Its numbers; not-a-number where the cell holds none.
    pub values: Vec<f64>,
    /// Rows without a number.
    pub missing: usize,
    /// Smallest and largest number.
    pub range: [f64; 2],
    /// RMS about the mean.
    pub rms: f64,
    /// Smallest difference between neighbours that are not equal: the resolution, where the
    /// channel is coarser than its noise.
    pub step: Option<f64>,
    /// The bit that holds the sign of the numbers in the file.
    pub sign_bit: Option<u32>,
    pub(crate) named: Named,
}

impl SurveyedColumn {
    /// Whether its numbers have no size of their own: it states no unit, or counts or volts.
    pub(crate) fn is_sizeless(&self) -> bool {
        self.unit.as_deref().is_none_or(is_bare)
    }

    /// Whether it rises from every row to the next.
    pub(crate) fn rises(&self) -> bool {
        self.values.windows(2).all(|w| w[1] > w[0])
    }

    /// Whether it falls from any row to the next.
    pub(crate) fn falls(&self) -> bool {
        self.values.windows(2).any(|w| w[1] < w[0])
    }

    /// Whether it takes as many values as a measurement does. What takes fewer, but for its noise,
    /// is what something was told to do, or a switch.
    pub(crate) fn is_measured(&self) -> bool {
        let mut levels: Vec<f64> = Vec::new();
        let mut numbers = self.values.iter().filter(|value| value.is_finite());
        numbers.any(|value| {
            let is_new = |level: &f64| (value - level).abs() > LEVEL * self.rms;
            if levels.iter().all(is_new) {
                levels.push(*value);
            }
            levels.len() > FEW_LEVELS
        })
    }

    /// The column as it is in some rows.
    fn in_rows(&self, rows: Range<usize>) -> Self {
        let [from, to] = [rows.start, rows.end].map(|row| row.min(self.values.len()));
        self.holding(self.values[from..to].to_vec())
    }

    /// The column with other numbers.
    fn holding(&self, values: Vec<f64>) -> Self {
        Self {
            sign_bit: self.sign_bit,
            named: self.named.clone(),
            unit: self.unit.clone(),
            ..surveyed(self.name.clone(), None, values)
        }
    }
}

/// The times of a log.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SurveyedTime {
    /// Name of the column.
    pub column: String,
    /// How many seconds one of its units is.
    pub seconds_per_unit: f64,
    /// Whether its unit was guessed from the length of its steps.
    #[serde(skip)]
    pub(crate) guessed: bool,
    /// Sample rate that the stamps give, Hz.
    pub rate_hz: f64,
    /// Largest distance of a stamp from an even grid, in samples.
    pub jitter: f64,
    /// Samples that are missing, and in how many places.
    pub gaps: [usize; 2],
}

impl SurveyedTime {
    /// The times of a log that counts in the same column, s.
    pub(crate) fn seconds(&self, survey: &Survey) -> Option<Vec<f64>> {
        let values = &survey.column(&self.column)?.values;
        Some(values.iter().map(|t| t * self.seconds_per_unit).collect())
    }
}

/// A log, looked at.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The file, as it was given.
    pub file: String,
    /// Its format, in words.
    pub format: String,
    /// Rows of the longest column.
    pub rows: usize,
    /// Name of the column.
    pub columns: Vec<SurveyedColumn>,
    /// Its time column, when one can be told.
    pub time: Option<SurveyedTime>,
    /// What the reader repaired.
    pub notes: Vec<String>,
    /// The names of all columns in their order, empty for a column without one.
    pub(crate) heading: Vec<String>,
    /// Whether study.toml has to state this heading, since the file has none or another.
    pub(crate) states_heading: bool,
    /// Where its rows begin in the file, counted from 0.
    pub(crate) first_row: usize,
    /// Whether the file holds more rows than these.
    pub(crate) is_part: bool,
    /// Where the blocks of the file begin and end that have a heading each, or a time that begins
    /// anew, unless their time goes on from one to the next.
    pub(crate) blocks: Vec<[usize; 2]>,
    /// The sample rate that the file states beside its columns, Hz, and what it calls it.
    pub(crate) rate: Option<(String, f64)>,
}

impl Survey {
    /// Looks at a log in any format that can be read.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence: what is wrong with the file.
    pub fn of(path: &Path) -> Result<Self> {
        let file = path.display().to_string();
        let request = |columns| Request {
            file: &file,
            path,
            wanted: None,
            rows: None,
            columns,
            memory: None,
            sparse: false,
        };
        let long = match is_long(path) {
            true => LongLog::open(&request(None))?,
            false => None,
        };
        // What the beginning of a long log holds is what its columns mean.
        let beginning = long.as_ref().map(|log| [0, log.rows().min(BEGINNING)]);
        let looked_at = Request {
            rows: beginning,
            ..request(None)
        };
        let (mut table, states_heading) = match &long {
            Some(_) => (looked_at.table_of(long.as_ref())?, false),
            None => with_a_heading(&looked_at)?,
        };
        let heading: Vec<String> = table.columns.iter().map(|c| c.name.clone()).collect();
        table.columns.retain(|c| !c.name.is_empty());
        let columns: Vec<SurveyedColumn> = table
            .columns
            .into_iter()
            .map(|c| surveyed_among(c, &heading))
            .collect();
        table.notes.extend(columns.iter().filter_map(|column| {
            let bit = column.sign_bit?;
            Some(format!(
                "column {:?} holds its sign in bit {bit}, as registers of servos do: sign_bit = {bit}",
                column.name
            ))
        }));
        let rows = columns.iter().map(|c| c.values.len()).max().unwrap_or(0);
        let rows = long.as_ref().map_or(rows, LongLog::rows);
        if let Some([_, looked_at]) = beginning {
            table.notes.push(format!(
                "the log is long: its first {looked_at} rows were looked at"
            ));
        }
        if rows < 2 {
            return Err(Error::data(format!(
                "{file} holds {rows} rows; check that the logger finished writing it"
            )));
        }
        let mut time = time_of(&columns);
        let mut blocks = Vec::new();
        let mut starts = table.blocks;
        if time.is_none() && starts.is_empty() && long.is_none() {
            let clocks = columns.iter().filter(|c| c.named.time > 1);
            let clock = clocks.max_by_key(|c| c.named.time);
            starts = clock.map_or_else(Vec::new, |clock| restarts(&clock.values));
        }
        if time.is_none() && !starts.is_empty() {
            let ends = starts.iter().copied().chain([rows]);
            let begins = std::iter::once(0).chain(starts.iter().copied());
            blocks = begins.zip(ends).map(|(from, to)| [from, to]).collect();
            let first = columns.iter().map(|c| c.in_rows(0..starts[0]));
            time = time_of(&first.collect::<Vec<_>>());
        }
        Ok(Self {
            time,
            blocks,
            rate: table.rate,
            first_row: 0,
            is_part: false,
            format: table.format,
            rows,
            columns,
            notes: table.notes,
            heading,
            states_heading,
            file,
        })
    }

    /// The log as it is with some of its columns, up to the last row in which one of those that not
    /// all have holds a number.
    ///
    /// `own` says of every column of the heading whether it is kept.
    pub(crate) fn of_columns(&self, own: &[bool]) -> Self {
        let named = self.heading.iter().zip(own).filter(|(n, _)| !n.is_empty());
        let kept: Vec<&SurveyedColumn> = named
            .zip(&self.columns)
            .filter(|((_, own), _)| **own)
            .map(|(_, column)| column)
            .collect();
        let twice = |c: &SurveyedColumn| self.heading.iter().filter(|n| **n == c.name).count() > 1;
        let ends = kept.iter().filter(|c| twice(c));
        let ends = ends.filter_map(|c| c.values.iter().rposition(|v| v.is_finite()));
        let looked_at = self
            .columns
            .iter()
            .map(|c| c.values.len())
            .max()
            .unwrap_or(0);
        let end = ends.max().map_or(looked_at, |last| last + 1);
        let columns: Vec<SurveyedColumn> = kept.into_iter().map(|c| c.in_rows(0..end)).collect();
        let heading = self.heading.iter().zip(own);
        let heading = heading.map(|(name, own)| if *own { name.clone() } else { String::new() });
        Self {
            time: time_of(&columns),
            heading: heading.collect(),
            states_heading: true,
            is_part: end < looked_at,
            first_row: 0,
            ..self.holding(columns, if end < looked_at { end } else { self.rows })
        }
    }

    /// The log as it is in some of its rows.
    pub(crate) fn of_rows(&self, [from, to]: [usize; 2]) -> Self {
        let columns = self.columns.iter().map(|c| c.in_rows(from..to));
        let columns: Vec<SurveyedColumn> = columns.collect();
        Self {
            time: time_of(&columns),
            first_row: self.first_row + from,
            is_part: true,
            ..self.holding(columns, to - from)
        }
    }

    /// The log with other numbers in its columns, all of one length.
    pub(crate) fn with_values(&self, values: Vec<Vec<f64>>) -> Self {
        let rows = values.first().map_or(0, Vec::len);
        let columns = self.columns.iter().zip(values);
        let columns = columns.map(|(column, values)| column.holding(values));
        self.holding(columns.collect(), rows)
    }

    /// The log with other columns of the same names; its time and place in the file as they are.
    fn holding(&self, columns: Vec<SurveyedColumn>, rows: usize) -> Self {
        Self {
            time: self.time.clone(),
            columns,
            rows,
            blocks: Vec::new(),
            rate: self.rate.clone(),
            first_row: self.first_row,
            is_part: self.is_part,
            heading: self.heading.clone(),
            states_heading: self.states_heading,
            file: self.file.clone(),
            format: self.format.clone(),
            notes: self.notes.clone(),
        }
    }

    /// The column that is this by its name and unit alone, where one is; `force` or `displacement`.
    pub fn likeliest(&self, role: &str) -> Option<String> {
        use super::AxisKind::{Rotation, Translation};
        let quantities = match role {
            "force" => [Quantity::Force(Translation), Quantity::Force(Rotation)],
            _ => [
                Quantity::Displacement(Translation),
                Quantity::Displacement(Rotation),
            ],
        };
        let score = |c: &SurveyedColumn| quantities.iter().map(|q| c.named.score(*q)).max();
        let best = self.columns.iter().max_by_key(|c| score(c))?;
        score(best).filter(|s| *s > 0).map(|_| best.name.clone())
    }

    /// A column by its name.
    pub(crate) fn column(&self, name: &str) -> Option<&SurveyedColumn> {
        self.columns.iter().find(|c| c.name == name)
    }
}

/// Whether a file is so large that only a log can be meant.
pub fn is_long(path: &Path) -> bool {
    super::readers::long::is_long(path)
}

/// Whether a file's bytes are those of a log, in any format; not so a model file, a blob, or
/// anything else that is neither text nor a format of logs.
pub fn is_a_log(bytes: &[u8]) -> bool {
    super::readers::is_a_log(bytes)
}

/// Whether values are those of a clock: no step differs from another by more than a hundredth, or
/// by a tenth where rounding is all that keeps them from an even one, as it makes 33 and 34 ms of
/// a camera's 33.4.
fn rises_evenly(values: &[f64]) -> bool {
    let steps = values.windows(2).map(|w| w[1] - w[0]);
    let [least, most] = extent(steps);
    let last = values.len().saturating_sub(1);
    let is_rounded = || {
        let even = |row: usize| values[0] + (values[last] - values[0]) * row as f64 / last as f64;
        let off = values.iter().enumerate().map(|(row, v)| v - even(row));
        off.fold(0.0, |most: f64, off| most.max(off.abs())) <= most - least
    };
    least > 0.0 && (most < 1.01 * least || most < 1.1 * least && is_rounded())
}

/// The smallest step from row to row; what is left of one unit by rounding is no step.
pub(crate) fn smallest_step(values: &[f64]) -> Option<f64> {
    let [low, high] = extent(values.iter().copied().filter(|v| v.is_finite()));
    let steps = values.windows(2).map(|w| (w[1] - w[0]).abs());
    let steps = steps.filter(|step| *step > 1e-9 * (high - low) && step.is_finite());
    steps.min_by(f64::total_cmp)
}

/// A column of a file with columns of these names.
fn surveyed_among(column: Column, names: &[String]) -> SurveyedColumn {
    let variant = naming::variant(&column.name, names).filter(|_| column.unit.is_none());
    let found = surveyed(column.name, column.unit, column.values.unwrap_or_default());
    match variant {
        Some(named) => SurveyedColumn {
            named,
            unit: None,
            ..found
        },
        None => found,
    }
}

fn surveyed(name: String, unit: Option<String>, mut values: Vec<f64>) -> SurveyedColumn {
    let sign_bit = sign_bit(&values);
    if let Some(bit) = sign_bit {
        values
            .iter_mut()
            .for_each(|value| *value = signed(*value, bit));
    }
    let named = naming::read(&name, unit.as_deref());
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let finite: Vec<f64> = finite.collect();
    SurveyedColumn {
        missing: values.len() - finite.len(),
        range: match finite.is_empty() {
            true => [f64::NAN; 2],
            false => extent(finite.iter().copied()),
        },
        rms: spread(&finite),
        step: smallest_step(&values),
        sign_bit,
        unit: unit.or_else(|| named.unit.clone()),
        named,
        name,
        values,
    }
}

/// The column that counts the time: the one whose name or unit says so best, where it never falls;
/// of columns without names the first that changes, where it rises evenly, and so the first one
/// where its name is a unit of time alone (a path is called `s` as well), or says of no quantity
/// that it is one and no row's number.
pub(crate) fn time_of(columns: &[SurveyedColumn]) -> Option<SurveyedTime> {
    let rises = |c: &&SurveyedColumn| {
        let rising = c.values.windows(2).filter(|w| w[1] > w[0]).count();
        // Stamps that are rounded coarsely stand still in most rows; only a name makes a time of
        // those.
        let enough = match c.named.time > 1 {
            true => rising > 0,
            false => 2 * rising >= c.values.len(),
        };
        c.missing == 0 && enough && !c.falls()
    };
    let named = columns.iter().filter(|c| c.named.time > 0);
    // The last of those that say it alike.
    let best = named.filter(rises).max_by_key(|c| c.named.time);
    let is_unit = |c: &SurveyedColumn| naming::seconds(&c.name);
    let unnamed = |c: &&SurveyedColumn| {
        let number = c.name.strip_prefix('c').unwrap_or(&c.name);
        let is_numbered = number.parse::<usize>().is_ok() || is_unit(c).is_some();
        let says_nothing = || c.named.quantities.is_empty() && !is_whole(c);
        (is_numbered || says_nothing()) && rises_evenly(&c.values)
    };
    // What never changes is the number of a run.
    let mut changing = columns.iter().filter(|c| c.range[0] < c.range[1]);
    let first = changing.next().filter(unnamed);
    let column = best.or(first)?;
    let stated = column.unit.as_deref().and_then(naming::seconds);
    let stated = stated.or_else(|| is_unit(column));
    let seconds_per_unit = stated.unwrap_or_else(|| usual_unit(column));
    let seconds: Vec<f64> = column.values.iter().map(|t| t * seconds_per_unit).collect();
    let stamps = Stamps::of(&seconds)?;
    Some(SurveyedTime {
        column: column.name.clone(),
        seconds_per_unit,
        guessed: stated.is_none() && seconds_per_unit != 1.0,
        rate_hz: stamps.rate_hz,
        jitter: stamps.jitter,
        gaps: [stamps.missing, stamps.places],
    })
}

/// How many seconds one of a time's units is, by its steps: a rig is sampled at 20 Hz or faster,
/// and what counts in whole numbers counts something smaller than a second. A log of a few rows
/// that would be over in a moment is a slower one.
fn usual_unit(column: &SurveyedColumn) -> f64 {
    let length = column.range[1] - column.range[0];
    let step = length / column.values.len() as f64;
    let whole = is_whole(column);
    let (unit, coarser) = match step {
        ..=0.05 => (1.0, 1.0),
        ..=1.0 if !whole => (1.0, 1.0),
        ..=50.0 => (1e-3, 1e-3),
        ..=50e3 => (1e-6, 1e-3),
        _ => (1e-9, 1e-6),
    };
    match length * unit < A_MOMENT_S && step * coarser <= LONG_STEP_S {
        true => coarser,
        false => unit,
    }
}

/// Whether a column holds whole numbers alone.
fn is_whole(column: &SurveyedColumn) -> bool {
    column.values.iter().all(|v| v.fract() == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_few_values_but_for_its_noise_is_a_command() {
        let column = |of: fn(f64) -> f64| {
            let values = (0..2000).map(|row| of(0.0125 * f64::from(row)));
            surveyed("u".into(), None, values.collect())
        };
        assert!(column(f64::sin).is_measured());
        assert!(!column(|t| 5.0 * t.sin().signum() + 0.01 * (77.0 * t).sin()).is_measured());
    }
}
