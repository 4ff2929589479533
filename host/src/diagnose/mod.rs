//! Where a model fails, and why.

mod answer;
mod base;
mod candidates;
mod held_out;
mod missing;
pub(crate) mod noise;
mod verdict;
pub mod where_it_fails;

pub use answer::{CandidateParameter, Diagnosis, Found, PerAxis, Ranked, Verdict};
pub use verdict::diagnose;
