//! The monitor on a simulated joint: a healthy hour without an alarm, and a joint that changes is
//! found in time.

use jointwatch::simulate::RigParameters;
use jointwatch::study::Record;
use jointwatch_shared::chain::ChainState;
use jointwatch_shared::monitor::{Cause, Faults, MonitorState, Onset, State, Verdict};
use jointwatch_tests::monitor::detection::{detect, story};
use jointwatch_tests::monitor::drifts::{Motion, Quantity, drifting, said};
use jointwatch_tests::monitor::false_alarms::{Campaign, WANTED_HOURS, report};
use jointwatch_tests::monitor::watched::{Learnt, RATE_HZ, STUDY_LEVEL, Shaking, Subject};
use rayon::prelude::*;

fn subject(learnt: Learnt, seed: u64) -> Subject {
    let subject = Subject::new(learnt, RigParameters::default(), seed, WANTED_HOURS);
    subject.unwrap_or_else(|why| panic!("{learnt:?}, seed {seed}: {why}"))
}

/// Every change of the verdict over a record, from a fresh start.
fn watch(subject: &Subject, record: &Record) -> Vec<(f64, Verdict)> {
    subject.watch(&mut MonitorState::default(), record, |_| ())
}

/// The first alarm, if any, as time and verdict.
fn alarm(seen: &[(f64, Verdict)]) -> Option<(f64, Verdict)> {
    seen.iter().copied().find(|(_, v)| v.state == State::Alarm)
}

const DEFAULT_RIG: &str = "default rig";
const DRAWN_RIG: &str = "rig drawn anew";

