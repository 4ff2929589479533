//! Where a model fails, and why: candidates are collected, sets of them ranked, and a decision taken.

mod absorbed;
pub mod add;
mod answer;
pub mod apply;
mod base;
mod bench;
mod blocks;
mod chances;
pub mod changed;
mod collect;
mod columns;
mod criteria;
mod curve;
mod decide;
mod descend;
mod errors;
mod hypothesis;
mod learner;
mod rank;
mod score;
mod search;
mod smooth;
pub(crate) mod start;
mod verdict;
mod zeros;

pub use answer::{
    Absorbed, CandidateParameter, Diagnosis, Found, Looked, PerAxis, Ranked, Remainder, Verdict,
};
pub use columns::{Columns, with_columns};
pub use verdict::{Asked, diagnose, diagnose_asked};
