//! A joint that loses its force, gains some, or seizes; one that rests; and samples that are lost:
//! what the monitor says of each axis.

use super::watched::{GONE, Joint, RATE_HZ, RESTING, SEIZED, WELL, Watched, chain};
use jointwatch_shared::chain::{RawAxis, RawSample};
use jointwatch_shared::monitor::{Cause, Onset, State};

#[test]
fn a_joint_that_is_well_is_called_so_after_a_second_and_stays_so() {
    let mut watched = Watched::new();
    watched.run(60.0, [WELL; 2], 0);
    for axis in 0..2 {
        let (time, cause) = watched.first(axis, State::Healthy).expect("healthy");
        assert!((0.9..1.3).contains(&time), "{time}");
        assert_eq!(cause, Cause::AsExpected);
        assert_eq!(watched.seen[axis].len(), 2, "{:?}", watched.seen[axis]);
        let health = watched.axis(axis);
        assert_eq!((health.judged_permille, health.unjudged_samples), (1000, 0));
    }
    assert_eq!(watched.state.verdict().state, State::Healthy);
}

#[test]
fn a_force_that_is_gone_is_told_within_a_second_and_never_healthy_again() {
    for before_s in [0.0, 20.0] {
        for axes in [[GONE, WELL], [WELL, GONE], [GONE, GONE]] {
            let mut watched = Watched::new();
            watched.run(before_s, [WELL; 2], 0);
            watched.run(40.0, axes, 0);
            let mut any = false;
            for (axis, joint) in axes.iter().enumerate() {
                let seen = &watched.seen[axis];
                if joint.force != 0.0 {
                    assert!(watched.first(axis, State::Alarm).is_none(), "{seen:?}");
                    continue;
                }
                any = true;
                let (time, cause) = watched.first(axis, State::Alarm).expect("an alarm");
                assert!((before_s..before_s + 1.0).contains(&time), "{seen:?}");
                assert_eq!(cause, Cause::ForceGone);
                let healthy = seen.iter().filter(|(_, v)| v.state == State::Healthy);
                assert_eq!(healthy.count(), usize::from(before_s > 0.0), "{seen:?}");
                assert_eq!(watched.axis(axis).verdict.state, State::Alarm);
            }
            assert!(any && watched.state.verdict().state == State::Alarm);
        }
    }
}

#[test]
fn a_joint_that_seizes_hardly_moves_and_is_told_by_its_force() {
    let mut watched = Watched::new();
    watched.run(10.0, [WELL; 2], 0);
    watched.run(10.0, [WELL, SEIZED], 0);
    let (time, cause) = watched.first(1, State::Alarm).expect("an alarm");
    assert!((10.0..11.0).contains(&time), "{:?}", watched.seen[1]);
    assert_eq!(cause, Cause::ForceUnexpected);
    assert!(watched.first(0, State::Alarm).is_none());
}

#[test]
fn outside_the_range_only_a_force_that_is_gone_is_evidence() {
    let half = Joint { force: 0.5, ..WELL };
    let double = Joint { force: 2.0, ..WELL };
    // The displacement of the first axis, or its input.
    for (joint, outside, wanted) in [
        (GONE, 0b01, Some(Cause::ForceGone)),
        (half, 0b01, None),
        (double, 0b01, None),
        (WELL, 0b01, None),
        (WELL, 0b01_0000, None),
    ] {
        let mut watched = Watched::new();
        watched.run(10.0, [WELL; 2], 0);
        watched.run(20.0, [joint, WELL], outside);
        let alarm = watched.first(0, State::Alarm).map(|(_, cause)| cause);
        assert_eq!(alarm, wanted, "{:?}", watched.seen[0]);
        if wanted.is_none() {
            let verdict = watched.axis(0).verdict;
            assert_eq!(
                (verdict.state, verdict.cause),
                (State::Suspect, Cause::OutsideRange)
            );
            // The other axis is inside, but the model takes the states of both.
            let verdict = watched.axis(1).verdict;
            assert_eq!(
                (verdict.state, verdict.cause),
                (State::Unjudged, Cause::OutsideRange)
            );
        }
    }
}

