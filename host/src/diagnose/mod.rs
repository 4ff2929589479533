//! Where a model fails, and why.

mod absorbed;
pub mod add;
mod answer;
pub mod apply;
mod base;
mod candidates;
mod held_out;
mod judge;
mod linear_memory;
mod missing;
mod patterns;
mod rivals;
pub(crate) mod start;
mod tolerances;
mod verdict;

pub use answer::{Absorbed, CandidateParameter, Diagnosis, Found, PerAxis, Ranked, Verdict};
pub(crate) use candidates::LAST_PROPOSED;
pub use verdict::diagnose;
