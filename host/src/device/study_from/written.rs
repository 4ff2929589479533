//! What was written, for the words of the command and its JSON.

use serde::Serialize;

/// A record that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Written {
    /// The file, in the study's folder.
    pub file: String,
    /// Rows in the file.
    pub rows: usize,
    /// Places at which rows are missing before the next one.
    pub gaps: usize,
    /// Rows that are missing there.
    pub missing: u64,
    /// Whether study.toml names it.
    pub in_study: bool,
}

/// A study that was written.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyFrom {
    /// The records that were written, also those that study.toml does not name.
    pub records: Vec<Written>,
    /// Samples per second in the records; a device that streams every n-th sample gives fewer.
    pub sample_rate_hz: f64,
    /// What a person should know, one sentence each.
    pub notes: Vec<String>,
}
