//! The monitor on a simulated joint: a healthy hour without an alarm, and a joint that changes is found in time.

use jointwatch::sim::RigParameters;
use jointwatch::study::Record;
use jointwatch_shared::monitor::{Cause, Faults, MonitorState, State, Verdict};
use jointwatch_tests::false_alarms::{Campaign, WANTED_HOURS, report};
use jointwatch_tests::watched::{Learnt, STUDY_LEVEL, Shaking, Subject};
use rayon::prelude::*;

fn subject(learnt: Learnt, seed: u64) -> Subject {
    let subject = Subject::new(learnt, RigParameters::default(), seed, WANTED_HOURS);
    subject.unwrap_or_else(|why| panic!("{learnt:?}, seed {seed}: {why}"))
}

/// Every change of the verdict over a record, from a fresh start.
fn watch(subject: &Subject, record: &Record) -> Vec<(f64, Verdict)> {
    subject.watch(&mut MonitorState::default(), record, |_| ())
}

/// The drives of a joint that changes: as in the study, harder, both rising, and the other axis undriven. One axis has to move to
/// be judged.
fn drives(seconds: f64, axis: usize, seed: u64) -> [Shaking; 4] {
    let mut alone = Shaking::steady(seconds, 0.95, seed + 3);
    alone.levels[1 - axis] = [0.0; 2];
    let mut rising = Shaking::steady(seconds, 1.0, seed + 2);
    rising.levels = [[0.75, 1.0]; 2];
    [
        Shaking::steady(seconds, STUDY_LEVEL, seed),
        Shaking::steady(seconds, 1.0, seed + 1),
        rising,
        alone,
    ]
}

/// The first alarm, if any, as time and verdict.
fn alarm(seen: &[(f64, Verdict)]) -> Option<(f64, Verdict)> {
    seen.iter().copied().find(|(_, v)| v.state == State::Alarm)
}

fn story(seen: &[(f64, Verdict)]) -> String {
    let told = |(time, v): &(f64, Verdict)| {
        format!(
            "{time:.2} s {}: {}",
            v.state.words(),
            v.words(&["x", "phi"])
        )
    };
    seen.iter().map(told).collect::<Vec<_>>().join("; ")
}

/// When a joint changes, s into its record.
const CHANGES_AT_S: f64 = 5.0;

/// Every change of the joint by 10 % of the RMS force raises an alarm about that axis in time, and none comes before it.
fn finds_changes(learnt: Learnt, most_error: f64, within_s: f64) {
    for seed in [1, 2, 3] {
        let subject = subject(learnt, seed);
        let error = subject.relative_error;
        println!("{learnt:?}, seed {seed}: relative errors {error:?}");
        assert!(error.iter().all(|e| *e < most_error), "{error:?}");
        let watched: Vec<_> = subject
            .changes(0.1)
            .into_par_iter()
            .enumerate()
            .map(|(number, (what, worn))| {
                let axis = number / 5;
                let drives = drives(
                    CHANGES_AT_S + within_s,
                    axis,
                    1000 * seed + 10 * number as u64,
                );
                let drive = drives[(number + seed as usize) % drives.len()];
                let record = subject.shake(drive, Some((CHANGES_AT_S, worn)));
                (what, axis, drive.levels, watch(&subject, &record))
            })
            .collect();
        for (what, axis, levels, seen) in watched {
            let (time, verdict) = alarm(&seen).unwrap_or_else(|| {
                panic!(
                    "{learnt:?}, seed {seed}, {what}, {levels:?}: no alarm; {}",
                    story(&seen)
                )
            });
            println!(
                "{learnt:?}, seed {seed}, {what}, driven at {levels:?}: {:.2} s, {}",
                time - CHANGES_AT_S,
                verdict.words(&["x", "phi"])
            );
            assert!(time > CHANGES_AT_S, "{what}: before the change");
            assert!(verdict.cause.is_damage(), "{what}: {verdict:?}");
            assert_eq!(usize::from(verdict.axis), axis, "{what}: {verdict:?}");
        }
    }
}

#[test]
fn a_changed_joint_is_found_within_two_seconds_by_a_good_model() {
    finds_changes(Learnt::Physical, 0.05, 2.0);
}

#[test]
fn a_changed_joint_is_found_within_ten_seconds_by_a_plain_polynomial() {
    finds_changes(Learnt::Polynomial, 0.25, 10.0);
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
                (minute, watch(&subject, &record))
            })
            .collect();
        let mut suspect = 0;
        for (minute, seen) in &minutes {
            suspect += seen
                .iter()
                .filter(|(_, v)| v.state == State::Suspect)
                .count();
            assert!(
                alarm(seen).is_none(),
                "{learnt:?}, minute {minute}: {}",
                story(seen)
            );
            assert!(seen.iter().any(|(_, v)| v.state == State::Healthy));
        }
        println!("{learnt:?}, seed {seed}: an hour without an alarm, suspect {suspect} times");
    }
}

#[test]
fn the_tail_of_a_short_campaign_reaches_the_stated_interval() {
    // Rigs whose parameters were drawn anew, none of them used to choose a constant of the monitor; docs/monitor.md has the long one.
    for learnt in [Learnt::Physical, Learnt::Polynomial] {
        let campaign = Campaign::run(learnt, 500, 2, 0.5).unwrap_or_else(|why| panic!("{why}"));
        println!("{}", report(&campaign));
        assert_eq!(campaign.alarms, 0);
        let [likely, _] = campaign.hours_between();
        assert!(likely > f64::from(WANTED_HOURS), "{likely} hours");
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
    for (row, (raw, output)) in subject.set_up.samples(&record, &subject.model).enumerate() {
        let mut faults = Faults::default();
        if (5000..10_000).contains(&row) && row % 5 == 0 {
            faults.checksum = Faults::bit(0, 3);
        }
        let verdict = subject
            .monitor
            .update(&mut state, &raw, output.as_ref(), &faults);
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
