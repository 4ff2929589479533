//! The report: one HTML file that shows a model on its study, opens without a network, and can be handed on.
//!
//! [`html`] gathers what the page shows from the results that the library has already ([`Asked`]) and puts the page's scripts
//! and styles beside it. The scripts draw; what they draw is computed here, over all rows.

mod candidates;
mod contents;
mod correlation;
mod document;
mod gather;
mod handling;
mod plane;
mod response;
mod samples;
mod words;

pub use contents::Contents;

use super::Step;
use crate::diagnose::{Diagnosis, PerAxis};
use crate::model::file::ModelFile;
use crate::simulate::respond::Response;
use crate::study::Study;
use crate::text::error::Result;

/// What a command knows when it is asked for a report.
pub struct Asked<'a> {
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

/// The page as one file.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the model does not fit the study or gives numbers that are not finite.
pub fn html(asked: &Asked<'_>) -> Result<String> {
    document::document(&gather::contents(asked)?)
}
