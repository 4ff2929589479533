//! Channels: which columns of a log they are, in which units, and what their numbers mean in SI.

pub(super) mod axis;
pub(super) mod calibrated;
pub(super) mod integrate;
pub(super) mod naming;
pub(super) mod signs;
pub(super) mod spare;
mod symbols;
pub(super) mod turns;
pub(super) mod units;
mod words;
