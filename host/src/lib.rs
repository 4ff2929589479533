//! Jointwatch on the host: learn a joint's restoring force from rig logs, compare, export.
#![forbid(unsafe_code)]

pub mod device;
pub mod error;
pub mod fit;
pub mod model;
pub mod motion;
pub mod signal;
pub mod sim;
pub mod study;
