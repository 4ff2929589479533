//! The device without a board: what it says of good and bad slots, of lost samples, silent chips
//! and damaged requests, and that what it streams is what the chain computes.

mod alarm;
mod trial;

use crate::bench::{Bench, RATE_HZ, Slot, content, reference_rig, sealed, sealed_as, signed};
use heapless::spsc::Queue;
use jointwatch_firmware::app::{Evaluated, Frame, Lost, evaluate};
use jointwatch_firmware::sensor::acquire::CHIPS;
use jointwatch_firmware::sensor::presence::ChipState;
use jointwatch_shared::base::Model;
use jointwatch_shared::base::kernels::Portable;
use jointwatch_shared::chain::{Chain, ChainState, RawSample};
use jointwatch_shared::monitor::{Cause, State};
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{Points, reference_model};
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::telemetry::{
    Answered, Event, ModelFault, Occasion, Report, Request, Restart, SampleOutput, Status,
};

fn model() -> &'static Model {
    reference_model()
}

fn good() -> Slot {
    signed(model(), Some(&reference_rig(model(), None)))
}

/// Another model for the same rig, which is newer.
fn newer() -> Slot {
    let rig = reference_rig(reference_network(), None);
    let rig = jointwatch_shared::wire::rig_block::encode(&rig).expect("a sound block");
    sealed_as(2, reference_network(), &rig)
}

fn events(reports: &[Report]) -> Vec<Event> {
    let event = |report: &Report| match report {
        Report::Event(event) => Some(*event),
        _ => None,
    };
    reports.iter().filter_map(event).collect()
}

fn last_status(reports: &[Report]) -> Status {
    let status = |report: &Report| match report {
        Report::Status(status) => Some(status.clone()),
        _ => None,
    };
    reports.iter().rev().find_map(status).expect("a status")
}

fn motion(samples: usize) -> Vec<RawSample> {
    let mut points = Points::new(11);
    let mut drift = [0_i32; 10];
    let mut next = || {
        for place in &mut drift {
            *place = (*place - (*place >> 5)).wrapping_add(points.next_word() >> 22);
        }
        let mut sample = RawSample::default();
        for (axis, [far, near, body, acceleration, force]) in sample
            .iter_mut()
            .zip(*drift.as_chunks::<5>().0.first_chunk::<2>().unwrap())
        {
            axis.displacement = [far, near];
            (axis.body, axis.acceleration, axis.force) = (body, acceleration, force);
        }
        sample
    };
    (0..samples).map(|_| next()).collect()
}

#[test]
fn an_empty_device_says_that_it_has_no_model_and_streams_raw_counts() {
    let mut bench = Bench::start([Slot::Empty, Slot::Empty]);
    bench.ask(&Request::Stream { every: 1 });
    let samples = motion(30);
    samples.iter().for_each(|raw| bench.sample(*raw));
    let reports = bench.reports();
    let Report::Hello(hello) = &reports[0] else {
        panic!("{:?}", reports[0])
    };
    assert_eq!(hello.occasion, Occasion::Restart);
    assert_eq!((&hello.model, &hello.rig), (&None, &None));
    let said = events(&reports);
    assert_eq!(
        said[..2],
        [Event::Started { why: Restart::Pin }, Event::NoModel]
    );
    let streamed: Vec<_> = reports
        .iter()
        .filter_map(|report| match report {
            Report::Sample(sample) => Some(sample),
            _ => None,
        })
        .collect();
    assert_eq!(streamed.len(), samples.len());
    for ((number, sample), raw) in (0..).zip(&streamed).zip(&samples) {
        assert_eq!((sample.sample, &sample.output), (number, &None));
        assert_eq!(sample.counts[1][4], raw[1].force);
    }
    let verdict = last_status(&reports).verdict;
    assert_eq!((verdict.state, verdict.cause), (0, Cause::NoModel.tag()));
}

#[test]
fn what_is_streamed_is_what_the_chain_computes() {
    let mut bench = Bench::start([good(), Slot::Empty]);
    bench.ask(&Request::Stream { every: 1 });
    let rig = reference_rig(model(), None);
    let chain = Chain::new(model(), &rig).expect("a rig that fits");
    let mut state = ChainState::default();
    let mut outputs = 0;
    for (row, raw) in motion(400).into_iter().enumerate() {
        // Behind a gap mains hum is not followed, until the filters are free of it.
        bench.sample_after(if row == 200 { 3 } else { 0 }, raw);
        if row == 200 {
            state.hold_notches(chain.invalidated_by_fault());
        }
        let wanted = chain.step(&mut state, model(), &raw);
        let Some(Report::Sample(seen)) = bench
            .reports()
            .into_iter()
            .find(|report| matches!(report, Report::Sample(_)))
        else {
            panic!("no sample")
        };
        assert_eq!(seen.output, wanted.as_ref().map(SampleOutput::from));
        outputs += u32::from(wanted.is_some());
    }
    assert!(outputs > 300);
    assert_eq!(bench.watch.counters().frames_dropped, 0);
}

