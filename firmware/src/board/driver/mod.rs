//! What the drivers of several boards share.

pub(super) mod instants;
pub(super) mod sending;
pub(super) mod slot_flash;
pub(super) mod transaction;
