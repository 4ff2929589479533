//! Opening a log: its file, its reader, and the columns that a study uses of it.

use super::check::lone;
use super::joined;
use super::log::{Column, Log, MemoryLog, Numbering, Request, Table};
use super::readers::long::LongLog;
use super::readers::{self, long};
use crate::text::error::Result;
use crate::text::hexadecimal::hexadecimal;
use crate::text::input;
use sha2::Digest;

/// Columns that a file without a heading may have.
const MAX_NAMELESS: usize = 256;

impl Request<'_> {
    /// Reads everything in the file that the request needs.
    pub(crate) fn table(&self) -> Result<Table> {
        self.table_of(None)
    }

    /// The same, of its rows alone where the log is too long to be read whole and was opened for
    /// that.
    pub(crate) fn table_of(&self, long: Option<&LongLog>) -> Result<Table> {
        match long {
            Some(long) => long.table(self),
            None => match joined::files(self) {
                Some(files) => joined::table(self, &files),
                None => readers::read(self, &self.bytes()?),
            },
        }
    }

    /// How many columns a file without a heading has.
    ///
    /// # Errors
    /// Rows of unequal length.
    pub(super) fn columns_without_heading(&self) -> Result<usize> {
        for count in 1..=MAX_NAMELESS {
            let names: Vec<String> = (0..count).map(|i| format!("c{i}")).collect();
            let request = Request {
                rows: Some([0, 1]),
                columns: Some(&names),
                ..*self
            };
            if request.table().is_ok() {
                return Ok(count);
            }
        }
        Err(self.error("has no heading and rows of unequal length; add a heading"))
    }

    fn bytes(&self) -> Result<Vec<u8>> {
        if self.path.is_dir() {
            return Err(self.error("is a folder, not a log; name the files in it"));
        }
        if long::is_long(self.path) {
            return Err(self.error(long::too_long(self)));
        }
        input::read(self.path).map_err(|e| self.unopened(&e))
    }

    /// Reads the columns that the study uses.
    pub(crate) fn read(&self) -> Result<Log> {
        self.read_of(None)
    }

    /// The same, of its rows alone where the log is too long to be read whole and was opened for
    /// that.
    pub(crate) fn read_of(&self, long: Option<&LongLog>) -> Result<Log> {
        let (mut table, sha256) = match (self.memory, long) {
            (Some(log), _) => (log.table(self), log.sha256()),
            (None, Some(long)) => (long.table(self)?, long.sha256(self)?),
            (None, None) => match joined::files(self) {
                Some(files) => {
                    let mut digest = sha2::Sha256::new();
                    for (file, path) in &files {
                        digest.update(
                            Request {
                                file,
                                path,
                                ..*self
                            }
                            .bytes()?,
                        );
                    }
                    (
                        joined::table(self, &files)?,
                        hexadecimal(&digest.finalize()),
                    )
                }
                None => {
                    let bytes = self.bytes()?;
                    let digest = sha2::Sha256::digest(&bytes);
                    (readers::read(self, &bytes)?, hexadecimal(&digest))
                }
            },
        };
        let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
        let places = self.locate(&names)?;
        let unused = self.unused(&names);
        let rows = self.common_rows(&table.columns, &places)?;
        if !table.cut {
            let range = self.range(rows)?;
            if self.rows.is_some() {
                for values in table.columns.iter_mut().filter_map(|c| c.values.as_mut()) {
                    values.truncate(range.end);
                    values.drain(..range.start.min(values.len()));
                }
            }
            table.numbering = Numbering::From(range.start + 1);
        }
        let units = places
            .iter()
            .map(|place| place.and_then(|p| table.columns[p].unit.clone()))
            .collect();
        let values = places
            .iter()
            .map(|place| place.and_then(|p| table.columns[p].values.take()))
            .collect();
        let log = Log {
            values,
            units,
            notes: table.notes,
            unused,
            numbering: table.numbering,
            sha256,
            logger: vec![0; places.len()],
            others: Vec::new(),
        };
        self.check_finite(&log)?;
        Ok(log)
    }

    /// The number of rows, which must be the same in all columns that the study uses.
    fn common_rows(&self, columns: &[Column], places: &[Option<usize>]) -> Result<usize> {
        let mut length: Option<(usize, &str)> = None;
        for place in places.iter().flatten() {
            let column = &columns[*place];
            let count = column.values.as_ref().map_or(0, Vec::len);
            let (rows, other) = *length.get_or_insert((count, &column.name));
            if rows != count && !self.sparse {
                return Err(self.error(format!(
                    "has {rows} values in {other:?} but {count} in {:?}; store vectors of equal length",
                    column.name
                )));
            }
        }
        Ok(length.map_or(0, |(rows, _)| rows))
    }

    fn is_bad(&self, value: f64) -> bool {
        !(value.is_finite() || self.sparse && value.is_nan())
    }

    /// Refuses values that are no measurements beside the rest of their column, but for the column
    /// of time, and gives a note for each column with values that stand alone.
    pub(crate) fn lone_values(
        &self,
        log: &Log,
        time: Option<&str>,
        quasi_static: bool,
    ) -> Result<Vec<String>> {
        let mut notes = Vec::new();
        let wanted = self.wanted.unwrap_or_default().iter();
        for ((wanted, values), logger) in wanted.zip(&log.values).zip(&log.logger) {
            let column = wanted.column.as_str();
            // Those of another logger were looked at with its file.
            let looked_at = Some(column) != time && *logger == 0;
            let Some(values) = values.as_ref().filter(|_| looked_at) else {
                continue;
            };
            let found = match quasi_static {
                true => lone::lone_of_path(values),
                false => lone::lone(values),
            };
            if let Some(row) = lone::impossible(values, &found) {
                return Err(self.error_at(
                    &log.row_name(row),
                    column,
                    format!(
                        "{:e} stands alone between {:e} and {:e}, more than ten times the range of all other values; repair the log \
                         or leave the row out with rows = […]",
                        values[row],
                        values[row - 1],
                        values[row + 1]
                    ),
                ));
            }
            if let Some(first) = found.first() {
                let row = first.row;
                notes.push(format!(
                    "{}, {}, column {column:?}: {:e} stands alone between {:e} and {:e}, as no sampled motion does{}; look at it \
                     and repair the log",
                    self.file,
                    log.row_name(row),
                    values[row],
                    values[row - 1],
                    values[row + 1],
                    match found.len() {
                        1 => String::new(),
                        more => format!(", the first of {more} such values"),
                    }
                ));
            }
        }
        Ok(notes)
    }

    fn check_finite(&self, log: &Log) -> Result<()> {
        for (wanted, values) in self.wanted.unwrap_or_default().iter().zip(&log.values) {
            let bad = values
                .as_ref()
                .and_then(|v| v.iter().position(|x| self.is_bad(*x)).map(|i| (i, v[i])));
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
        Ok(())
    }
}

impl MemoryLog {
    /// Of names and numbers, by which model.json knows its records again.
    pub(super) fn sha256(&self) -> String {
        let mut digest = sha2::Sha256::new();
        for (name, values) in &self.columns {
            digest.update(name.as_bytes());
            digest.update([0]);
            for value in values {
                digest.update(value.to_le_bytes());
            }
        }
        hexadecimal(&digest.finalize())
    }
}
