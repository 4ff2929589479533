//! `study.toml` word for word, before any log is opened: its keys, their types, and what a misspelt
//! key probably meant.

pub(crate) mod written;

use super::log::{Request, Wanted};
use super::{AxisKind, Controller, Convention, Role};
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};
use std::fmt;
use std::path::Path;
use toml::Spanned;

/// The keys of study.toml, those of its tables below them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Description {
    pub(crate) name: Option<String>,
    pub(crate) sample_rate_hz: Option<Spanned<f64>>,
    pub(crate) time: Option<Spanned<Time>>,
    pub(crate) band_hz: Option<Spanned<f64>>,
    #[serde(default)]
    pub(crate) leave_out_standstill: bool,
    #[serde(default)]
    pub(crate) axis: Vec<AxisEntry>,
    #[serde(default)]
    pub(crate) input: Vec<InputEntry>,
    #[serde(default)]
    pub(crate) record: Vec<RecordEntry>,
    #[serde(default)]
    pub(crate) clock: Vec<ClockEntry>,
    #[serde(default)]
    pub(crate) base: Base,
}

impl Description {
    /// Whether it says that the logs have no time.
    pub(crate) fn is_quasi_static(&self) -> bool {
        self.time.as_ref().is_some_and(|time| time.get_ref().none)
    }
}

/// One `[[axis]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AxisEntry {
    pub(crate) name: Spanned<String>,
    pub(crate) kind: AxisKind,
    /// Left out where only a velocity was logged.
    pub(crate) displacement: Option<Spanned<Channels>>,
    /// Says that the displacement is logged as an acceleration.
    pub(crate) integrate_above_hz: Option<Spanned<f64>>,
    pub(crate) velocity: Option<Spanned<Channels>>,
    pub(crate) body_position: Option<Spanned<Channel>>,
    pub(crate) acceleration: Option<Spanned<Channel>>,
    pub(crate) force: Spanned<Force>,
    pub(crate) inertia: Option<Spanned<f64>>,
    #[serde(default)]
    pub(crate) restoring_force: Convention,
    pub(crate) ground_stiffness: Option<Spanned<f64>>,
    pub(crate) ground_damping: Option<Spanned<f64>>,
    pub(crate) controller: Option<Spanned<Controller>>,
    pub(crate) encoder_step: Option<Spanned<f64>>,
}

/// One `[[input]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InputEntry {
    pub(crate) name: Spanned<String>,
    pub(crate) column: String,
    /// Said, not converted: parameters are per this unit.
    #[serde(default)]
    pub(crate) unit: String,
    pub(crate) scale: Option<f64>,
    pub(crate) offset: Option<f64>,
    /// The column of its own time, where it was logged at another rate.
    pub(crate) time: Option<String>,
    /// Whether the study names it.
    #[serde(skip, default = "is_named")]
    pub(crate) named: bool,
}

fn is_named() -> bool {
    true
}

/// One `[[record]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RecordEntry {
    pub(crate) file: Spanned<String>,
    pub(crate) role: Role,
    pub(crate) rows: Option<Spanned<[usize; 2]>>,
    /// Names of the columns of a file that has no heading.
    pub(crate) columns: Option<Vec<String>>,
}

impl RecordEntry {
    /// What is asked of the record's log at `path`: the columns that are `wanted`, all of them for
    /// `None`.
    pub(crate) fn request<'a>(
        &'a self,
        path: &'a Path,
        wanted: Option<&'a [Wanted]>,
    ) -> Request<'a> {
        Request {
            file: self.file.get_ref(),
            path,
            wanted,
            rows: self.rows.as_ref().map(|rows| *rows.get_ref()),
            columns: self.columns.as_deref(),
            memory: None,
            sparse: false,
        }
    }
}

