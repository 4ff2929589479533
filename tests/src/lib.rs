//! What the tests of the whole need beside the parts themselves.

pub mod bouc_wen;
pub mod bus;
pub mod coverage;
pub mod curves;
pub mod detection;
pub mod drifts;
pub mod e_detector;
pub mod elf;
pub mod false_alarms;
pub mod faults;
pub mod foreign;
pub mod hidden;
pub mod imports;
pub mod joints;
pub mod lab;
pub mod league;
pub mod log;
pub mod program;
pub mod story;
pub mod watched;
