//! Learning a model from motions.

pub mod coverage;
pub mod cross_validation;
pub mod effects;
pub mod errors;
pub mod identify;
pub mod inertia;
pub mod least_squares;
pub mod moments;
pub mod network;
pub mod polynomial;
pub(crate) mod stretches;
pub mod sums;
pub(crate) mod trees;
pub(crate) mod with_base;
