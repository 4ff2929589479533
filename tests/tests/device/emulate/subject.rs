//! The device that is emulated: a simulated rig, its models, and runs of the firmware over its
//! validation record.

use jointwatch::device::export::export;
use jointwatch::emulate::bench::{Run, Scenario};
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::emulate::judge::Known;
use jointwatch::emulate::selftest;
use jointwatch::fit::identify;
use jointwatch::fit::polynomial::PolynomialOptions;
use jointwatch::simulate::{Simulation, SimulationOptions, simulate};
use jointwatch::study::{Record, Role};
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::Cause;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::telemetry::Counters;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Rows per second of the simulated rig, and seconds of each record.
pub(crate) const RATE_HZ: f64 = 2000.0;
pub(crate) const SECONDS: f64 = 4.0;

/// A rig, a polynomial and the sum of the base terms, both exported.
pub(crate) struct Subject {
    pub(crate) simulation: Simulation,
    pub(crate) polynomial: Model,
    pub(crate) physical: Model,
}

pub(crate) fn subject() -> &'static Subject {
    static SUBJECT: OnceLock<Subject> = OnceLock::new();
    SUBJECT.get_or_init(|| {
        let options = SimulationOptions {
            seed: 5,
            duration_s: SECONDS,
            sample_rate_hz: RATE_HZ,
            ..SimulationOptions::default()
        };
        let simulation = simulate(&options).expect("a stable rig");
        let study = &simulation.study;
        let exported = |file| {
            let exported = export(&file, None).expect("it fits the device");
            blob::decode(&exported.blob).expect("a sound blob")
        };
        let polynomial = identify::polynomial(study, &PolynomialOptions::default(), &|_| ());
        Subject {
            polynomial: exported(polynomial.expect("a fit").model),
            physical: exported(identify::physical(study).expect("a fit").model),
            simulation,
        }
    })
}

pub(crate) fn validation() -> &'static Record {
    let mut records = subject().simulation.study.records.iter();
    records
        .find(|record| record.role == Role::Validate)
        .expect("the simulation has one")
}

pub(crate) fn image() -> &'static Path {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    IMAGE.get_or_init(|| selftest::emulated().unwrap_or_else(|why| panic!("{why}")))
}

pub(crate) fn polynomial() -> EmulatedDevice<'static> {
    EmulatedDevice::new(&subject().simulation.study, &subject().polynomial, None)
        .unwrap_or_else(|why| panic!("{why}"))
}

/// Runs the device over the validation record with its own model in slot A.
pub(crate) fn run(device: &EmulatedDevice<'_>, scenario: Scenario) -> Run {
    let slot = device.slot().expect("it can be signed").to_bytes();
    run_with(device, &slot, &[], scenario)
}

pub(crate) fn run_with(
    device: &EmulatedDevice<'_>,
    slot: &[u8],
    others: &[Known<'_>],
    scenario: Scenario,
) -> Run {
    let run = device.run(image(), slot, validation(), others, scenario);
    run.unwrap_or_else(|why| panic!("{why}")).run
}

/// Every bit of every output is the host's, for the counts that the device itself names.
pub(crate) fn same_bits(run: &Run) {
    let c = &run.comparison;
    assert!(c.outputs > 0, "{c:?}");
    assert_eq!((c.different_bits, c.first_difference), (0, None), "{c:?}");
}

pub(crate) fn counters(run: &Run) -> Counters {
    run.said.statuses.last().expect("a status").counters
}

/// Whether the device ever said so, of the whole or of a channel.
pub(crate) fn said(run: &Run, cause: Cause) -> bool {
    run.said.statuses.iter().any(|status| {
        let of_all = status.verdict.read().map(|verdict| verdict.cause);
        of_all == Some(cause) || status.channels.iter().any(|c| c.fault == cause.tag())
    })
}
