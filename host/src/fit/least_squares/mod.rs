//! Least squares: the normal equations, factors within bounds, and what is not linear.

pub(crate) mod bounded;
pub(crate) mod levenberg_marquardt;
pub mod normal_equations;
