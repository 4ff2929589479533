//! Integers against exact arithmetic: scalars, polynomials and networks.

mod fixed_point;
mod network_error;
mod network_quantise;
mod polynomial_error;
mod quantise;
