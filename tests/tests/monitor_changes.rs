//! Gross changes of the joint on a simulated rig: found in the documented time, on the right axis, with the right direction.
//!
//! `monitor_campaign --curves` is the long version; `shared/tests/monitor_changes.rs` has the monitor alone.

use jointwatch::simulate::RigParameters;
use jointwatch_tests::monitor::curves::{Change, Found, curves};
use jointwatch_tests::monitor::false_alarms::WANTED_HOURS;
use jointwatch_tests::monitor::watched::{Learnt, Subject};

fn subject(learnt: Learnt, seed: u64) -> Subject {
    let subject = Subject::new(learnt, RigParameters::default(), seed, WANTED_HOURS);
    subject.unwrap_or_else(|why| panic!("{learnt:?}, seed {seed}: {why}"))
}

/// Every change of a kind on one rig, the wrong ones as sentences; those not found within `within_s` of motion among them.
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
fn a_joint_whose_force_is_gone_or_doubled_at_the_same_motion_is_found_soon() {
    // A plain polynomial, wrong by a fifth of the force itself, takes longer to be sure.
    for (learnt, within_s) in [(Learnt::Physical, 1.0), (Learnt::Polynomial, 3.0)] {
        let subject = subject(learnt, 1);
        let changes = [Change::SameMotion(-1.0), Change::SameMotion(1.0)];
        let found = curves(&subject, &changes, 14.0, 1);
        for found in &found {
            println!("{learnt:?}: {}", found.told());
            assert_not_healthy(found, [within_s, 0.0], 14.0);
        }
        let wrong = wrong(&found, within_s + STARTING_S);
        assert!(wrong.is_empty(), "{learnt:?}:\n{}", wrong.join("\n"));
    }
}

/// An axis that changed may be called healthy for so long, s: where it was well before, and where it was not.
fn assert_not_healthy(found: &Found, most: [f64; 2], watched_s: f64) {
    let healthy = found.healthy_after(0.0, watched_s);
    let most = most[usize::from(found.before_power_on)];
    assert!(healthy <= most, "healthy for {healthy} s: {}", found.told());
}

#[test]
fn a_loss_of_a_third_of_the_force_and_more_and_a_seizure_are_found_in_the_documented_time() {
    let losses = [-0.9, -0.7, -0.5, -0.3].map(Change::SameMotion);
    let changes = [&losses[..], &[Change::Seized]].concat();
    let watched_s = 14.0;
    // A third of the force is little beside a plain polynomial's own error.
    for (learnt, within_s) in [(Learnt::Physical, 2.0), (Learnt::Polynomial, 6.0)] {
        let subject = subject(learnt, 1);
        let found = curves(&subject, &changes, watched_s, 2);
        for found in &found {
            println!("{learnt:?}: {}", found.told());
            assert_not_healthy(found, [within_s + STARTING_S, 0.0], watched_s);
        }
        let wrong = wrong(&found, within_s + STARTING_S);
        assert!(wrong.is_empty(), "{learnt:?}:\n{}", wrong.join("\n"));
    }
}
