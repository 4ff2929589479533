//! A study: the rig and its records, as `study.toml` describes them, read into SI units.
//!
//! [`Study::read`] is the way in, and [`Study::of_memory`] for logs that are no files. What a study
//! may say, and every reason for which it is refused, stands in `docs/reference/study.md`.

mod channels;
pub(crate) mod check;
pub(crate) mod description;
pub mod draft;
pub mod further;
pub(crate) mod joined;
mod log;
pub mod long;
mod memory;
pub mod mistakes;
mod open;
mod plan;
pub(crate) mod quasi_static;
mod read;
mod readers;
pub(crate) mod series;
mod several;
pub mod survey;
pub mod time;

pub use log::MemoryLog;
pub use time::clock::Clock;

use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use jointwatch_shared::base::followed::Follows;
use jointwatch_shared::effect::Entry;
use std::path::PathBuf;

/// Translation (m, N, kg) or rotation (rad, N·m, kg·m²).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisKind {
    /// Displacement in m, force in N, inertia in kg.
    Translation,
    /// Displacement in rad, torque in N·m, inertia in kg·m².
    Rotation,
}

/// What a record is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Learnt from; comparing with it is verification.
    Train,
    /// Never learnt from; comparing with it is validation.
    Validate,
}

impl Role {
    /// What its records are called.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Train => "training",
            Self::Validate => "validation",
        }
    }
}

/// Which way round the equation of motion gives the restoring force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convention {
    /// r = inertia·acceleration − force: the log holds the force by which the drive pulls the body.
    InertiaMinusForce,
    /// r = force − inertia·acceleration (the paper's Eq. 8).
    #[default]
    ForceMinusInertia,
}

impl Convention {
    /// The s of r = s·(F − m·a): 1 for force minus inertia, −1 for inertia minus force.
    pub fn sign(self) -> f64 {
        match self {
            Self::ForceMinusInertia => 1.0,
            Self::InertiaMinusForce => -1.0,
        }
    }
}

/// One axis of the joint.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Axis {
    /// The name that stands behind the @ of an effect.
    pub name: String,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// kg or kg·m²; `None` when it is to be identified, 0 when the force already is the restoring
    /// force.
    pub inertia: Option<f64>,
    /// Which way round the equation of motion gives the restoring force.
    pub restoring_force: Convention,
    /// N/m or N·m/rad of a known spring from the body to ground.
    pub ground_stiffness: f64,
    /// N·s/m or N·m·s/rad of a known damper from the body to ground.
    pub ground_damping: f64,
    /// The gains of the controller that drove the body; 0 where none is known.
    #[serde(default)]
    pub controller: Controller,
    /// One count of the encoder, m or rad.
    pub encoder_step: Option<f64>,
    /// Whether the velocity alone was logged: the displacement is its integral.
    #[serde(default)]
    pub velocity_alone: bool,
    /// Above which frequency the displacement is an acceleration integrated twice, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integrated_above_hz: Option<f64>,
}

/// A controller of the body's position: its force grows by `−kp·b − kd·ḃ` with the position b,
/// whatever its reference is.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// Proportional gain, N/m or N·m/rad.
    #[serde(default)]
    pub kp: f64,
    /// Derivative gain, N·s/m or N·m·s/rad.
    #[serde(default)]
    pub kd: f64,
}

/// What was logged of one axis, in SI units, one value per row.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// Position of the far side, or the relative displacement itself when `displacement_second` is
    /// `None`.
    pub displacement_first: Vec<f64>,
    /// Position of the near side; relative displacement = first − second.
    pub displacement_second: Option<Vec<f64>>,
    /// Relative velocity, when it was logged.
    pub velocity: Option<Vec<f64>>,
    /// Absolute position of the body that carries the inertia.
    pub body_position: Option<Vec<f64>>,
    /// Absolute acceleration of that body.
    pub acceleration: Option<Vec<f64>>,
    /// Sum of the applied force on that body.
    pub force: Vec<f64>,
}

impl Channels {
    /// Relative displacement: first minus second, or the first alone.
    pub fn relative_displacement(&self) -> Vec<f64> {
        match &self.displacement_second {
            None => self.displacement_first.clone(),
            Some(second) => self
                .displacement_first
                .iter()
                .zip(second)
                .map(|(a, b)| a - b)
                .collect(),
        }
    }
}

/// What was read of one `[[record]]`, and how.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Source {
    /// The file as study.toml names it.
    pub file: String,
    /// What it is used for.
    pub role: Role,
    /// First row that was used, and the row after the last.
    pub rows: [usize; 2],
    /// SHA-256 of the file, as `sha256sum` prints it; for a log in memory that of its columns'
    /// names and numbers.
    pub sha256: String,
    /// What was done to its time: taken as even, bridged, split at gaps, resampled; one sentence
    /// each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub time: Vec<String>,
    /// Second loggers of the run, and how their clocks ran.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clocks: Vec<Clock>,
}

