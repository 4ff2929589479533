//! Jointwatch on the microcontroller: what it does there, without knowing which microcontroller it
//! is.
//!
//! `board` holds the boards, each behind a feature; everything else runs on any of them, and on a
//! computer for its tests.
#![no_std]
#![deny(unsafe_code)]

pub mod app;
#[cfg(feature = "semihosting")]
#[allow(
    unsafe_code,
    reason = "registers, linker symbols and debugger calls have no safe form"
)]
pub mod board;
pub mod clock;
pub mod key;
mod pair;
pub mod sensor;
pub mod store;
pub mod suite;

#[cfg(test)]
extern crate std;