/// One `[[clock]]`: a second logger of a run.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClockEntry {
    pub(crate) file: Spanned<String>,
    /// The file of the `[[record]]` whose run it logged.
    pub(crate) record: Spanned<String>,
    pub(crate) time: Spanned<Channel>,
    /// A column of this file, and the one of the record's that logged the same; left out where one
    /// clock gave both files their times.
    pub(crate) common: Option<Spanned<[String; 2]>>,
    /// How often the first is differentiated to be the second.
    pub(crate) derivative: Option<Spanned<i8>>,
    pub(crate) columns: Option<Vec<String>>,
}

/// `[base]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Base {
    #[serde(default)]
    pub(crate) terms: Vec<Spanned<String>>,
}

/// One column and what its numbers mean: SI = (number · scale + offset) · unit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChannelTable {
    pub(crate) column: String,
    pub(crate) unit: Option<String>,
    pub(crate) scale: Option<f64>,
    pub(crate) offset: Option<f64>,
    /// The bit that is set where the number, without it, is one below 0.
    pub(crate) sign_bit: Option<u32>,
    /// A column that a record may lack; it counts as 0 there.
    #[serde(default)]
    pub(crate) optional: bool,
    /// The column of the times at which this one was sampled, where it has its own.
    pub(crate) time: Option<String>,
}

/// The column of time and what its numbers mean.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TimeTable {
    column: String,
    unit: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
    resample_hz: Option<f64>,
}

/// `time`: a column's name or a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Time {
    pub(crate) channel: ChannelTable,
    /// The even rate to which all channels are brought, Hz.
    pub(crate) resample_hz: Option<f64>,
    /// Whether there is none: `time = "none"`. (A column of that name is given as a table.)
    pub(crate) none: bool,
}

/// A channel: a column's name or a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel(pub(crate) ChannelTable);

/// One channel or a list of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channels(pub(crate) Vec<ChannelTable>);

/// The applied force: its columns, none of them where nothing is applied and the log has no such
/// channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Force {
    Columns(Vec<ChannelTable>),
    Nothing,
}

impl Force {
    /// Its columns; none where nothing is applied.
    pub(crate) fn columns(&self) -> &[ChannelTable] {
        match self {
            Self::Columns(columns) => columns,
            Self::Nothing => &[],
        }
    }
}

fn plain(column: &str) -> ChannelTable {
    ChannelTable {
        column: column.to_owned(),
        unit: None,
        scale: None,
        offset: None,
        sign_bit: None,
        optional: false,
        time: None,
    }
}

struct TheTime;

impl<'de> Visitor<'de> for TheTime {
    type Value = Time;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a column's name or { column = \"…\", unit = \"…\", resample_hz = … }")
    }

    fn visit_str<E: de::Error>(self, column: &str) -> std::result::Result<Time, E> {
        Ok(Time {
            channel: plain(column),
            resample_hz: None,
            none: column == "none",
        })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Time, A::Error> {
        let table = TimeTable::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Time {
            channel: ChannelTable {
                unit: table.unit,
                scale: table.scale,
                offset: table.offset,
                ..plain(&table.column)
            },
            resample_hz: table.resample_hz,
            none: false,
        })
    }
}

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(TheTime)
    }
}

struct OneChannel;

impl<'de> Visitor<'de> for OneChannel {
    type Value = Channel;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a column's name or { column = \"…\", unit = \"…\", scale = …, offset = … }")
    }

    fn visit_str<E: de::Error>(self, column: &str) -> std::result::Result<Channel, E> {
        Ok(Channel(plain(column)))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Channel, A::Error> {
        ChannelTable::deserialize(MapAccessDeserializer::new(map)).map(Channel)
    }
}

impl<'de> Deserialize<'de> for Channel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(OneChannel)
    }
}

struct SomeChannels;

