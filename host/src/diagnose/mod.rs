//! Where a model fails, and why.

mod candidates;
pub mod data_checks;
mod held_out;
mod missing;
pub(crate) mod noise;
mod verdict;
pub mod where_it_fails;

pub use verdict::{CandidateParameter, Diagnosis, Found, PerAxis, Ranked, Verdict, diagnose};
