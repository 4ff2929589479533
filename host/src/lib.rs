//! Learn a joint's restoring force from rig logs, compare it with measurements, name the physical
//! effect it lacks, export it.
//!
//! From a folder with a `study.toml` and its logs to a named effect:
//!
//! ```
//! # fn main() -> jointwatch::Result<()> {
//! # let folder = tempfile::tempdir().expect("a folder for the study");
//! # let folder = folder.path().join("rig");
//! # let options = jointwatch::simulate::SimulationOptions {
//! #     axes: 1,
//! #     duration_s: 4.0,
//! #     hidden: Some(jointwatch::simulate::Hide { effect: "coulomb@x".into(), share: 0.1 }),
//! #     ..Default::default()
//! # };
//! # jointwatch::simulate::write_study(&folder, &options)?;
//! use jointwatch::{Kind, Study};
//!
//! let study = Study::read(&folder.join("study.toml"))?;
//! let base = jointwatch::identify(&study, Kind::Physical)?;
//! let diagnosis = jointwatch::diagnose(&study, &base)?;
//! for missing in &diagnosis.found {
//!     println!("missing: {}@{}", missing.effect, missing.axis);
//! }
//! let added = jointwatch::add(&study, &base, &["coulomb@x".into()])?;
//! assert!(added.helps);
//! added.model.write(&folder.join("model.json"))?;
//! # assert_eq!(diagnosis.found[0].effect, "coulomb");
//! # Ok(())
//! # }
//! ```
//!
//! The modules are layers: each imports only from those listed before it.
//!
//! | module | what is in it |
//! |---|---|
//! | [`text`] | errors, tables and units as people read them |
//! | [`study`] | `study.toml`, readers of logs, channels, units |
//! | [`signal`] | filters, derivatives, spectra, the motion made of a record |
//! | [`model`] | polynomial, network, effects, corrections of instruments; `model.json` |
//! | [`fit`] | learning all of them, and the errors on records |
//! | [`assess`] | comparison, where a model fails, noise floor, faults of the data |
//! | [`mod@diagnose`] | which effect is missing; adding it |
//! | [`simulate`] | the simulated rig, and a rig's response with a model in place of its joint |
//! | [`device`] | export, rig, limits of the monitor, replay, telemetry, upload |
//! | [`emulate`] | the firmware under QEMU |
//! | [`report`], [`paper`] | pictures and pages |
//! | [`lab`] | the local page for the whole loop |
//! | [`cli`] | the command line |
#![forbid(unsafe_code)]

pub mod assess;
pub mod cli;
pub mod device;
pub mod diagnose;
pub mod emulate;
pub mod fit;
pub mod lab;
pub mod model;
pub mod paper;
pub mod report;
pub mod signal;
pub mod simulate;
pub mod study;
pub mod text;

pub use assess::compare::compare;
pub use device::export::export;
pub use diagnose::add::add;
pub use diagnose::{Diagnosis, Verdict, diagnose};
pub use fit::identify::{Kind, identify};
pub use model::file::ModelFile as Model;
pub use study::{MemoryLog, Study};
pub use text::error::{Error, Result};
