//! What the drivers of several boards share.

pub(super) mod instants;
#[cfg(not(feature = "nrf52840"))]
pub(super) mod sending;
pub(super) mod slot_flash;
pub(super) mod transaction;
