//! A clock beside that of a record: how it ran, and what its logger's rows are worth by the
//! record's time.

/// How a second logger's clock ran against that of the record.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Clock {
    /// The second logger's file as study.toml names it.
    pub file: String,
    /// SHA-256 of that file.
    pub sha256: String,
    /// A time of its own clock, s.
    pub at_s: f64,
    /// What is added to that time to have the record's, s.
    pub offset_s: f64,
    /// Half the width of its 95 % interval, s.
    pub offset_within_s: f64,
    /// By how much the offset grows, in millionths of the time.
    pub drift_ppm: f64,
    /// Half the width of its 95 % interval.
    pub drift_within_ppm: f64,
    /// Of what both loggers recorded, once aligned.
    pub correlation: f64,
}

impl Clock {
    /// A clock that is the record's own.
    pub(crate) fn shared(file: &str, sha256: &str) -> Self {
        Self {
            file: file.to_owned(),
            sha256: sha256.to_owned(),
            at_s: 0.0,
            offset_s: 0.0,
            offset_within_s: 0.0,
            drift_ppm: 0.0,
            drift_within_ppm: 0.0,
            correlation: 1.0,
        }
    }
}

/// What was read of a second logger.
pub(crate) struct Aligned {
    pub(crate) clock: Clock,
    /// The times of its rows by the record's clock, s.
    pub(crate) seconds: Vec<f64>,
    /// What was done, for the user.
    pub(crate) sentence: String,
}
