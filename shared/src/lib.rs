//! What Jointwatch's host and device must agree on, to the bit.
//!
//! `no_std`, no heap, no `unsafe`. The host learns a model in `f64`; what is in here evaluates it
//! in integers, on the host to predict the device and on the device itself, with the same bits.
//!
//! A firmware decodes the model and the rig at start, makes the chain's integers from both, and
//! then hands it one sample of raw counts after the other:
//!
//! ```
//! use jointwatch_shared::chain::{Chain, ChainState, RawAxis};
//! use jointwatch_shared::selftest;
//! use jointwatch_shared::wire::{blob, rig_block};
//!
//! // The two files that `jointwatch export` writes; here those of the self-test.
//! let reference = selftest::reference_model();
//! let model_file = blob::encode(reference);
//! let mut rig = selftest::chain::reference_rig(selftest::chain::SHORT_TAPS)?;
//! rig.model_checksum = blob::checksum(&model_file);
//! let rig_file = rig_block::encode(&rig)?;
//!
//! // At start.
//! let model = blob::decode(&model_file)?;
//! let rig = rig_block::decode(&rig_file)?;
//! assert_eq!(rig.model_checksum, blob::checksum(&model_file));
//! let chain = Chain::new(&model, &rig)?;
//! let mut state = ChainState::NEW;
//!
//! // At every sample: what the counters and converters gave, axis by axis. Integers only from here on.
//! let mut outputs = 0;
//! for n in 0..100 {
//!     let axis = RawAxis { displacement: [40 * n, 0], body: 0, acceleration: 0, force: 25 * n, input: 0 };
//!     if let Some(output) = chain.step(&mut state, &model, &[axis; 2]) {
//!         // It describes the sample `chain.delay()` ago; the first ones fill the filters.
//!         let newtons = |counts: i32| f64::from(counts) * model.outputs()[0].force_per_lsb;
//!         let (force, residual) = (newtons(output.predicted[0]), newtons(output.residual[0]));
//!         assert!(force.is_finite() && residual.is_finite());
//!         outputs += 1;
//!     }
//! }
//! assert_eq!(outputs, 100 - 2 * chain.delay());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`scalar`], [`units`] | the few operations that a force law may use, for every kind of number; dimensions |
//! | [`effect`] | the physical effects, one file each |
//! | [`base`] | polynomial, network, tanh, and the model that they are part of |
//! | [`chain`] | raw counts to states, forces and residual |
//! | [`monitor`] | whether the joint still behaves as its model |
//! | [`wire`] | everything that is bytes: blob, rig, telemetry, flash slots |
//! | [`fault`] | what can be wrong with a model, a rig or a blob |
//! | [`selftest`] | test vectors and digests by which two machines compare their bits |
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
