//! Public measurements and benchmarks.

pub mod bouc_wen;
pub mod joints;
pub mod league;