impl<'de> Visitor<'de> for SomeChannels {
    type Value = Channels;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a column's name, { column = \"…\", … }, or a list of these")
    }

    fn visit_str<E: de::Error>(self, column: &str) -> std::result::Result<Channels, E> {
        Ok(Channels(vec![plain(column)]))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Channels, A::Error> {
        OneChannel.visit_map(map).map(|c| Channels(vec![c.0]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Channels, A::Error> {
        let mut list = Vec::new();
        while let Some(Channel(channel)) = seq.next_element()? {
            list.push(channel);
        }
        Ok(Channels(list))
    }
}

impl<'de> Deserialize<'de> for Channels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(SomeChannels)
    }
}

struct TheForce;

impl TheForce {
    fn number<E: de::Error>(value: f64) -> std::result::Result<Force, E> {
        if value == 0.0 {
            return Ok(Force::Nothing);
        }
        let what = de::Unexpected::Float(value);
        Err(E::invalid_value(
            what,
            &"the columns of the applied force, or 0",
        ))
    }
}

impl<'de> Visitor<'de> for TheForce {
    type Value = Force;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        SomeChannels.expecting(f)?;
        f.write_str(", or 0 where nothing is applied")
    }

    fn visit_str<E: de::Error>(self, column: &str) -> std::result::Result<Force, E> {
        SomeChannels.visit_str(column).map(|c| Force::Columns(c.0))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> std::result::Result<Force, E> {
        Self::number(value as f64)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> std::result::Result<Force, E> {
        Self::number(value)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Force, A::Error> {
        SomeChannels.visit_map(map).map(|c| Force::Columns(c.0))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> std::result::Result<Force, A::Error> {
        SomeChannels.visit_seq(seq).map(|c| Force::Columns(c.0))
    }
}

impl<'de> Deserialize<'de> for Force {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(TheForce)
    }
}

/// The text of `study.toml`, or of another TOML file, and where it lies, to say in which line
/// something stands.
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
    /// Whether somebody wrote it and would look for a line of it.
    pub(crate) written: bool,
}

impl<'a> Source<'a> {
    /// The text of a file.
    pub(crate) fn file(path: &'a Path, text: &'a str) -> Self {
        Self {
            path,
            text,
            written: true,
        }
    }
}

impl Source<'_> {
    /// The file's content, or one sentence on what is wrong in which line; `page` of docs/
    /// describes its keys.
    pub(crate) fn parse<T: de::DeserializeOwned>(&self, page: &str) -> Result<T> {
        toml::from_str(self.text).map_err(|e| {
            let place = match e.span() {
                Some(span) => self.at(span.start),
                None => self.path.display().to_string(),
            };
            Error::data(format!("{place}: {}", explained(e.message(), page)))
        })
    }

    /// Where a byte stands: “study.toml, line 7”; the file alone where nobody wrote its lines.
    pub(crate) fn at(&self, byte: usize) -> String {
        if !self.written {
            return self.path.display().to_string();
        }
        let before = &self.text.as_bytes()[..byte.min(self.text.len())];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        format!("{}, line {line}", self.path.display())
    }

    /// An error about something that stands at `value`.
    pub(crate) fn wrong<T>(&self, value: &Spanned<T>, what: impl fmt::Display) -> Error {
        Error::data(format!("{}: {what}", self.at(value.span().start)))
    }
}

/// Adds to the parser's message what to try.
fn explained(message: &str, page: &str) -> String {
    let message = message.trim().replace('\n', ", ");
    let mut quoted = message.split('`').skip(1).step_by(2);
    let kind = if message.starts_with("unknown field") {
        "key"
    } else if message.starts_with("unknown variant") {
        "value"
    } else if message.starts_with("missing field") {
        let key = quoted.next().unwrap_or_default();
        return format!("the key {key:?} is missing here; add it, docs/{page} lists all keys");
    } else if ["invalid type", "invalid value", "invalid length"]
        .iter()
        .any(|kind| message.starts_with(kind))
    {
        return format!("{message}; docs/{page} shows how each key is written");
    } else {
        return format!("this is not TOML ({message}); compare with the example in docs/{page}");
    };
    let seen = quoted.next().unwrap_or_default();
    let known: Vec<&str> = quoted.collect();
    format!("unknown {kind} {seen:?}; {}", suggestion(seen, &known))
}
