//! Jointwatch on the host: learn a joint's restoring force from rig logs, compare it with measurements, export it.
#![forbid(unsafe_code)]

pub mod add;
pub mod cli;
pub mod compare;
pub mod corrections;
pub mod device;
pub mod diagnose;
pub mod effects_page;
pub mod error;
pub mod export;
pub mod fit;
pub mod identify;
pub mod model;
pub mod model_file;
pub mod motion;
pub mod output;
pub mod paper;
pub mod replay;
pub mod report;
pub mod respond;
pub mod signal;
pub mod signing;
pub mod sim;
pub mod study;
mod symbols;
pub mod table;
pub mod text_plot;
pub mod upload;
