//! Logs that are in memory already: arrays of a program that calls the library.

use super::Study;
use super::description::Source;
use super::log::{Column, Request, Table};
use super::open::hexadecimal;
use crate::text::error::Result;
use sha2::Digest;
use std::path::Path;

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

impl Study {
    /// The study that a description in the form of `study.toml` makes of logs in memory; `called` is what messages call it.
    ///
    /// ```
    /// use jointwatch::{MemoryLog, Study};
    ///
    /// let description = r#"
    ///     sample_rate_hz = 1000.0
    ///     axis = [{ name = "x", kind = "translation", displacement = "d", force = "F", inertia = 0.0 }]
    ///     record = [{ file = "run 1", role = "train" }]
    /// "#;
    /// let swing = |k: i32| f64::from(k * k % 977) * 1e-6;
    /// let log = MemoryLog {
    ///     name: "run 1".into(),
    ///     columns: vec![
    ///         ("d".into(), (0..2000).map(swing).collect()),
    ///         ("F".into(), (0..2000).map(|k| 2e4 * swing(k)).collect()),
    ///     ],
    /// };
    /// let study = Study::of_memory("arrays", description, &[log])?;
    /// assert_eq!(study.records[0].rows, 2000);
    /// # Ok::<(), jointwatch::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Study::read`], without a line of the description.
    pub fn of_memory(called: &str, description: &str, logs: &[MemoryLog]) -> Result<Self> {
        let source = Source {
            path: Path::new(called),
            text: description,
            written: false,
        };
        Self::described(&source, Some(logs))
    }
}