#[test]
fn every_bad_slot_has_its_event_and_the_other_one_steps_in() {
    let mut damaged = content(&good());
    damaged[700] ^= 2;
    let unsigned = Slot::Bytes(blob::encode(model()).to_vec());
    let slot = jointwatch_shared::wire::telemetry::Slot::A;
    for (bad, event) in [
        (
            Slot::Bytes(damaged),
            Event::ModelRefused {
                slot,
                fault: ModelFault::Checksum,
            },
        ),
        (unsigned, Event::ModelUnsigned { slot }),
        (
            Slot::Bytes(vec![0x23; BLOB_LEN]),
            Event::ModelRefused {
                slot,
                fault: ModelFault::Magic,
            },
        ),
    ] {
        for (other, runs) in [(Slot::Empty, false), (good(), true)] {
            let mut bench = Bench::start([bad.clone(), other]);
            bench.sample(RawSample::default());
            let reports = bench.reports();
            let said = events(&reports);
            assert!(said.contains(&event), "{event:?} in {said:?}");
            assert_eq!(said.contains(&Event::NoModel), !runs);
            assert_eq!(bench.evaluates(), runs);
        }
    }
}

#[test]
fn a_rig_block_that_is_missing_damaged_or_for_another_model_leaves_raw_counts() {
    let mut of_another = reference_rig(model(), None);
    of_another.model_checksum ^= 1;
    let mut damaged =
        jointwatch_shared::wire::rig_block::encode(&reference_rig(model(), None)).unwrap();
    damaged[100] ^= 1;
    for (slot, event) in [
        (signed(model(), None), Event::NoRig),
        (signed(model(), Some(&of_another)), Event::Mismatch),
        (
            sealed(model(), &damaged),
            Event::RigRefused {
                fault: ModelFault::Checksum,
            },
        ),
    ] {
        let mut bench = Bench::start([slot, Slot::Empty]);
        bench.sample(RawSample::default());
        let reports = bench.reports();
        assert!(events(&reports).contains(&event), "{event:?}");
        assert!(!bench.evaluates());
        assert_eq!(last_status(&reports).verdict.cause, Cause::NoRig.tag());
    }
}

#[test]
fn a_sample_rate_that_the_device_cannot_keep_is_refused() {
    let mut rig = reference_rig(model(), None);
    rig.sample_rate_hz = 20_000.0;
    let bytes = jointwatch_shared::wire::rig_block::encode(&rig).expect("a sound block");
    let mut bench = Bench::start([sealed(model(), &bytes), Slot::Empty]);
    assert!(!bench.evaluates());
    bench.sample(RawSample::default());
    let fault = ModelFault::OutOfRange;
    assert!(events(&bench.reports()).contains(&Event::RigRefused { fault }));
}

#[test]
fn what_finds_no_room_behind_the_evaluation_is_counted_with_the_next_that_does() {
    let mut frames: Queue<Frame, 8> = Queue::new();
    let mut evaluated: Queue<Evaluated, 4> = Queue::new();
    let (mut frames_in, mut frames) = frames.split();
    let (mut evaluated_in, mut evaluated) = evaluated.split();
    let mut unseen = Lost::default();
    let mut turn = |samples: u32| {
        for _ in 0..samples {
            let frame = Frame {
                missed: 1,
                ..Frame::default()
            };
            frames_in.enqueue(frame).expect("room");
        }
        evaluate::<Portable>(None, &mut frames, &mut evaluated_in, &mut unseen);
        let mut lost = Vec::new();
        while let Some(evaluated) = evaluated.dequeue() {
            lost.push((evaluated.frame.missed, evaluated.frame.overruns));
        }
        lost
    };
    assert_eq!(turn(5), [(1, 0); 3]);
    assert_eq!(turn(1), [(3, 2)]);
    assert_eq!(turn(1), [(1, 0)]);
}

#[test]
fn limits_of_another_model_are_not_used() {
    let of = |checksum| signed(model(), Some(&reference_rig(model(), Some(checksum))));
    let own = blob::checksum_of(model());
    for (checksum, cause) in [(own, Cause::Starting), (own ^ 1, Cause::OtherModel)] {
        let mut bench = Bench::start([of(checksum), Slot::Empty]);
        bench.sample(RawSample::default());
        let verdict = last_status(&bench.reports()).verdict;
        assert_eq!((verdict.state, verdict.cause), (0, cause.tag()));
    }
}

