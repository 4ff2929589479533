//! What goes to the device and what comes back: export, the rig block, limits of the monitor,
//! replay, telemetry, keys, upload.

pub mod capture;
pub(crate) mod chip_rates;
pub mod export;
pub mod followed;
mod line;
pub mod live;
pub mod monitor_limits;
pub mod order;
pub(crate) mod plain_rig;
pub mod replay;
pub mod rig_block;
mod rig_file;
pub mod signing;
pub mod study_from;
pub mod telemetry;
pub mod upload;
pub mod wired;
