//! One sentence for everything that can go wrong, and the exit code that goes with it.

use super::printable;
use rayon::iter::IndexedParallelIterator;
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
    /// Done, and what the user asked to fail on was found (exit code 4).
    Found,
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

/// What several tasks gave that ran side by side, or the error of the first of them in their order:
/// `collect` would give that of whichever failed first, so that one input would be refused with
/// another sentence from one time to the next.
///
/// # Errors
/// That of the first task that failed.
pub fn in_order<T: Send>(tasks: impl IndexedParallelIterator<Item = Result<T>>) -> Result<Vec<T>> {
    let all: Vec<Result<T>> = tasks.collect();
    all.into_iter().collect()
}

impl Error {
    /// The sentence as it is shown: with its full stop, control characters as escapes, and no
    /// longer than a person reads.
    pub fn line(&self) -> String {
        // A suggestion ends the sentence by itself.
        let end = if self.sentence.ends_with('?') {
            ""
        } else {
            "."
        };
        format!("{}{end}", printable::message(&self.sentence))
    }

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

    /// What the user asked to fail on was found.
    pub fn found(sentence: impl Into<String>) -> Self {
        Self {
            kind: Kind::Found,
            sentence: sentence.into(),
        }
    }

    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            Kind::Failed => 1,
            Kind::Usage => 2,
            Kind::Data => 3,
            Kind::Found => 4,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::time::Duration;

    #[test]
    fn the_first_error_in_order_is_told_and_not_the_fastest() {
        let tasks = (0..64_u32).into_par_iter().map(|task| {
            std::thread::sleep(Duration::from_millis(u64::from(
                20_u32.saturating_sub(task),
            )));
            match task {
                0..3 => Ok(task),
                _ => Err(Error::data(format!("task {task}"))),
            }
        });
        assert_eq!(in_order(tasks), Err(Error::data("task 3")));
        let fine = (0..64_u32).into_par_iter().map(Ok);
        assert_eq!(in_order(fine), Ok((0..64).collect::<Vec<u32>>()));
    }
}
