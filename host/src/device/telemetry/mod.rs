//! What a device says, on the host: the line it comes over, the messages found in it, and how a
//! person reads them.
//!
//! The messages themselves are defined in [`jointwatch_shared::wire::telemetry`].

pub mod frames;
pub mod line;
pub mod listen;
pub mod steady;
pub mod words;
