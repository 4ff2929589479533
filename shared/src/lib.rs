//! What Jointwatch's host and device must agree on, to the bit.
//!
//! `no_std`, no heap, no `unsafe`. The host learns a model in `f64`; what is in here evaluates it in integers, on
//! the host to predict the device and on the device itself, with the same bits.
#![no_std]
#![forbid(unsafe_code)]

// Force laws in `f64` need the standard library's functions; the device has neither.
#[cfg(feature = "fit")]
extern crate std;

pub mod blob;
pub mod effect;
pub mod error;
pub mod filter;
pub mod fixed;
pub mod hum;
pub mod interpolate;
pub mod kernels;
mod layout;
pub mod model;
pub mod monitor;
pub mod pipeline;
pub mod rig;
pub mod rig_block;
pub mod scalar;
pub mod scale;
pub mod selftest;
pub mod selftest_chain;
pub mod selftest_network;
pub mod slot;
pub mod snapshot;
pub mod tanh;
pub mod telemetry;
pub mod units;
pub mod wiring;