#[test]
fn healthy_ends_when_the_joint_rests_and_comes_back_when_it_moves() {
    let mut watched = Watched::new();
    watched.run(20.0, [WELL; 2], 0);
    watched.run(20.0, [RESTING, WELL], 0);
    let health = watched.axis(0);
    let (time, cause) = watched.seen[0].last().map(|(t, v)| (*t, v.cause)).unwrap();
    // A fifth of 8 s is left after 6.6 s.
    assert!((26.0..27.5).contains(&time), "{:?}", watched.seen[0]);
    assert_eq!(cause, Cause::TooGentle);
    assert_eq!(
        (health.verdict.state, health.judged_permille),
        (State::Unjudged, 0)
    );
    assert!((19_000..=20_064).contains(&health.unjudged_samples));
    // One axis that is not judged is enough for the joint not to be healthy.
    assert_eq!(watched.axis(1).verdict.state, State::Healthy);
    let whole = watched.state.verdict();
    assert_eq!((whole.state, whole.axis), (State::Unjudged, 0));
    watched.run(3.0, [WELL; 2], 0);
    assert_eq!(watched.state.verdict().state, State::Healthy);
}

/// Runs for so long with this share of the samples lost in gaps of so many.
fn lose(watched: &mut Watched, seconds: f64, joints: [Joint; 2], share: f64, gap: u32) {
    let end = watched.rows + (seconds * RATE_HZ) as u32;
    let kept = (f64::from(gap) * (1.0 / share - 1.0)).round().max(1.0) as u32;
    while watched.rows < end {
        watched.sample(joints, 0, gap);
        for _ in 1..kept.min(end.saturating_sub(watched.rows)) {
            watched.sample(joints, 0, 0);
        }
    }
}

#[test]
fn whatever_is_lost_the_verdict_is_right_or_none() {
    for share in [0.001, 0.01, 0.1, 0.3, 0.6, 0.8, 0.9, 0.998, 0.9999] {
        for gap in [1, 10, 100, 1000, 10_000, 100_000] {
            // Hours would be needed to lose little in long gaps.
            if gap > 1000 && share < 0.3 {
                continue;
            }
            let what = format!("{share} lost in gaps of {gap}");
            let mut well = Watched::new();
            let seconds = if gap < 10_000 { 30.0 } else { 200.0 };
            well.run(10.0, [WELL; 2], 0);
            lose(&mut well, seconds, [WELL; 2], share, gap);
            let damage = well
                .seen
                .iter()
                .flatten()
                .find(|(_, v)| v.cause.is_damage());
            assert_eq!(damage, None, "{what}");
            // Broken from the start: whatever is lost, it is never called healthy.
            let mut broken = Watched::new();
            lose(&mut broken, seconds, [GONE, WELL], share, gap);
            assert!(
                broken.first(0, State::Healthy).is_none(),
                "{what}: {:?}",
                broken.seen[0]
            );
            let healthy = well.axis(0).verdict.state == State::Healthy;
            let long_gaps = f64::from(gap) > 0.7 * 8.0 * RATE_HZ;
            assert!(
                !(healthy && share >= 0.9 && !long_gaps),
                "{what}: {:?}",
                well.axis(0)
            );
        }
    }
    // Nearly all of it lost: the sensors' alarm says so, and no axis is judged.
    let mut watched = Watched::new();
    watched.run(20.0, [WELL; 2], 0);
    lose(&mut watched, 60.0, [WELL; 2], 0.998, 500);
    let verdict = watched.state.verdict();
    assert_eq!(
        (verdict.state, verdict.cause),
        (State::Alarm, Cause::Missing)
    );
    assert!(watched.axis(0).judged_permille == 0);
}

/// Outputs that a fault spoils, from the one that comes with it on.
fn spoilt() -> u32 {
    let chain = chain();
    u32::from(chain.invalidated_by_fault()) + chain.band().taps.len() as u32
}

#[test]
fn what_a_gap_spoils_is_not_judged() {
    // The residual behind a gap is many times the force, as long as the gap is in the filters.
    let garbage = Joint {
        besides: 50.0,
        ..WELL
    };
    let mut watched = Watched::new();
    watched.run(10.0, [WELL; 2], 0);
    for _ in 0..300 {
        watched.sample([garbage; 2], 0, 1);
        for _ in 1..spoilt() {
            watched.sample([garbage; 2], 0, 0);
        }
        watched.run(0.08, [WELL; 2], 0);
    }
    let mut seen = watched.seen.iter().flatten();
    let damage = seen.find(|(_, v)| v.cause.is_damage());
    assert_eq!(damage, None);
}

#[test]
fn a_block_that_has_lost_too_much_is_begun_anew() {
    // Between two gaps of more than a quarter of a block there is half a block that nothing spoils.
    let mut watched = Watched::new();
    for _ in 0..200 {
        watched.sample([WELL; 2], 0, 24);
        for _ in 1..spoilt() + 32 {
            watched.sample([WELL; 2], 0, 0);
        }
    }
    assert_eq!(watched.axis(0).judged_permille, 0);
}

