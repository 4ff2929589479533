//! The crate and its program as others use them: known truth comes back, and every bad input is
//! told in one sentence.

mod bad_input;
mod corrections;
mod data_checks;
mod effects_recovered;
#[cfg(target_os = "linux")]
mod interrupt;
mod matlab_logs;
mod monitor_command;
mod motion;
mod physical_bounds;
mod report_page;
