//! A line of the mains in a force channel: the device follows it with the host's bits, and holds
//! still as long as a sensor lies.

use super::subject::{RATE_HZ, image, same_bits, subject, validation};
use jointwatch::emulate::bench::{REST, Run, Scenario};
use jointwatch::emulate::board::{BoardChip, Injection, Trouble};
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::study::{Record, Role, Study};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::monitor::State;
use jointwatch_tests::monitor::watched::add_line;

const HUM_HZ: f64 = 50.0;

/// The study of the others with hum of a twentieth of the largest force in every record, and their
/// physical model that knows of it.
fn humming() -> (Study, Model) {
    let mut study = subject().simulation.study.clone();
    let largest = |record: &Record| {
        let force = record.axes[0].force.iter();
        force.fold(0.0_f64, |most, f| most.max(f.abs()))
    };
    let amplitude = 0.05 * largest(&study.records[0]);
    for (number, record) in study.records.iter_mut().enumerate() {
        let (force, phase) = (&mut record.axes[0].force, 0.3 * number as f64);
        add_line(force, RATE_HZ, HUM_HZ, amplitude, phase);
    }
    let mut corrections = *subject().physical.corrections();
    corrections[0].hum = Hum {
        frequency_hz: HUM_HZ,
        amplitude,
    };
    let model = subject().physical.clone().correcting(corrections);
    (study, model.expect("a small line"))
}

fn run(scenario: Scenario) -> Run {
    let (study, model) = humming();
    let device = EmulatedDevice::new(&study, &model, None).unwrap_or_else(|why| panic!("{why}"));
    let slot = device.slot().expect("it can be signed").to_bytes();
    let record = study.records.iter().find(|r| r.role == Role::Validate);
    let record = record.expect("the simulation has one");
    let run = device.run(image(), &slot, record, &[], scenario);
    run.unwrap_or_else(|why| panic!("{why}")).run
}

fn damage(run: &Run) -> bool {
    let mut verdicts = run.said.statuses.iter().filter_map(|s| s.verdict.read());
    verdicts.any(|v| v.state == State::Alarm && v.cause.is_damage())
}

#[test]
fn a_line_is_followed_with_the_hosts_bits() {
    let run = run(Scenario::default());
    same_bits(&run);
    let c = &run.comparison;
    assert_eq!(c.samples, REST + validation().rows as u64, "{c:?}");
    assert_eq!(c.wrong_counts, 0, "{:?}", run.said.wrong);
    // The device has followed a line since it began, and `replay` of the record alone only since
    // the record did: the same bits are those of the host's chain over all that the device has
    // sampled.
    println!("{c:?}\n{:?}\n{:?}", run.said.events, run.instructions);
    assert!(!damage(&run), "{:?}", run.said.events);
}

#[test]
fn a_line_is_held_with_the_hosts_bits_while_a_sensor_lies() {
    for place in [BoardChip::Converter, BoardChip::Accelerometer(0)] {
        let injection = Injection {
            place,
            trouble: Trouble::Silent(0xFF),
            samples: 3000..4000,
        };
        let run = run(Scenario {
            injections: vec![injection],
            ..Scenario::default()
        });
        same_bits(&run);
        println!("{place:?}: {:?}\n{:?}", run.comparison, run.said.events);
        assert!(!damage(&run), "{place:?}: {:?}", run.said.events);
    }
}