#[test]
fn the_second_axis_is_told_for_the_whole_joint() {
    let mut watched = Watched::new();
    watched.run(20.0, [WELL, GONE], 0);
    let verdict = watched.state.verdict();
    assert_eq!((verdict.state, verdict.axis), (State::Alarm, 1));
}

#[test]
fn a_channel_that_stands_still_is_told_and_nothing_is_judged_meanwhile() {
    fn swinging(row: u32) -> RawSample {
        let swing = (row % 50) as i32 * 40;
        let axis = RawAxis {
            displacement: [swing, -swing],
            body: swing,
            acceleration: swing,
            force: swing,
            input: 0,
        };
        [axis; 2]
    }
    fn stuck(row: u32) -> RawSample {
        let mut both = swinging(row);
        both[0].force = 7;
        both
    }
    let mut watched = Watched::with_channels(swinging);
    watched.run(10.0, [WELL; 2], 0);
    assert_eq!(watched.axis(0).verdict.state, State::Healthy);
    watched.raw = stuck;
    watched.run(10.0, [WELL; 2], 0);
    let verdict = watched.state.verdict();
    assert_eq!(
        (verdict.state, verdict.cause, verdict.axis, verdict.channel),
        (State::Alarm, Cause::Stuck, 0, 4)
    );
    assert_eq!(watched.axis(0).judged_permille, 0);
    watched.raw = swinging;
    watched.run(10.0, [WELL; 2], 0);
    assert_eq!(watched.state.verdict().state, State::Healthy);
}

#[test]
fn a_gap_counts_by_its_samples_and_ends_healthy_when_it_is_long() {
    let mut watched = Watched::new();
    watched.run(20.0, [WELL; 2], 0);
    // 100 samples of half a second are far more than a tenth, one is not.
    watched.sample([WELL; 2], 0, 1);
    watched.run(0.1, [WELL; 2], 0);
    assert_ne!(watched.state.verdict().cause, Cause::Missing);
    watched.sample([WELL; 2], 0, 200);
    watched.run(0.1, [WELL; 2], 0);
    let verdict = watched.state.verdict();
    assert_eq!(
        (verdict.state, verdict.cause),
        (State::Alarm, Cause::Missing)
    );
    watched.run(10.0, [WELL; 2], 0);
    assert_eq!(watched.state.verdict().state, State::Healthy);
    watched.sample([WELL; 2], 0, 8000);
    watched.run(3.0, [WELL; 2], 0);
    watched.sample([WELL; 2], 0, 8000);
    watched.run(0.2, [WELL; 2], 0);
    let health = watched.axis(0);
    assert!(health.judged_permille < 200, "{health:?}");
    assert_ne!(health.verdict.state, State::Healthy);
}

#[test]
fn what_comes_slowly_is_told_from_what_is_there_at_once() {
    let softer = |part: f64| Joint {
        force: 1.0 - 0.15 * part,
        ..WELL
    };
    let onset = |seconds: f64| {
        let mut watched = Watched::new();
        watched.run(20.0, [WELL; 2], 0);
        let steps = (seconds * RATE_HZ) as u32;
        for row in 1..=steps {
            let part = f64::from(row) / f64::from(steps);
            watched.sample([softer(part), WELL], 0, 0);
        }
        watched.run(20.0, [softer(1.0), WELL], 0);
        let mut seen = watched.seen[0].iter();
        let alarm = seen.find(|(_, v)| v.state == State::Alarm);
        let (time, verdict) = alarm.expect("an alarm");
        assert!(
            *time > 20.0 && verdict.cause == Cause::Softer,
            "{verdict:?}"
        );
        verdict.onset()
    };
    assert_eq!(onset(0.0), Onset::Sudden);
    assert_eq!(onset(2.0), Onset::Sudden);
    assert_eq!(onset(200.0), Onset::Slow);
    assert_eq!(onset(600.0), Onset::Slow);
}

#[test]
fn a_block_that_was_begun_anew_knows_nothing_of_the_range_before() {
    for phase in 0..64 {
        let mut watched = Watched::new();
        watched.run(1.0 + f64::from(phase) / RATE_HZ, [WELL; 2], 0);
        watched.run(0.01, [WELL; 2], 1);
        watched.sample([WELL; 2], 0, 40);
        let (before, ..) = watched.state.last_gross_block();
        while watched.state.last_gross_block().0 == before {
            watched.sample([WELL; 2], 0, 0);
        }
        assert!(!watched.state.last_gross_block().2, "{phase}");
    }
}
