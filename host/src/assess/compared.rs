//! Everything `compare` answers: the figures of a model on a study, and what is wrong with the
//! data.

use crate::assess::compare::{self, Comparison};
use crate::assess::data_checks;
use crate::model::file::ModelFile;
use crate::study::Study;
use crate::text::error::Result;
use serde::Serialize;

/// The output of `compare --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// The errors, and where they sit.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// What is wrong with the data, as `diagnose` finds it.
    pub data_problems: Vec<String>,
    /// Whether that makes the errors say little of the model.
    #[serde(skip)]
    pub serious: bool,
}

/// Compares a model with every record of a study, and checks the data.
///
/// # Errors
/// As [`compare::compare`].
pub fn compared(study: &Study, model: &ModelFile) -> Result<Compared> {
    let comparison = compare::compare(study, model)?;
    let problems = data_checks::check(study, &model.filters);
    Ok(Compared {
        comparison,
        serious: problems.iter().any(|finding| finding.serious),
        data_problems: data_checks::sentences(problems),
    })
}
