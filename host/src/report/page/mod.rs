//! The report: one HTML file that shows a model on its study, opens without a network, and can be handed on.
//!
//! [`html`] gathers what the page shows from the results that the library has already ([`Asked`]) and puts the page's scripts
//! and styles beside it. The scripts draw; what they draw is computed here, over all rows.

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

use crate::text::error::Result;

/// The page as one file.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the model does not fit the study or gives numbers that are not finite.
pub fn html(asked: &Asked<'_>) -> Result<String> {
    document::document(&gather::contents(asked)?)
}