/// Every change of the joint by 10 % of the RMS force, under every drive, raises an alarm about
/// that axis in time, and none comes before it; on the default rig and on others, and on
/// `missed_once`, on which it once did not.
fn finds_changes(
    learnt: Learnt,
    most_error: f64,
    within_s: f64,
    missed_once: &[(&'static str, u64)],
) {
    let rigs = (1..=5).flat_map(|seed| [(DEFAULT_RIG, seed), (DRAWN_RIG, seed)]);
    for (rig, seed) in rigs.chain(missed_once.iter().copied()) {
        let parameters = match rig {
            DEFAULT_RIG => RigParameters::default(),
            _ => RigParameters::draw(seed),
        };
        let subject = Subject::new(learnt, parameters, seed, WANTED_HOURS)
            .unwrap_or_else(|why| panic!("{learnt:?}, {rig}, seed {seed}: {why}"));
        let error = subject.relative_error;
        println!("{learnt:?}, {rig}, seed {seed}: relative errors {error:.4?}");
        assert!(error.iter().all(|e| *e < most_error), "{error:?}");
        for watched in detect(&subject, 0.1, within_s, seed) {
            println!("  {}", watched.told());
            let came = watched.alarm().map(|(_, verdict)| verdict.onset());
            assert!(
                watched.is_found_within(within_s) && came == Some(Onset::Sudden),
                "{learnt:?}, {rig}, seed {seed}: {}",
                watched.told()
            );
        }
    }
}

#[test]
fn a_changed_joint_is_found_within_two_seconds_by_a_good_model() {
    finds_changes(Learnt::Physical, 0.05, 2.0, &[]);
}

#[test]
fn a_changed_joint_is_found_within_ten_seconds_by_a_plain_polynomial() {
    let bursts_towards_softer = [(DRAWN_RIG, 100), (DRAWN_RIG, 101), (DEFAULT_RIG, 104)];
    finds_changes(Learnt::Polynomial, 0.25, 10.0, &bursts_towards_softer);
}

#[test]
fn most_of_what_drifts_is_told_as_slow() {
    let subject = subject(Learnt::Physical, 1);
    let runs = [
        (Quantity::Gain, 0.02),
        (Quantity::Zero, 0.02),
        (Quantity::Zero, -0.03),
        (Quantity::Temperature, 0.05),
    ];
    let runs = runs
        .into_iter()
        .flat_map(|run| Motion::ALL.map(|motion| (run, motion)));
    let (mut alarms, mut slow) = (0, 0);
    for ((quantity, size), motion) in runs {
        let said = said(&subject, &drifting(&subject, quantity, size, motion, 7));
        println!("{quantity:?} by {size}, {motion:?}: {said:?}");
        alarms += usize::from(said.alarm.is_some());
        slow += usize::from(said.slow);
    }
    assert!(alarms >= 9 && 3 * slow >= 2 * alarms, "{slow} of {alarms}");
}

#[test]
fn a_healthy_hour_raises_no_alarm() {
    // An hour per model, in minutes of other seeds, sizes and ramps, either axis undriven in some.
    for (learnt, seed) in [(Learnt::Physical, 1), (Learnt::Polynomial, 2)] {
        let subject = subject(learnt, seed);
        let minutes: Vec<_> = (0..60_u64)
            .into_par_iter()
            .map(|minute| {
                let record = subject.shake(Shaking::minute(minute, seed), None);
                let mut healthy = [false; 2];
                let seen = subject.watch(&mut MonitorState::default(), &record, |state| {
                    let own = [0, 1].map(|axis| {
                        let health = state.axis(&subject.monitor, axis);
                        health.verdict.state == State::Healthy
                    });
                    // The joint is healthy when both axes are.
                    let whole = state.verdict().state == State::Healthy;
                    assert_eq!(whole, own == [true; 2], "minute {minute}");
                    for (healthy, own) in healthy.iter_mut().zip(own) {
                        *healthy |= own;
                    }
                });
                (minute, seen, healthy)
            })
            .collect();
        let mut suspect = 0;
        for (minute, seen, healthy) in &minutes {
            suspect += seen
                .iter()
                .filter(|(_, v)| v.state == State::Suspect)
                .count();
            assert!(
                alarm(seen).is_none(),
                "{learnt:?}, minute {minute}: {}",
                story(seen)
            );
            // An axis that nobody drives is not judged, and the joint then not called healthy as a
            // whole; the driven one is.
            match minute % 9 {
                4 => assert!(healthy[0], "minute {minute}: {}", story(seen)),
                5 => assert!(healthy[1], "minute {minute}: {}", story(seen)),
                _ => assert!(seen.iter().any(|(_, v)| v.state == State::Healthy)),
            }
        }
        println!("{learnt:?}, seed {seed}: an hour without an alarm, suspect {suspect} times");
    }
}

#[test]
fn increments_on_rigs_not_used_for_tuning_keep_the_condition_of_the_bound() {
    // Rigs whose parameters were drawn anew, none of them used to choose a constant of the monitor;
    // docs/notebook/monitor.md has the long one.
    for learnt in [Learnt::Physical, Learnt::Polynomial] {
        let campaign = Campaign::run(learnt, 500, 2, 0.6).unwrap_or_else(|why| panic!("{why}"));
        println!("{}", report(&campaign));
        assert_eq!(campaign.alarms, 0);
        let worst = campaign.sums.iter().map(|sum| sum.moments.known_past());
        let worst = worst.fold(0.0, f64::max);
        let [hours, _] = campaign.worst_hours();
        match learnt {
            Learnt::Physical => {
                assert!(worst <= 1.0, "{worst}");
                assert!(hours > f64::from(WANTED_HOURS) - 1e-6, "{hours} hours");
            }
            // It misses the condition by 5 % at most under one drive, of which there are two
            // minutes here.
            Learnt::Polynomial => assert!(worst < 1.1, "{worst}"),
        }
    }
}

/// A record with every channel of both axes multiplied row by row.
fn scaled(record: &Record, gain: impl Fn(usize) -> f64) -> Record {
    let mut scaled = record.clone();
    for axis in &mut scaled.axes {
        let series = [
            Some(&mut axis.displacement_first),
            axis.displacement_second.as_mut(),
            axis.body_position.as_mut(),
            axis.acceleration.as_mut(),
            Some(&mut axis.force),
        ];
        for series in series.into_iter().flatten() {
            series
                .iter_mut()
                .enumerate()
                .for_each(|(row, value)| *value *= gain(row));
        }
    }
    scaled
}

#[test]
fn rest_is_not_judged_and_a_sensor_that_fails_is_named() {
    let subject = subject(Learnt::Polynomial, 1);
    let record = subject.shake(Shaking::steady(20.0, STUDY_LEVEL, 9), None);
    let rest = watch(&subject, &scaled(&record, |_| 0.0));
    let last = rest.last().expect("a verdict").1;
    assert_eq!(
        (last.state, last.cause),
        (State::Unjudged, Cause::TooGentle)
    );

    // The force channel of phi stands still from 8 s on.
    let mut stuck = record.clone();
    let at = stuck.axes[1].force[8000];
    stuck.axes[1].force[8000..].fill(at);
    let seen = watch(&subject, &stuck);
    let (time, verdict) = alarm(&seen).unwrap_or_else(|| panic!("{}", story(&seen)));
    println!("stuck force: {}", story(&seen));
    assert!((8.0..10.0).contains(&time));
    assert_eq!(
        (verdict.cause, verdict.axis, verdict.channel),
        (Cause::Stuck, 1, 4)
    );

    // One transfer in five has a wrong checksum, then none.
    let mut state = MonitorState::default();
    let mut seen = Vec::new();
    for (row, sample) in subject.set_up.samples(&record, &subject.model).enumerate() {
        let mut faults = sample.faults;
        if (5000..10_000).contains(&row) && row % 5 == 0 {
            faults.checksum = Faults::bit(0, 3);
        }
        let verdict =
            subject
                .monitor
                .update(&mut state, &sample.raw, sample.output.as_ref(), &faults);
        seen.push(verdict);
    }
    let words = |row: usize| format!("{}", seen[row].words(&["x", "phi"]));
    assert_eq!(seen[9000].state, State::Alarm);
    assert_eq!(
        words(9000),
        "accelerometer of x: wrong checksums, 20 % of the time"
    );
    assert_eq!(seen[15_000].state, State::Healthy, "{}", words(15_000));
}

#[test]
fn a_counter_that_lost_its_count_is_named_and_nothing_is_concluded_from_it() {
    let subject = subject(Learnt::Physical, 1);
    let record = subject.shake(Shaking::steady(20.0, STUDY_LEVEL, 11), None);
    // The far counter of x begins anew at 8 s; what it had counted is missing from then on.
    let counts = subject.set_up.counts(&record);
    let offset = counts[8000].0[0].displacement[0] + 4000;
    let watch = |told: bool| {
        let (mut chain, mut state) = (ChainState::default(), MonitorState::default());
        let mut seen: Vec<(f64, Verdict)> = Vec::new();
        for (row, (raw, faults)) in counts.iter().enumerate() {
            let (mut raw, mut faults) = (*raw, *faults);
            if row >= 8000 {
                raw[0].displacement[0] -= offset;
                faults.reference_lost = if told { Faults::bit(0, 0) } else { 0 };
            }
            let output = subject.set_up.chain.step(&mut chain, &subject.model, &raw);
            let monitor = &subject.monitor;
            let verdict = monitor.update(&mut state, &raw, output.as_ref(), &faults);
            if !seen.last().is_some_and(|(_, v)| v.same_reason(&verdict)) {
                seen.push((row as f64 / RATE_HZ, verdict));
            }
        }
        seen
    };
    let seen = watch(true);
    println!("{}", story(&seen));
    assert!(seen.iter().all(|(_, v)| !v.cause.is_damage()));
    let last = seen.last().expect("a verdict").1;
    assert_eq!(
        (last.state, last.cause, last.axis, last.channel),
        (State::Alarm, Cause::ReferenceLost, 0, 0)
    );
    // That is what keeps it from being taken for damage.
    let seen = watch(false);
    println!("untold: {}", story(&seen));
    assert!(
        seen.iter()
            .any(|(_, v)| v.cause != Cause::AsExpected && v.state >= State::Suspect)
    );
}

#[test]
fn outside_the_range_it_says_so_and_raises_no_alarm_of_damage() {
    let subject = subject(Learnt::Polynomial, 1);
    let record = subject.shake(Shaking::steady(20.0, STUDY_LEVEL, 10), None);
    // Three times as far from 8 s on: most of the motion is outside, and the model is wrong there.
    let wide = scaled(&record, |row| if row < 8000 { 1.0 } else { 3.0 });
    let seen = watch(&subject, &wide);
    println!("{}", story(&seen));
    assert!(alarm(&seen).is_none(), "{}", story(&seen));
    let last = seen.last().expect("a verdict").1;
    assert_eq!(
        (last.state, last.cause),
        (State::Suspect, Cause::OutsideRange)
    );
}
