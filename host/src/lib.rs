//! Jointwatch on the host: learn a joint's restoring force from rig logs, compare it with measurements, export it.
#![forbid(unsafe_code)]

pub mod add;
pub mod apply;
pub mod cli;
pub mod compare;
pub mod corrections;
mod date;
pub mod device;
pub mod diagnose;
pub mod effects_page;
pub mod emulate;
pub mod error;
pub mod export;
pub mod fit;
pub mod identify;
mod lines;
pub mod model;
pub mod model_file;
pub mod monitor_limits;
pub mod motion;
pub mod output;
pub mod paper;
pub mod replay;
pub mod report;
pub mod respond;
pub mod rig_block;
mod rig_file;
pub mod signal;
pub mod signing;
pub mod sim;
pub mod study;
mod symbols;
pub mod table;
pub mod telemetry;
pub mod text_plot;
pub mod upload;
pub mod wired;
