//! The report: one HTML file that shows a model on its study, opens without a network, and can be
//! handed on.
//!
//! [`html`] gathers what the page shows from the results that the library has already ([`Asked`])
//! and puts the page's scripts and styles beside it. The scripts draw; what they draw is computed
//! here, over all rows.

mod asked;
mod candidates;
mod contents;
mod correlation;
mod document;
mod gather;
mod handling;
mod plane;
mod response;
mod samples;
mod version;
mod words;

pub use asked::Asked;
pub use contents::Contents;
pub(crate) use document::{document, scripts, styles};
pub(crate) use samples::thinned;

use crate::text::error::{Error, Result};

/// The page as one file.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the model does not fit the study or gives numbers that
/// are not finite.
pub fn html(asked: &Asked<'_>) -> Result<String> {
    Ok(gathered(asked)?.html())
}

/// What a page shows, gathered and written as JSON: ready to become a file, or to be drawn in the
/// lab.
pub struct Gathered {
    /// The study's name, which is the page's title.
    pub title: String,
    /// The answer in one sentence.
    pub answer: String,
    /// [`Contents`] as JSON, for the page's scripts.
    pub json: String,
}

impl Gathered {
    /// The page as one file.
    pub fn html(&self) -> String {
        document(&self.title, &self.answer, &self.json)
    }
}

/// Gathers what the page shows.
///
/// # Errors
/// As [`html`].
pub fn gathered(asked: &Asked<'_>) -> Result<Gathered> {
    let contents = gather::contents(asked)?;
    let json = serde_json::to_string(&contents)
        .map_err(|e| Error::failed(format!("the report could not be written as JSON ({e})")))?;
    Ok(Gathered {
        title: contents.title,
        answer: contents.answer,
        json,
    })
}
