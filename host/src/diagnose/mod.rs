//! Where a model fails, and why.

mod absorbed;
mod answer;
mod base;
mod candidates;
pub mod data_checks;
mod held_out;
mod judge;
mod linear_memory;
mod missing;
pub(crate) mod noise;
mod patterns;
mod rivals;
pub(crate) mod start;
mod tolerances;
mod unmeasured;
mod verdict;
pub mod where_it_fails;

pub use answer::{Absorbed, CandidateParameter, Diagnosis, Found, PerAxis, Ranked, Verdict};
pub(crate) use candidates::LAST_PROPOSED;
pub use verdict::diagnose;
