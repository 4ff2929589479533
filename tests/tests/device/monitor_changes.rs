//! Gross changes of the joint on a simulated rig: found in the documented time, on the right axis,
//! with the right direction.
//!
//! `monitor_campaign --curves` is the long version; `shared/tests/chain/monitor_changes.rs` has the
//! monitor alone.

use jointwatch::simulate::RigParameters;
use jointwatch_shared::monitor::State;
use jointwatch_tests::monitor::curves::{Change, Found, curves};
use jointwatch_tests::monitor::detection::story;
use jointwatch_tests::monitor::false_alarms::WANTED_HOURS;
use jointwatch_tests::monitor::watched::{Learnt, STUDY_LEVEL, Shaking, Subject};

fn subject(learnt: Learnt, rig: RigParameters, seed: u64) -> Subject {
    let subject = Subject::new(learnt, rig, seed, WANTED_HOURS);
    subject.unwrap_or_else(|why| panic!("{learnt:?}, seed {seed}: {why}"))
}

/// Every change of a kind on one rig, the wrong ones as sentences; those not found within
/// `within_s` of motion among them.
fn wrong(found: &[Found], within_s: f64) -> Vec<String> {
    let late = |found: &Found| match found.found_after() {
        Some(time) if time <= within_s => None,
        _ => Some(format!("not within {within_s} s: {}", found.told())),
    };
    let all = found.iter().filter_map(|f| f.wrong().or_else(|| late(f)));
    all.collect()
}

/// From power-on the filters and the first block take so long, s.
const STARTING_S: f64 = 0.2;

#[test]
fn a_joint_that_loses_most_of_its_force_or_seizes_is_found_within_a_second() {
    let losses = [-1.0, -0.9, -0.7].map(Change::SameMotion);
    let changes = [&losses[..], &[Change::Seized]].concat();
    let (within_s, watched_s) = (1.0, 14.0);
    // The default rig, and one drawn anew whose records are of very different sizes.
    for (rig, seed) in [
        (RigParameters::default(), 1),
        (RigParameters::draw(610), 610),
    ] {
        for learnt in [Learnt::Physical, Learnt::Polynomial] {
            let subject = subject(learnt, rig, seed);
            let found = curves(&subject, &changes, watched_s, seed);
            for found in &found {
                println!("{learnt:?}, seed {seed}: {}", found.told());
                assert_not_healthy(found, [within_s, 0.0], watched_s);
            }
            let wrong = wrong(&found, within_s + STARTING_S);
            assert!(wrong.is_empty(), "{learnt:?}:\n{}", wrong.join("\n"));
        }
    }
}

/// An axis that changed may be called healthy for so long, s: where it was well before, and where
/// it was not.
fn assert_not_healthy(found: &Found, most: [f64; 2], watched_s: f64) {
    let healthy = found.healthy_after(0.0, watched_s);
    let most = most[usize::from(found.before_power_on)];
    assert!(healthy <= most, "healthy for {healthy} s: {}", found.told());
}

#[test]
fn a_loss_of_a_third_of_the_force_and_more_and_twice_the_force_are_found_in_the_documented_time() {
    let changes = [-0.5, -0.3, 1.0].map(Change::SameMotion);
    let watched_s = 14.0;
    // A third of the force is little beside a plain polynomial's own error.
    for (learnt, within_s) in [(Learnt::Physical, 2.0), (Learnt::Polynomial, 6.0)] {
        let subject = subject(learnt, RigParameters::default(), 1);
        let found = curves(&subject, &changes, watched_s, 2);
        for found in &found {
            println!("{learnt:?}: {}", found.told());
            assert_not_healthy(found, [within_s + STARTING_S, 0.0], watched_s);
        }
        let wrong = wrong(&found, within_s + STARTING_S);
        assert!(wrong.is_empty(), "{learnt:?}:\n{}", wrong.join("\n"));
        assert!(found.iter().all(|found| found.is_in_time(learnt)));
    }
}

#[test]
fn a_good_model_finds_a_loss_that_leads_outside_the_range() {
    let rig = RigParameters::draw(610);
    let subject = subject(Learnt::Physical, rig, 610);
    let found = curves(&subject, &[Change::Force(-0.7)], 4.0, 610);
    let wrong = wrong(&found, 1.0 + STARTING_S);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_joint_that_is_well_is_not_taken_for_broken_where_it_leaves_the_range() {
    // Half as far again, and twice, and one axis much further than the other.
    for (learnt, seed) in [(Learnt::Physical, 610), (Learnt::Polynomial, 1)] {
        let subject = subject(learnt, RigParameters::draw(seed), seed);
        for levels in [[1.5, 1.5], [2.0, 2.0], [2.0, 0.3], [0.3, 2.0]] {
            let mut shaking = Shaking::steady(20.0, STUDY_LEVEL, seed);
            shaking.levels = levels.map(|level| [level; 2]);
            let record = subject.shake(shaking, None);
            let seen = subject.watch_axes(&record);
            for (axis, seen) in seen.iter().enumerate() {
                let alarm = seen.iter().find(|(_, v)| v.state == State::Alarm);
                assert!(
                    alarm.is_none(),
                    "{learnt:?}, {levels:?}, {axis}: {}",
                    story(seen)
                );
            }
        }
    }
}
