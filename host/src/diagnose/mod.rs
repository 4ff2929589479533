//! Where a model fails, and why: candidates are collected, sets of them ranked, and a decision
//! taken.

mod absorbed;
pub mod add;
mod answer;
pub mod apply;
mod base;
pub mod changed;
mod columns;
mod criteria;
mod decide;
mod errors;
pub mod in_place;
mod in_time;
mod in_words;
mod later;
mod learner;
mod meaningless;
mod notes;
pub(crate) mod search;
mod verdict;

pub use crate::model::file::PerAxis;
pub use answer::{Absorbed, Diagnosis, Found, LookedAt, Ranked, Remainder, Verdict};
pub use columns::{Columns, with_columns};
pub use in_time::{diagnose, diagnose_with};
pub use verdict::SearchOptions;
