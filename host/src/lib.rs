//! Jointwatch on the host: learn a joint's restoring force from rig logs, compare it with measurements, export it.
#![forbid(unsafe_code)]

pub mod assess;
pub mod cli;
pub mod device;
pub mod diagnose;
pub mod emulate;
pub mod fit;
pub mod model;
pub mod paper;
pub mod report;
pub mod signal;
pub mod simulate;
pub mod study;
pub mod text;
