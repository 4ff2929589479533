//! What an alarm brings: the residual and the counts from before and after it.

use super::{model, motion};
use crate::bench::{Bench, RATE_HZ, Slot, reference_rig, signed};
use jointwatch_firmware::sensor::acquire::CHIPS;
use jointwatch_firmware::sensor::presence::ChipState;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::State;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::capture::{CHUNK, unpack};
use jointwatch_shared::wire::telemetry::{Answered, Event, Report, Request, Snapshot};

#[test]
fn an_alarm_is_not_taken_back_by_whoever_is_on_the_line() {
    let with_limits = reference_rig(model(), Some(blob::checksum_of(model())));
    let mut bench = Bench::start([signed(model(), Some(&with_limits)), Slot::Empty]);
    bench.sample_after(3, RawSample::default());
    let missed = bench.watch.counters().missed_deadlines;
    assert!(missed > 0);
    let state = |bench: &Bench| bench.watch.verdict().state;
    // A chip that never answers: the sensors' alarm, after some blocks.
    let mut silent = [ChipState::Ok; CHIPS];
    silent[2] = ChipState::Bus;
    let mut samples = 0;
    while state(&bench) < State::Suspect {
        bench.sample_with(silent);
        samples += 1;
        assert!(samples < 20_000, "{:?}", bench.watch.verdict());
    }
    bench.reports();
    bench.ask(&Request::ResetStatistics);
    assert!(state(&bench) >= State::Suspect);
    assert_eq!(bench.watch.counters().missed_deadlines, missed);
}

#[test]
fn an_alarm_brings_the_residual_from_before_and_after_it() {
    let own = blob::checksum_of(model());
    let slot = signed(model(), Some(&reference_rig(model(), Some(own))));
    let mut bench = Bench::start([slot, Slot::Empty]);
    bench.ask(&Request::Stream { every: 1 });
    let mut residuals = Vec::new();
    let mut alarm_at = None;
    let mut pieces: Vec<Snapshot> = Vec::new();
    // A counter that stands still while its axis moves: an alarm without a doubt.
    for (number, mut raw) in motion(40 * RATE_HZ as usize).into_iter().enumerate() {
        if number > 300 {
            raw[0].force = 5;
        }
        bench.sample(raw);
        for report in bench.reports() {
            match report {
                Report::Sample(sample) => {
                    residuals.push(sample.output.map(|output| output.residual))
                }
                Report::Event(Event::Verdict(verdict)) if verdict.state == 3 => {
                    alarm_at.get_or_insert(number);
                }
                Report::Snapshot(piece) => pieces.push(piece),
                _ => {}
            }
        }
        if !pieces.is_empty() {
            break;
        }
    }
    let alarm_at = alarm_at.expect("an alarm");
    assert_eq!(pieces.len(), 4);
    for (number, piece) in (0..).zip(&pieces) {
        assert_eq!((piece.alarm, piece.piece, piece.pieces), (1, number, 4));
        for (residual, offset) in piece.residual.iter().zip(0..) {
            let sample = alarm_at as i32 + piece.first + offset * i32::from(piece.every);
            assert_eq!(
                residuals[sample as usize],
                Some(*residual),
                "sample {sample}"
            );
        }
    }
    let (first, last) = (&pieces[0], &pieces[3]);
    assert!(first.first < 0);
    assert!(last.first + 15 * i32::from(last.every) > 0);
    bench.ask(&Request::Snapshot);
    let again = bench.reports();
    assert_eq!(
        again
            .iter()
            .filter(|r| matches!(r, Report::Snapshot(_)))
            .count(),
        4
    );
}

#[test]
fn the_counts_around_an_alarm_are_sent_on_request_until_it_is_acknowledged() {
    let own = blob::checksum_of(model());
    let slot = signed(model(), Some(&reference_rig(model(), Some(own))));
    let mut bench = Bench::start([slot, Slot::Empty]);
    let answered = |bench: &mut Bench| {
        bench.ask(&Request::Capture { piece: 0 });
        let answer = |report: Report| match report {
            Report::Answer(answer) => Some(answer.answered),
            _ => None,
        };
        bench.reports().into_iter().find_map(answer)
    };
    assert_eq!(answered(&mut bench), Some(Answered::Nothing));
    bench
        .watch
        .keep_counts(Box::leak(vec![[0; CHUNK]; 8].into_boxed_slice()));
    let mut fed = Vec::new();
    let mut alarm_at = None;
    for (number, mut raw) in (0_u64..).zip(motion(40 * RATE_HZ as usize)) {
        if number > 300 {
            raw[0].force = 5;
        }
        bench.sample(raw);
        fed.push(raw);
        let alarmed = bench.watch.verdict().state == State::Alarm;
        if alarmed && alarm_at.is_none() {
            alarm_at = Some(number + 1);
            assert_eq!(answered(&mut bench), Some(Answered::Busy));
        }
        bench.reports();
        if alarm_at.is_some_and(|at| number > at + 2000) {
            break;
        }
    }
    let alarm_at = alarm_at.expect("an alarm");
    let mut bytes = Vec::new();
    let pieces = bench.watch.counts(0).expect("a piece").pieces;
    for number in 0..pieces {
        bench.ask(&Request::Capture { piece: number });
        let reports = bench.reports();
        let [Report::Capture(piece)] = &reports[..] else {
            panic!("{reports:?}")
        };
        assert_eq!(
            (piece.alarm, piece.piece, piece.pieces),
            (alarm_at, number, pieces)
        );
        bytes.extend_from_slice(&piece.bytes);
    }
    let mut numbers = Vec::new();
    for chunk in bytes.chunks(CHUNK) {
        let mut samples = Vec::new();
        let contents = unpack(chunk, |counts| samples.push(*counts)).expect("a chunk");
        for (number, found) in (contents.first..).zip(samples) {
            let wanted = fed[number as usize].map(|raw| raw.counts());
            assert_eq!(found, wanted, "sample {number}");
            numbers.push(number);
        }
    }
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1));
    assert!(numbers[0] < alarm_at && numbers[numbers.len() - 1] > alarm_at);
    bench.watch.acknowledged();
    assert_eq!(answered(&mut bench), Some(Answered::Nothing));
}
