//! What the drivers of several boards share.

pub(super) mod instants;
#[cfg(not(feature = "nrf52840"))]
pub(super) mod sending;
#[cfg(not(feature = "rp2350"))]
pub(super) mod slot_flash;
pub(super) mod transaction;
