//! What a command knows when it is asked for a report.

use crate::diagnose::{Diagnosis, PerAxis};
use crate::model::file::ModelFile;
use crate::report::staircase::Step;
use crate::simulate::respond::Response;
use crate::study::Study;

/// What a command knows when it is asked for a report.
pub struct Asked<'a> {
    /// The answer in one sentence, where the command has one of its own.
    pub answer: Option<String>,
    /// The command as it was typed.
    pub command: String,
    /// The study as it was logged.
    pub study: &'a Study,
    /// The model that the page is about.
    pub model: &'a ModelFile,
    /// The model as it was before something was added to it.
    pub before: Option<&'a ModelFile>,
    /// Errors step by step; empty when there was one step only.
    pub steps: Vec<Step>,
    /// Noise floors per axis, relative as the errors; computed when left out.
    pub floors: Option<PerAxis>,
    /// What the errors are measured on.
    pub judged_on: String,
    /// What is missing, when that was asked; of the model before.
    pub diagnosis: Option<&'a Diagnosis>,
    /// How the rig moves with the model in place of its joint.
    pub response: Option<&'a Response>,
}
