//! Logs that are in memory already: arrays of a program that calls the library.

use super::Study;
use super::description::Source;
use super::log::MemoryLog;
use super::read::Logged;
use crate::text::error::Result;
use std::path::Path;

impl Study {
    /// The study that a description in the form of `study.toml` makes of logs in memory; `called`
    /// is what messages call it.
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
        Self::described(&source, Logged::Memory(logs), &[])
    }
}
