//! Chips that fail: what is wrong is said, passes, and stops nothing.

use super::subject::{polynomial, run, said, same_bits};
use jointwatch::emulate::bench::{Run, Scenario};
use jointwatch::emulate::board::{BoardChip, DropOuts, Injection, Trouble};
use jointwatch_firmware::sensor::presence::BACK_WITHIN;
use jointwatch_shared::monitor::{Cause, State};

/// Samples after the end of a fault in which every count is right again, unless its chip was given
/// up meanwhile.
const RECOVERY: u64 = 64;

/// The same with a chip that was given up.
const RECOVERY_OF_GIVEN_UP: u64 = BACK_WITHIN as u64;

/// Nothing was concluded about the joint, which is healthy.
fn no_damage(run: &Run) {
    let mut verdicts = run.said.statuses.iter().filter_map(|s| s.verdict.read());
    let alarm = verdicts.find(|v| v.state == State::Alarm && v.cause.is_damage());
    assert_eq!(alarm, None);
}

#[test]
fn every_trouble_of_a_chip_is_said_and_passes_and_stops_nothing() {
    let device = polynomial();
    let samples = 2000..4000;
    for (place, trouble, causes) in [
        (
            BoardChip::Converter,
            Trouble::Silent(0x00),
            vec![Cause::Checksum],
        ),
        (
            BoardChip::Converter,
            Trouble::Silent(0xFF),
            vec![Cause::Checksum],
        ),
        (
            BoardChip::Converter,
            Trouble::Damaged,
            vec![Cause::Checksum],
        ),
        (
            BoardChip::Converter,
            Trouble::Replaced,
            vec![Cause::TimeOut, Cause::Missing, Cause::Checksum],
        ),
        (
            BoardChip::Converter,
            Trouble::PowerCut,
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (BoardChip::Converter, Trouble::Stuck, vec![Cause::Stuck]),
        (
            BoardChip::Converter,
            Trouble::Saturated,
            vec![Cause::Saturated],
        ),
        (BoardChip::Counter(0), Trouble::Stuck, vec![Cause::Stuck]),
        (
            BoardChip::Counter(2),
            Trouble::Silent(0xFF),
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            BoardChip::Counter(1),
            Trouble::PowerCut,
            vec![Cause::TimeOut, Cause::Missing, Cause::OutsideRange],
        ),
        (
            BoardChip::Accelerometer(0),
            Trouble::Silent(0xFF),
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            BoardChip::Accelerometer(1),
            Trouble::Replaced,
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            BoardChip::Accelerometer(0),
            Trouble::Saturated,
            vec![Cause::Saturated],
        ),
    ] {
        let injection = Injection {
            place,
            trouble,
            samples: samples.clone(),
        };
        let run = run(
            &device,
            Scenario {
                injections: vec![injection],
                ..Scenario::default()
            },
        );
        same_bits(&run);
        let seen: Vec<_> = run
            .said
            .statuses
            .iter()
            .filter_map(|s| s.verdict.read())
            .map(|v| (v.state, v.cause))
            .collect();
        assert!(
            causes.iter().any(|cause| said(&run, *cause)),
            "{place:?} {trouble:?}: {seen:?}"
        );
        assert_eq!(run.comparison.samples, run.instants);
        // What is over is over, but for a count that the chip itself lost: of that no conclusion is
        // drawn about the joint.
        let lost = matches!((place, trouble), (BoardChip::Counter(_), Trouble::PowerCut));
        let allowed = if lost { Cause::ReferenceLost.tag() } else { 0 };
        let last = run.said.statuses.last().unwrap();
        assert!(
            last.channels
                .iter()
                .all(|c| [0, allowed].contains(&c.fault)),
            "{place:?} {trouble:?} has passed: {:?}",
            last.channels
        );
        assert_eq!(
            said(&run, Cause::ReferenceLost),
            lost,
            "{place:?} {trouble:?}"
        );
        no_damage(&run);
        if lost {
            let verdict = last.verdict.read().map(|v| (v.state, v.cause, v.channel));
            let wanted = (State::Alarm, Cause::ReferenceLost, 1);
            assert_eq!(verdict, Some(wanted), "{place:?} {trouble:?}");
        } else if let Some(last) = run.comparison.last_wrong_counts {
            println!(
                "{place:?} {trouble:?}: the last wrong count came with sample {last} of {}",
                run.instants
            );
            assert!(
                last < samples.end + RECOVERY_OF_GIVEN_UP,
                "{place:?} {trouble:?}: {last}"
            );
        }
    }
}

#[test]
fn transfers_that_drop_out_change_no_bit_of_what_is_computed() {
    let device = polynomial();
    let samples = 1000..3000;
    for part in [0.01, 0.1, 0.5] {
        let run = run(
            &device,
            Scenario {
                drop_outs: Some(DropOuts {
                    part,
                    samples: samples.clone(),
                }),
                seed: 21,
                ..Scenario::default()
            },
        );
        same_bits(&run);
        assert_eq!(run.comparison.samples, run.instants);
        let worst = run.said.statuses.iter().filter_map(|s| s.verdict.read());
        assert!(
            worst.into_iter().any(|v| v.state != State::Healthy),
            "{part}"
        );
        let last = run.said.statuses.last().unwrap();
        let wrong = last.channels.iter().filter(|c| c.fault != 0).count();
        assert_eq!(wrong, 0, "{part}: {:?}", last.channels);
        println!("{part}: {:?}", run.comparison);
        let last = run.comparison.last_wrong_counts.expect("drop-outs");
        // With every second transfer lost the converter is given up.
        let recovery = if part < 0.5 {
            RECOVERY
        } else {
            RECOVERY_OF_GIVEN_UP
        };
        assert!(
            last < samples.end + recovery,
            "{part}: still wrong at {last}"
        );
        assert!(
            !said(&run, Cause::ReferenceLost),
            "{part}: no chip lost its count"
        );
        no_damage(&run);
    }
}