/// One log of one run, or one part of it between two gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// The file as study.toml names it.
    pub file: String,
    /// What it is used for.
    pub role: Role,
    /// The row of the file (from 0, heading not counted) that became row 0 here. Where samples
    /// were bridged or the log was split at gaps, rows are counted as if none were missing;
    /// where it was resampled, at the new rate.
    pub first_row: usize,
    /// Rows of the record.
    pub rows: usize,
    /// One entry per axis of the study.
    pub axes: Vec<Channels>,
    /// The study's inputs with their names, each in its own unit.
    pub inputs: Vec<(String, Vec<f64>)>,
}

impl Record {
    /// An input of the study by its name.
    pub(crate) fn input(&self, name: &str) -> Option<&Vec<f64>> {
        let found = self.inputs.iter().find(|(known, _)| known == name);
        found.map(|(_, series)| series)
    }

    /// The record with every series replaced by what `of` makes of it, so many rows.
    pub(crate) fn map(&self, rows: usize, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let maybe = |series: &Option<Vec<f64>>| series.as_ref().map(|s| of(s));
        let axes = self.axes.iter().map(|channels| Channels {
            displacement_first: of(&channels.displacement_first),
            displacement_second: maybe(&channels.displacement_second),
            velocity: maybe(&channels.velocity),
            body_position: maybe(&channels.body_position),
            acceleration: maybe(&channels.acceleration),
            force: of(&channels.force),
        });
        let inputs = self.inputs.iter();
        Self {
            rows,
            axes: axes.collect(),
            inputs: inputs.map(|(name, s)| (name.clone(), of(s))).collect(),
            ..self.clone()
        }
    }
}

/// A further column of the records, such as a voltage, a temperature or a pressure, that forces of
/// the joint may follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Its name in effects: `coulomb*voltage@x`.
    pub name: String,
    /// Its unit, as the study states it; empty where it states none.
    pub unit: String,
    /// Whether the study names it; if not, it is a column of the logs under its own name.
    pub named: bool,
}

/// A file's own name, without its folders.
pub(crate) fn own_name(file: &str) -> String {
    let name = std::path::Path::new(file).file_name();
    name.map_or(file.to_owned(), |n| n.to_string_lossy().into_owned())
}

/// A study, read and checked.
#[derive(Clone, Debug)]
pub struct Study {
    /// The name under which the study is reported.
    pub name: String,
    /// Where its study.toml lies; for logs in memory what they are called in messages.
    pub path: PathBuf,
    /// Sample rate of all records, Hz; without meaning where the study is quasi-static.
    pub sample_rate_hz: f64,
    /// Whether its logs have no time (`time = "none"`): only the path counts, velocities are the
    /// direction of travel, 1 or −1.
    pub quasi_static: bool,
    /// The common band of fits and error figures, when the study states one, Hz.
    pub band_hz: Option<f64>,
    /// Whether rows in which no axis moves count for nothing, in fits and in errors.
    pub leave_out_standstill: bool,
    /// One or two axes.
    pub axes: Vec<Axis>,
    /// Further columns that forces may follow.
    pub inputs: Vec<Input>,
    /// The records, in the order of study.toml.
    pub records: Vec<Record>,
    /// One entry per `[[record]]`; there are more records where logs were split at gaps. Empty for
    /// a study that was not read.
    pub sources: Vec<Source>,
    /// `[base] terms`, as written.
    pub base_terms: Vec<String>,
    /// Columns that every log has and no channel uses.
    pub unused: Vec<String>,
    /// What the reader wants the user to know: bridged gaps, columns left unused, …; one sentence
    /// each.
    pub notes: Vec<String>,
}

impl Study {
    /// The records that one continues, the earliest first: stretches of the same log whose rows
    /// come straight before its first.
    pub(crate) fn continued(&self, record: &Record) -> Vec<&Record> {
        let mut chain: Vec<&Record> = Vec::new();
        let mut first = record.first_row;
        // Of what was resampled the source counts the rows of the log, where it is in one piece.
        let sources = || self.sources.iter().filter(|s| s.file == record.file);
        let pieces = self.records.iter().filter(|r| r.file == record.file);
        let whole = sources().count() == pieces.count();
        let ends = |known: &Record, row: usize| {
            let as_logged = [known.first_row, row];
            known.file == record.file
                && known.rows > 0
                && (known.first_row + known.rows == row
                    || (whole && sources().any(|s| s.rows == as_logged)))
        };
        while let Some(before) = self.records.iter().find(|r| ends(r, first)) {
            first = before.first_row;
            chain.push(before);
        }
        chain.reverse();
        chain
    }

