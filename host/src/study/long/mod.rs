//! Logs of more rows than memory should hold.

pub mod overview;
pub(super) mod records;
pub mod study;
