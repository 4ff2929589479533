//! The monitor over many joints: healthy ones, ones that change, ones that drift.

pub mod curves;
pub mod detection;
pub mod drifts;
pub mod e_detector;
pub mod false_alarms;
pub mod watched;
