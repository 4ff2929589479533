//! Statistics that merge exactly: sums over records from which a model is made without the records.
//!
//! A [`Part`] holds the sums of whole records. Each record is filtered, normalised and summed
//! alone, in one fixed order; the records' sums are integers. So parts merge to the same bytes in
//! any order and however the records were shared out.

pub(crate) mod exact;
mod part;
mod physical;
mod plan;
mod polynomial;
pub(crate) mod products;
mod segments;

pub use part::Part;
pub use plan::Plan;
pub use segments::{Choice, Selection};
