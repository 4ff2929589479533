//! Everything that is bytes: model blob, rig, telemetry, and where they lie in flash.

pub mod blob;
pub mod bytes;
pub mod capture;
pub(crate) mod layout;
pub mod rig;
pub mod rig_block;
pub mod slot;
pub mod snapshot;
pub mod telemetry;
pub mod wiring;
