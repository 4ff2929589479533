//! Logs that a study does not list, read as records of it: there may be thousands, each of which is
//! read alone and forgotten.

use super::check::{self, Extent};
use super::description::{Description, RecordEntry, Source};
use super::plan::plan;
use super::read::{Place, description_text};
use super::{MemoryLog, Role, Study};
use crate::text::error::{Error, Result};
use crate::text::hexadecimal::hexadecimal;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// What a `study.toml` says of every log: channels, units, axes.
#[derive(Clone, Debug)]
pub struct Template {
    path: PathBuf,
    text: String,
    sample_rate_hz: f64,
}

impl Template {
    /// The template of a study that was read, from its file.
    ///
    /// # Errors
    /// One sentence when the file has gone.
    pub fn of_study(study: &Study) -> Result<Self> {
        let (path, text) = description_text(&study.path)?;
        Ok(Self {
            path,
            text,
            sample_rate_hz: study.sample_rate_hz,
        })
    }

    /// The template in a text in the form of `study.toml`; `called` is what messages call it.
    pub fn of_text(called: &str, text: String, sample_rate_hz: f64) -> Self {
        Self {
            path: called.into(),
            text,
            sample_rate_hz,
        }
    }

    /// The columns that it reads of a log, and which of them is the time.
    ///
    /// # Errors
    /// As [`Study::read`], of the description.
    pub fn columns(&self) -> Result<(Vec<String>, Option<String>)> {
        let source = self.source();
        let (plan, _) = plan(&source, &source.parse("reference/study.md")?)?;
        let wanted = plan.wanted.into_iter().map(|wanted| wanted.column);
        Ok((wanted.collect(), plan.time.map(|time| time.column)))
    }

    pub(super) fn source(&self) -> Source<'_> {
        Source::file(&self.path, &self.text)
    }

    /// Where the description lies.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The sample rate of the study that it is of, Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// The text of the description.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The study of a log alone, the file at this path, as a record to learn from.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn read(&self, file: &Path) -> Result<Study> {
        let logs = Place {
            folder: Path::new(""),
            memory: None,
            long: &[],
        };
        self.of_one(&file.to_string_lossy(), None, logs)
    }

    /// The same of a log in memory.
    ///
    /// # Errors
    /// As [`Study::of_memory`].
    pub fn read_memory(&self, log: &MemoryLog) -> Result<Study> {
        let logs = Place {
            folder: Path::new(""),
            memory: Some(std::slice::from_ref(log)),
            long: &[],
        };
        self.of_one(&log.name, None, logs)
    }

    /// The same of some rows of a log.
    pub(super) fn of_one(
        &self,
        file: &str,
        rows: Option<[usize; 2]>,
        logs: Place<'_>,
    ) -> Result<Study> {
        let source = self.source();
        let mut said: Description = source.parse("reference/study.md")?;
        let columns = said.record.iter().find_map(|entry| entry.columns.clone());
        said.record = vec![RecordEntry {
            file: Spanned::new(0..0, file.to_owned()),
            role: Role::Train,
            rows: rows.map(|rows| Spanned::new(0..0, rows)),
            columns,
        }];
        // Rates that time columns show differ in their last digits; all records count as sampled at
        // the study's.
        if !said.is_quasi_static() {
            said.sample_rate_hz = Some(Spanned::new(0..0, self.sample_rate_hz));
        }
        let (plan, axes) = plan(&source, &said)?;
        let mut study = Study::of_records(&source, &said, (&plan, axes), logs)?;
        check::constant_channels(&study, &plan, Extent::Part)?;
        study.direct();
        Ok(study)
    }

    /// SHA-256 of what is said of the logs: everything but the list of records, comments and
    /// layout.
    ///
    /// # Errors
    /// One sentence when the text is not TOML.
    pub fn sha256(&self) -> Result<String> {
        let mut table: toml::Table = toml::from_str(&self.text).map_err(|e| {
            Error::data(format!(
                "{}: this is not TOML ({})",
                self.path.display(),
                e.message()
            ))
        })?;
        table.remove("record");
        let digest = Sha256::digest(table.to_string());
        Ok(hexadecimal(&digest))
    }
}
