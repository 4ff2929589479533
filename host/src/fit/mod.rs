//! Learning a model from motions.

pub(crate) mod bounded;
pub mod coverage;
pub mod cross_validation;
pub mod effects;
pub mod errors;
pub mod identify;
pub mod inertia;
mod legendre;
pub(crate) mod levenberg_marquardt;
pub mod moments;
pub mod network;
pub mod normal_equations;
pub mod polynomial;
mod ridge;
mod select;
pub(crate) mod stretches;
pub mod sums;
pub(crate) mod trees;
pub(crate) mod with_base;
