//! Derivatives, filters and spectra of logged signals.
//!
//! Everything here is linear-phase FIR filtering, because the device must be able to do the same
//! with the same taps: the host applies them centred (no delay), the device applies them to the
//! past (a delay of half their length). The one exception is `mixed_acceleration`, which only a
//! diagnosis listens to.

pub mod band;
pub mod design;
pub mod every;
pub mod filters;
pub mod fir;
mod lead_in;
pub(crate) mod mixed_acceleration;
pub mod motion;
pub mod spectrum;
pub(crate) mod standstill;

#[cfg(test)]
mod differentiate;
mod earlier;