    /// Whether it names an input.
    pub fn has_input(&self, name: &str) -> bool {
        self.inputs.iter().any(|input| input.name == name)
    }

    /// Refuses what needs time where the study has none; `what` needs it, and `cure` is what to do
    /// in its place.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence.
    pub(crate) fn check_has_time(&self, what: &str, cure: &str) -> Result<()> {
        if !self.quasi_static {
            return Ok(());
        }
        Err(Error::data(format!(
            "{}: time = \"none\" says that the logs have no time, but {what}; {cure}",
            self.path.display()
        )))
    }

    /// Refuses an effect that follows an input which the study does not name, or time where it has
    /// none.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence.
    pub(crate) fn check_input(&self, effect: &str, input: Option<&str>) -> Result<()> {
        let name = effect.split(['*', '@']).next().and_then(Entry::named);
        let in_time = name.is_some_and(|entry| !quasi_static::is_rate_independent(entry));
        if in_time || input.is_some_and(|i| i.contains('~')) {
            self.check_has_time(
                &format!("{effect} follows time or velocity"),
                "leave it out, or use one that depends on the path alone, such as coulomb, jenkins or bouc_wen",
            )?;
        }
        let input = input.map(|text| Follows::parse(text).name);
        let Some(input) = input.filter(|name| !self.has_input(name)) else {
            return Ok(());
        };
        let known: Vec<&str> = self.inputs.iter().map(|i| i.name.as_str()).collect();
        let what = if known.is_empty() {
            format!("name its column with [[input]], name = {input:?}, column = …")
        } else {
            suggestion(input, &known)
        };
        Err(Error::data(format!(
            "{}: {effect} follows an input {input:?} that the study does not name: {what}",
            self.path.display()
        )))
    }

    /// Refuses this study for something learnt from another joint: other axes, or records at
    /// another rate.
    ///
    /// `learnt` is what was learnt, as it stands in the sentence; `axes` are its axes and
    /// `sample_rate_hz` its rate.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`], one sentence.
    pub fn check_fits<'a>(
        &self,
        learnt: &str,
        axes: impl Iterator<Item = (&'a str, AxisKind)>,
        sample_rate_hz: f64,
    ) -> Result<()> {
        let in_words = |(name, kind): (&str, AxisKind)| format!("{name} ({})", kind.name());
        let wanted: Vec<String> = axes.map(in_words).collect();
        let mine = self.axes.iter().map(|a| in_words((&a.name, a.kind)));
        let mine: Vec<String> = mine.collect();
        if mine != wanted {
            return Err(Error::data(format!(
                "{}: the study's axes are {} while those of {learnt} are {}; use the study it was learnt from, or learn \
                 from this one",
                self.path.display(),
                mine.join(", "),
                wanted.join(", ")
            )));
        }
        if (self.sample_rate_hz - sample_rate_hz).abs() > 1e-6 * sample_rate_hz {
            return Err(Error::data(format!(
                "{}: the records run at {} Hz while {learnt} is made for {sample_rate_hz} Hz; resample the records or \
                 learn from them",
                self.path.display(),
                self.sample_rate_hz
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{MemoryLog, Study};

    #[test]
    fn a_record_continues_the_one_whose_rows_end_where_its_own_begin_at_any_rate() {
        let t: Vec<f64> = (0..1700).map(|row| f64::from(row) / 427.0).collect();
        let x: Vec<f64> = t.iter().map(|t| 1e-3 * (9.0 * t).sin()).collect();
        let force = x.iter().map(|x| 2e3 * x).collect();
        let log = MemoryLog {
            name: "a".into(),
            columns: vec![("t".into(), t), ("x".into(), x), ("F".into(), force)],
        };
        let continued = |time: &str, from: usize| {
            let text = format!(
                "time = {time}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\ninertia = 0\n\
                 [[record]]\nfile = \"a\"\nrole = \"train\"\nrows = [0, 1100]\n\
                 [[record]]\nfile = \"a\"\nrole = \"validate\"\nrows = [{from}, 1700]\n"
            );
            let study = Study::of_memory("memory", &text, std::slice::from_ref(&log)).unwrap();
            study.continued(&study.records[1]).len()
        };
        let resampled = "{ column = \"t\", resample_hz = 430 }";
        for time in ["\"t\"", resampled] {
            assert_eq!(continued(time, 1100), 1, "{time}");
            assert_eq!(continued(time, 1101), 0, "{time}");
        }
    }
}