#[test]
fn missed_instants_and_full_queues_are_counted_and_spoil_what_follows() {
    let mut bench = Bench::start([good(), Slot::Empty]);
    bench.sample_after(3, RawSample::default());
    // Seven come while nobody evaluates: three fit.
    for _ in 0..7 {
        bench.acquire();
    }
    bench.work();
    bench.acquire();
    bench.work();
    let counters = bench.watch.counters();
    assert_eq!((counters.missed_deadlines, counters.queue_overruns), (3, 4));
    bench.reports();
    bench.ask(&Request::ResetStatistics);
    assert_eq!(bench.watch.counters().missed_deadlines, 0);
}

#[test]
fn samples_that_are_lost_are_told_of_every_channel_that_missed_them() {
    let with_limits = reference_rig(model(), Some(blob::checksum_of(model())));
    let mut bench = Bench::start([signed(model(), Some(&with_limits)), Slot::Empty]);
    for _ in 0..20 * RATE_HZ {
        bench.sample_after(1, RawSample::default());
    }
    let verdict = bench.watch.verdict();
    assert_eq!(
        (verdict.state, verdict.cause),
        (State::Alarm, Cause::Missing)
    );
    let status = last_status(&bench.reports());
    let wired = status.channels.iter().filter(|channel| channel.fault != 0);
    assert!(wired.clone().count() >= 4);
    assert!(
        wired
            .into_iter()
            .all(|channel| channel.fault == Cause::Missing.tag())
    );
}

#[test]
fn a_silent_chip_is_told_once_and_told_when_it_comes_back() {
    let mut bench = Bench::start([good(), Slot::Empty]);
    let mut with = |health, times| {
        let mut all = [ChipState::Ok; CHIPS];
        all[2] = health;
        for _ in 0..times {
            bench.sample_with(all);
        }
        events(&bench.reports())
    };
    let of_sensors = |events: Vec<Event>| -> Vec<Event> {
        let of_a_sensor = |event: &Event| {
            matches!(
                event,
                Event::SensorMissing { .. } | Event::SensorBack { .. }
            )
        };
        events.into_iter().filter(of_a_sensor).collect()
    };
    assert_eq!(of_sensors(with(ChipState::Ok, 1)), []);
    assert_eq!(of_sensors(with(ChipState::Crc, 63)), []);
    assert_eq!(
        of_sensors(with(ChipState::Identity, 200)),
        [Event::SensorMissing { channel: 6 }]
    );
    assert_eq!(
        of_sensors(with(ChipState::Ok, 9)),
        [Event::SensorBack { channel: 6 }]
    );
    for _ in 0..RATE_HZ {
        bench.sample(RawSample::default());
    }
    let status = last_status(&bench.reports());
    let channel = status.channels[6];
    assert_eq!((channel.crc_errors, channel.bus_errors), (63, 200));
    assert_eq!(status.channels[0].bus_errors, 0);
}

#[test]
fn noise_on_the_line_is_counted_and_requests_after_it_are_answered() {
    let mut bench = Bench::start([Slot::Empty, Slot::Empty]);
    bench.reports();
    for byte in [0x55, 0, 7, 7, 7, 0] {
        bench.receive(byte);
    }
    assert_eq!(bench.watch.counters().link_errors, 2);
    let answer = |bench: &mut Bench, request| {
        bench.ask(&request);
        bench.reports().into_iter().find_map(|report| match report {
            Report::Answer(answer) => Some(answer.answered),
            _ => None,
        })
    };
    assert_eq!(answer(&mut bench, Request::Ping), Some(Answered::Done));
    let snapshot = answer(&mut bench, Request::Snapshot);
    assert_eq!(snapshot, Some(Answered::Nothing));
    bench.ask(&Request::Hello);
    let asked = bench.reports();
    assert!(matches!(&asked[0], Report::Hello(hello) if hello.occasion == Occasion::Asked));
}

#[test]
fn a_line_that_never_pauses_does_not_hold_the_device_up() {
    let mut bench = Bench::start([Slot::Empty, Slot::Empty]);
    assert!((253..1000).contains(&bench.flood()));
}

#[test]
fn a_slow_line_refuses_a_stream_that_it_cannot_carry() {
    let mut bench = Bench::start([Slot::Empty, Slot::Empty]);
    // 1 kHz without a rig block: a sample takes 118 bytes at most, the line carries 100,000 a
    // second.
    for (every, wanted) in [
        (1, Answered::LineTooSlow),
        (2, Answered::Done),
        (0, Answered::Done),
    ] {
        let request = Request::Stream { every };
        assert_eq!(bench.watch.ask(&request, Some(1_000_000)), Some(wanted));
    }
    let request = Request::Stream { every: 1 };
    assert_eq!(bench.watch.ask(&request, None), Some(Answered::Done));
    bench.sample(RawSample::default());
}
