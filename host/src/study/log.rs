//! A log file: the columns that a study uses, read from whichever format the file is in.

use super::time::clock::Aligned;
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
#[derive(Clone, Copy)]
pub(crate) struct Request<'a> {
    /// The file as study.toml names it, for messages.
    pub(crate) file: &'a str,
    pub(crate) path: &'a Path,
    /// The columns that the study uses; `None` for all of them, in which cells that are no number
    /// then count as NaN.
    pub(crate) wanted: Option<&'a [Wanted]>,
    /// First row and the row after the last.
    pub(crate) rows: Option<[usize; 2]>,
    /// Names of the columns when the file has no heading.
    pub(crate) columns: Option<&'a [String]>,
    /// The log itself, where it is in memory and not in a file.
    pub(crate) memory: Option<&'a MemoryLog>,
    /// Whether cells may be empty and columns of different length: each channel then counts only
    /// where it has a value.
    pub(crate) sparse: bool,
}

/// What is said of a text without a heading; a caller that can do without one reads it as numbered
/// columns.
pub(crate) const NO_HEADING: &str =
    "a heading with the columns' names is expected above the numbers";

/// How a row is named in a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Numbering {
    /// The line of the file in which each row stands, from 1.
    Lines(Vec<u32>),
    /// Rows are counted from 1; this is the number of row 0 here.
    From(usize),
}

/// One column of a log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Column {
    /// As the file names it.
    pub(crate) name: String,
    /// The unit that the file states for it, as written there.
    pub(crate) unit: Option<String>,
    /// The numbers; `None` where the request does not need them.
    pub(crate) values: Option<Vec<f64>>,
}

/// A log as its file holds it, before anybody says what the columns mean.
pub(crate) struct Table {
    pub(crate) columns: Vec<Column>,
    /// How rows are named in messages.
    pub(crate) numbering: Numbering,
    /// What the file is, as in “it is …”.
    pub(crate) format: String,
    /// Whether the reader took only the request's rows; otherwise the columns are whole.
    pub(crate) cut: bool,
    /// What was repaired, one sentence each.
    pub(crate) notes: Vec<String>,
    /// The rows, as they stand in the file, at which a further block begins, below a heading of
    /// its own.
    pub(crate) blocks: Vec<usize>,
    /// The sample rate that the file states beside its columns, Hz, and what it calls it.
    pub(crate) rate: Option<(String, f64)>,
}

impl Table {
    /// A table of whole columns, rows counted from 1.
    pub(crate) fn whole(format: impl Into<String>, columns: Vec<Column>) -> Self {
        Self {
            columns,
            numbering: Numbering::From(1),
            format: format.into(),
            cut: false,
            notes: Vec::new(),
            blocks: Vec::new(),
            rate: None,
        }
    }
}

/// A log in memory: what a file of columns would hold.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryLog {
    /// The name by which a `[[record]]` calls it its `file`.
    pub name: String,
    /// Columns with their names, all of one length.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl MemoryLog {
    /// The columns that a request needs.
    pub(super) fn table(&self, request: &Request<'_>) -> Table {
        let columns = self.columns.iter().map(|(name, values)| Column {
            name: name.clone(),
            unit: None,
            values: request.needs(name).then(|| values.clone()),
        });
        Table::whole("columns in memory", columns.collect())
    }
}

/// What was read of one log.
pub(crate) struct Log {
    /// Per wanted column its values, as logged; `None` for an optional column that the file lacks.
    pub(crate) values: Vec<Option<Vec<f64>>>,
    /// Per wanted column the unit that the file states for it.
    pub(crate) units: Vec<Option<String>>,
    /// What the reader repaired, one sentence each.
    pub(crate) notes: Vec<String>,
    /// Names of the columns that were left unread.
    pub(crate) unused: Vec<String>,
    pub(crate) numbering: Numbering,
    /// SHA-256 of the file, in hexadecimal.
    pub(crate) sha256: String,
    /// Per wanted column the logger that it comes from: 0 for the file's, n for entry n − 1 of
    /// `others`.
    pub(crate) logger: Vec<usize>,
    /// Second loggers of the same run.
    pub(crate) others: Vec<Aligned>,
}

impl Log {
    /// How many rows the wanted column at `place` has; 0 where it is absent.
    pub(crate) fn rows(&self, place: usize) -> usize {
        self.values[place].as_ref().map_or(0, Vec::len)
    }

    /// The file that the wanted column at `place` comes from; `own` for the log's.
    pub(crate) fn file<'a>(&'a self, place: usize, own: &'a str) -> &'a str {
        let other = self.logger[place].checked_sub(1);
        other.map_or(own, |at| &self.others[at].clock.file)
    }

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
    /// Whether the values of a column are asked for.
    pub(crate) fn needs(&self, column: &str) -> bool {
        self.wanted
            .is_none_or(|wanted| wanted.iter().any(|w| w.column == column))
    }

    /// For each wanted column its place among the file's, refusing what is missing or there twice.
    pub(crate) fn locate<S: AsRef<str>>(&self, names: &[S]) -> Result<Vec<Option<usize>>> {
        let known: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        self.wanted
            .unwrap_or_default()
            .iter()
            .map(|wanted| {
                let mut places = (0..known.len()).filter(|i| known[*i] == wanted.column);
                match (places.next(), places.next()) {
                    (Some(_), Some(_)) => Err(self.error(format!(
                        "has the column {:?} twice; rename one of them, or name all columns of the file with columns = […] in the \
                         [[record]], \"\" for those that are not meant",
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
            .filter(|name| !name.is_empty() && !self.needs(name))
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

    /// An error about a file that the system does not give.
    pub(crate) fn unreadable(&self, error: &std::io::Error) -> Error {
        self.error(format!("cannot be read ({error}); check it"))
    }

    /// An error about a file that the system does not open.
    pub(crate) fn unopened(&self, error: &std::io::Error) -> Error {
        self.error(format!(
            "cannot be read ({error}); check the path; those in study.toml are relative to it"
        ))
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
