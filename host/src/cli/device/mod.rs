//! Commands for the device: its blob and keys, what it says, and what it would say.

pub(super) mod capture;
pub(super) mod emulate;
pub(super) mod export;
pub(super) mod keygen;
pub(super) mod monitor;
pub(super) mod order;
pub(super) mod replay;
mod serve;
pub(super) mod sign;
pub(super) mod study_from;
pub(super) mod upload;
mod watched;
