//! Where a model fails, and why: candidates are collected, sets of them ranked, and a decision taken.

mod absorbed;
mod answer;
mod base;
mod bench;
mod blocks;
mod bounded;
mod collect;
mod criteria;
pub mod data_checks;
mod decide;
mod errors;
mod hypothesis;
mod learner;
pub(crate) mod noise;
mod rank;
mod search;
pub(crate) mod start;
mod unmeasured;
mod verdict;
pub mod where_it_fails;

pub use answer::{
    Absorbed, CandidateParameter, Diagnosis, Found, Looked, PerAxis, Ranked, Remainder, Verdict,
};
pub use verdict::{Asked, diagnose, diagnose_asked};
