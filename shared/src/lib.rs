//! What Jointwatch's host and device must agree on, to the bit.
//!
//! `no_std`, no heap, no `unsafe`. The host learns a model in `f64`; what is in here evaluates it in integers, on
//! the host to predict the device and on the device itself, with the same bits.
#![no_std]
#![forbid(unsafe_code)]

// Force laws in `f64` need the standard library's functions; the device has neither.
#[cfg(feature = "fit")]
extern crate std;

pub mod base;
pub mod chain;
pub mod effect;
pub mod fault;
pub mod monitor;
pub mod scalar;
pub mod selftest;
pub mod units;
pub mod wire;
