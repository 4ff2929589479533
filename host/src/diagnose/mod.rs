//! Where a model fails, and why: candidates are collected, sets of them ranked, and a decision taken.

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
mod learner;
pub(crate) mod search;
mod verdict;

pub use answer::{
    Absorbed, CandidateParameter, Diagnosis, Found, Looked, PerAxis, Ranked, Remainder, Verdict,
};
pub use columns::{Columns, with_columns};
pub use verdict::{Asked, diagnose, diagnose_asked};
