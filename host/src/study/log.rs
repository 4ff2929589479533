//! A log file: the columns that a study uses, read from whichever format the file is in.

use super::{csv, json, matlab};
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use std::path::Path;

/// A column that the study uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Wanted {
    pub(crate) column: String,
    pub(crate) optional: bool,
}

/// What to read from which file.
pub(crate) struct Request<'a> {
    /// The file as study.toml names it, for messages.
    pub(crate) file: &'a str,
    pub(crate) path: &'a Path,
    pub(crate) wanted: &'a [Wanted],
    /// First row and the row after the last.
    pub(crate) rows: Option<[usize; 2]>,
    /// Names of the columns when the file has no heading.
    pub(crate) columns: Option<&'a [String]>,
}

/// How a row is named in a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Numbering {
    /// The line of the file in which each row stands, from 1.
    Lines(Vec<u32>),
    /// Rows are counted from 1; this is the number of row 0 here.
    From(usize),
}

/// What was read.
pub(crate) struct Log {
    /// Per wanted column its values, as logged; `None` for an optional column that the file lacks.
    pub(crate) values: Vec<Option<Vec<f64>>>,
    /// Names of the columns that were left unread.
    pub(crate) unused: Vec<String>,
    pub(crate) numbering: Numbering,
}

impl Log {
    /// “row 17 (line of the file)”.
    pub(crate) fn row_name(&self, row: usize) -> String {
        match &self.numbering {
            Numbering::Lines(lines) => match lines.get(row) {
                Some(line) => line_name(*line as usize),
                None => format!("row {row}"),
            },
            Numbering::From(first) => format!("row {} (counted from 1)", first + row),
        }
    }
}

/// The name of a row of a text file.
pub(crate) fn line_name(line: usize) -> String {
    format!("row {line} (line of the file)")
}

impl Request<'_> {
    /// Reads the file.
    pub(crate) fn read(&self) -> Result<Log> {
        if self.path.is_dir() {
            return Err(self.error("is a folder, not a log; name the file in it"));
        }
        let bytes = std::fs::read(self.path).map_err(|e| {
            self.error(format!(
                "cannot be read ({e}); check the path, which is relative to study.toml"
            ))
        })?;
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(self.error("is empty; check that the logger finished writing it"));
        }
        let extension = self
            .path
            .extension()
            .map(|e| e.to_string_lossy().to_lowercase());
        let log = match extension.as_deref() {
            Some("mat") => matlab::read(self, &bytes)?,
            Some("json") => json::read(self, &bytes)?,
            _ => csv::read(self, &bytes)?,
        };
        for (wanted, values) in self.wanted.iter().zip(&log.values) {
            let bad = values
                .as_ref()
                .and_then(|v| v.iter().position(|x| !x.is_finite()).map(|i| (i, v[i])));
            if let Some((row, value)) = bad {
                return Err(self.error_at(
                    &log.row_name(row),
                    &wanted.column,
                    format!(
                        "{value} is not a measurement; repair the log or leave the row out with rows = […]"
                    ),
                ));
            }
        }
        Ok(log)
    }

    /// For each wanted column its place among the file's, refusing what is missing or there twice.
    pub(crate) fn locate<S: AsRef<str>>(&self, names: &[S]) -> Result<Vec<Option<usize>>> {
        let known: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        self.wanted
            .iter()
            .map(|wanted| {
                let mut places = (0..known.len()).filter(|i| known[*i] == wanted.column);
                match (places.next(), places.next()) {
                    (Some(_), Some(_)) => Err(self.error(format!(
                        "has the column {:?} twice; rename one of them",
                        wanted.column
                    ))),
                    (None, _) if !wanted.optional => Err(self.error(format!(
                        "has no column {:?}; {}",
                        wanted.column,
                        suggestion(&wanted.column, &known)
                    ))),
                    (place, _) => Ok(place),
                }
            })
            .collect()
    }

    /// Names of the columns that are not wanted.
    pub(crate) fn unused<S: AsRef<str>>(&self, names: &[S]) -> Vec<String> {
        names
            .iter()
            .map(AsRef::as_ref)
            .filter(|name| !self.wanted.iter().any(|w| w.column == *name))
            .map(str::to_owned)
            .collect()
    }

    /// The range of rows to keep of `total`.
    pub(crate) fn range(&self, total: usize) -> Result<std::ops::Range<usize>> {
        match self.rows {
            None => Ok(0..total),
            Some([from, to]) if from < to && to <= total => Ok(from..to),
            Some([from, to]) => Err(self.error(format!(
                "has {total} rows, so rows = [{from}, {to}] cannot be taken; give the first row (from 0) and the row \
                 after the last"
            ))),
        }
    }

    /// An error about the file as a whole.
    pub(crate) fn error(&self, what: impl std::fmt::Display) -> Error {
        Error::data(format!("{} {what}", self.file))
    }

    /// An error about a row of the file.
    pub(crate) fn error_in(&self, row: &str, what: impl std::fmt::Display) -> Error {
        Error::data(format!("{}, {row}: {what}", self.file))
    }

    /// An error about one value.
    pub(crate) fn error_at(&self, row: &str, column: &str, what: impl std::fmt::Display) -> Error {
        Error::data(format!("{}, {row}, column {column:?}: {what}", self.file))
    }
}
