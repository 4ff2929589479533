//! Alarms are kept through restarts and uploads until the owner acknowledges them.

use super::{answer, hello, ordered, proven, release, run, uploaded};
use crate::bench::{Bench, RATE_HZ};
use crate::signing;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::State;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::wire::slot::Order;
use jointwatch_shared::wire::telemetry::{
    Alarm, Answered, KeptAlarm, Report, Request, Status, Upkeep,
};

fn alarms(bench: &mut Bench) -> (Vec<Alarm>, Vec<Status>) {
    let (mut alarms, mut statuses) = (Vec::new(), Vec::new());
    for report in bench.reports() {
        match report {
            Report::Alarm(alarm) => alarms.push(alarm),
            Report::Status(status) => statuses.push(status),
            _ => {}
        }
    }
    (alarms, statuses)
}

/// Counts of both axes that move so far, and these of their force channels.
fn moving(at: i32, far: i32, force: i32) -> RawSample {
    let mut raw = RawSample::default();
    for (number, axis) in raw.iter_mut().enumerate() {
        let swing = ((at * (3 + number as i32)) % 64 - 32).abs() * far;
        axis.displacement = [swing, -swing];
        (axis.body, axis.acceleration) = (swing / 2, swing / 3);
        axis.force = 20 * force;
    }
    raw
}

/// A force that stands still while its axis moves, until that raises an alarm; after how many
/// samples it does.
pub(super) fn until_alarm(bench: &mut Bench) -> u64 {
    let mut at = 0;
    while bench.watch.verdict().state != State::Alarm {
        at += 1;
        bench.sample(moving(at, 4096, 5));
        assert!(at < 20_000, "{:?}", bench.watch.verdict());
    }
    at as u64
}

/// What the last status said that outlasts a loss of power.
pub(super) fn upkeep(bench: &mut Bench) -> Upkeep {
    bench.reports();
    run(bench, 1);
    let find = |report: &Report| match report {
        Report::Upkeep(upkeep) => Some(*upkeep),
        _ => None,
    };
    bench.reports().iter().rev().find_map(find).expect("one")
}

#[test]
fn an_alarm_outlasts_restarts_and_an_upload_until_it_is_acknowledged() {
    let mut bench = proven();
    assert_eq!(upkeep(&mut bench).alarm, None);
    until_alarm(&mut bench);
    run(&mut bench, 1);
    let first = alarms(&mut bench).0.pop().expect("an alarm");
    let kept = KeptAlarm {
        sample: first.sample,
        verdict: first.verdict,
    };
    // It is of this run as long as that lasts.
    assert_eq!(upkeep(&mut bench).alarm, None);
    let mut bench = bench.restart().restart();
    assert_eq!(upkeep(&mut bench).alarm, Some(kept));
    assert!(alarms(&mut bench).0.is_empty());
    // Another one is told beside it, and does not take its place.
    until_alarm(&mut bench);
    run(&mut bench, 1);
    assert!(!alarms(&mut bench).0.is_empty());
    let number = hello(&mut bench).access.number;
    assert_eq!(upkeep(&mut bench).alarm, Some(kept));
    assert_eq!(
        hello(&mut bench).access.number,
        number,
        "nothing is written"
    );
    // Nor does the upload that erases the slot whose journal holds it.
    let mut bench = bench.restart();
    let second = release(2, reference_network());
    uploaded(&mut bench, &second);
    let mut bench = bench.restart();
    assert_eq!(upkeep(&mut bench).alarm, Some(kept));
    let number = hello(&mut bench).access.number;
    let wrong = signing::order(7, Order::Acknowledge, number);
    assert_eq!(answer(&mut bench, &wrong), Answered::NotSigned);
    let right = signing::order(0, Order::Acknowledge, number);
    assert_eq!(answer(&mut bench, &right), Answered::Done);
    assert_eq!(upkeep(&mut bench).alarm, None);
    let mut bench = bench.restart();
    assert_eq!(upkeep(&mut bench).alarm, None);
    let nothing = signing::order(0, Order::Acknowledge, number + 1);
    assert_eq!(answer(&mut bench, &nothing), Answered::Nothing);
}

#[test]
fn an_alarm_costs_one_place_of_the_journal_however_often_it_comes_back() {
    let mut bench = proven();
    let number = hello(&mut bench).access.number;
    for _ in 0..3 {
        until_alarm(&mut bench);
        // The channel moves again, so that the next alarm is another one.
        for at in 0..60 * RATE_HZ as i32 {
            bench.sample(moving(at, 4, at % 7));
        }
        let verdict = bench.watch.verdict();
        assert_ne!(verdict.state, State::Alarm, "{verdict:?}");
    }
    assert!(alarms(&mut bench).0.last().expect("an alarm").alarms >= 3);
    assert_eq!(hello(&mut bench).access.number, number + 1);
}

#[test]
fn an_alarm_that_cannot_be_written_is_written_an_hour_later() {
    let mut bench = proven().restart_after(|flash| flash.is_low = true);
    let supply = upkeep(&mut bench).supply;
    assert_eq!((supply.reset_below_mv, supply.is_low), (Some(2500), true));
    let number = hello(&mut bench).access.number;
    until_alarm(&mut bench);
    run(&mut bench, 10);
    assert_eq!(hello(&mut bench).access.number, number);
    bench.flash(|flash| flash.is_low = false);
    assert!(!upkeep(&mut bench).supply.is_low);
    run(&mut bench, 3000);
    assert_eq!(hello(&mut bench).access.number, number);
    run(&mut bench, 600);
    assert_eq!(hello(&mut bench).access.number, number + 1);
    assert!(upkeep(&mut bench.restart()).alarm.is_some());
}

#[test]
fn an_alarm_stands_until_its_owner_acknowledges_it() {
    let mut bench = proven();
    let number = hello(&mut bench).access.number;
    let nothing = ordered(&mut bench, Order::Acknowledge);
    assert_eq!(nothing, Answered::Nothing);
    let at = until_alarm(&mut bench);
    let raised = hello(&mut bench);
    assert!(raised.access.development_key);
    // What is kept of it has taken the number.
    assert_eq!(raised.access.number, number + 1);
    let acknowledge = signing::order(0, Order::Acknowledge, number + 1);
    run(&mut bench, 5);
    let (told, statuses) = alarms(&mut bench);
    assert!(!told.is_empty() && told.len() == statuses.len());
    assert!(statuses.iter().all(|status| status.development_key));
    let first = told[0];
    assert_eq!((first.verdict.state, first.alarms), (3, 1));
    assert_eq!(first.sample, 11 * RATE_HZ + at);
    for request in [
        Request::ResetStatistics,
        signing::order(7, Order::Acknowledge, number + 1),
    ] {
        assert_ne!(answer(&mut bench, &request), Answered::Done);
    }
    run(&mut bench, 1);
    assert_eq!(
        alarms(&mut bench).0.last().map(|alarm| alarm.sample),
        Some(first.sample)
    );
    assert_eq!(answer(&mut bench, &acknowledge), Answered::Done);
    run(&mut bench, 1);
    assert!(alarms(&mut bench).0.is_empty());
}
