//! The device without a board: its application, what only its owner may do, and power that fails.

mod app;
mod bench;
mod failing_flash;
mod flash;
mod kept_alarm;
mod owner;
mod power_cuts;
mod signing;
