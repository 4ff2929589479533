//! One sentence for everything that can go wrong, and the exit code that goes with it.

use std::fmt;

/// What kind of failure it was; decides the process's exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It could not be done (exit code 1): a file that cannot be written, a tool that is missing.
    Failed,
    /// Wrong use (exit code 2).
    Usage,
    /// Bad data (exit code 3): a study, a log, a model or a blob that does not hold what it should.
    Data,
}

/// An error is one sentence: what is wrong, where (file, row, column), and what to try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// Decides the exit code.
    pub kind: Kind,
    /// The sentence, without a full stop at its end.
    pub sentence: String,
}

/// What the host's functions return.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Something could not be done.
    pub fn failed(sentence: impl Into<String>) -> Self {
        Self {
            kind: Kind::Failed,
            sentence: sentence.into(),
        }
    }

    /// The command was used wrongly.
    pub fn usage(sentence: impl Into<String>) -> Self {
        Self {
            kind: Kind::Usage,
            sentence: sentence.into(),
        }
    }

    /// The data are bad.
    pub fn data(sentence: impl Into<String>) -> Self {
        Self {
            kind: Kind::Data,
            sentence: sentence.into(),
        }
    }

    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            Kind::Failed => 1,
            Kind::Usage => 2,
            Kind::Data => 3,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
    }
}

impl std::error::Error for Error {}
