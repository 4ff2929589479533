//! A new model: taken over the line, tried, and kept or given up.

use super::{events, good, model, newer};
use crate::bench::{Bench, RATE_HZ, Slot, content, reference_rig, sealed_as};
use jointwatch_firmware::sensor::acquire::CHIPS;
use jointwatch_firmware::sensor::presence::ChipState;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::wire::telemetry::{
    Event, ModelFault, Refusal, Report, Request, Signature, UploadReply, UploadRequest,
};

fn upload(bench: &mut Bench, slot: &Slot, signature: Option<Signature>) -> Vec<UploadReply> {
    let content = content(slot);
    let mut steps = vec![UploadRequest::Begin {
        header: slot.header(),
        signature,
    }];
    for (piece, offset) in content.chunks(128).zip((0..).step_by(128)) {
        let data = piece.try_into().expect("at most 128");
        steps.push(UploadRequest::Chunk { offset, data });
    }
    steps.push(UploadRequest::Finish);
    for step in steps {
        bench.ask(&Request::Upload(step));
    }
    let reply = |report| match report {
        Report::Upload(reply) => Some(reply),
        _ => None,
    };
    bench.reports().into_iter().filter_map(reply).collect()
}

#[test]
fn a_new_model_is_taken_over_the_line_tried_after_a_restart_and_kept() {
    let mut bench = Bench::start([good(), Slot::Empty]);
    let new = newer();
    let replies = upload(&mut bench, &new, None);
    assert_eq!(replies[0], UploadReply::Refused(Refusal::Unsigned));
    let replies = upload(&mut bench, &new, new.signature());
    assert!(
        matches!(replies.last(), Some(UploadReply::Activated { .. })),
        "{replies:?}"
    );
    // The host has a second to take the answer.
    for _ in 0..RATE_HZ {
        assert!(!bench.watch.restart_now());
        bench.sample(RawSample::default());
    }
    assert!(bench.watch.restart_now());

    let mut bench = bench.restart();
    let slot = jointwatch_shared::wire::telemetry::Slot::B;
    let mut confirmed_after = None;
    for number in 0..11 * RATE_HZ {
        bench.sample(RawSample::default());
        if events(&bench.reports()).contains(&Event::ModelConfirmed { slot }) {
            confirmed_after = Some(number);
        }
    }
    let after = confirmed_after.expect("the model proves itself");
    assert!((10 * RATE_HZ..11 * RATE_HZ).contains(&after), "{after}");
    // It stays after another restart, without a trial.
    let mut again = bench.restart();
    let reports = again.reports();
    let Report::Hello(hello) = &reports[0] else {
        panic!("{:?}", reports[0])
    };
    assert_eq!(hello.model.as_ref().map(|model| model.slot), Some(slot));
}

#[test]
fn a_model_that_does_not_live_through_its_trial_is_given_up() {
    let mut bench = Bench::start([good(), Slot::Empty]);
    let new = newer();
    upload(&mut bench, &new, new.signature());
    let mut bench = bench.restart().restart();
    bench.sample(RawSample::default());
    let slot = jointwatch_shared::wire::telemetry::Slot::B;
    let reports = bench.reports();
    assert!(events(&reports).contains(&Event::ModelGivenUp { slot }));
    assert!(bench.evaluates(), "the old model runs");
    // It was set aside for good: the next restart has nothing to give up, and says so after its
    // first sample.
    let mut bench = bench.restart();
    bench.sample(RawSample::default());
    let again = events(&bench.reports());
    assert!(
        !again
            .iter()
            .any(|event| matches!(event, Event::ModelGivenUp { .. })),
        "{again:?}"
    );
}

#[test]
fn a_rig_block_that_cannot_go_with_its_model_is_refused_before_it_is_sealed() {
    let rig = |of: &Model| {
        jointwatch_shared::wire::rig_block::encode(&reference_rig(of, None)).expect("a sound block")
    };
    let mut damaged = rig(reference_network());
    damaged[100] ^= 1;
    let mut bench = Bench::start([good(), Slot::Empty]);
    for (block, why) in [
        (&rig(model())[..], Refusal::Mismatch),
        (&damaged, Refusal::Rig(ModelFault::Checksum)),
        (&[0x11; 256], Refusal::Rig(ModelFault::Length)),
        (&[0x11; 4096], Refusal::Rig(ModelFault::Magic)),
    ] {
        let bad = sealed_as(2, reference_network(), block);
        let replies = upload(&mut bench, &bad, bad.signature());
        assert_eq!(replies.last(), Some(&UploadReply::Refused(why)));
    }
    let mut bench = bench.restart();
    assert!(bench.evaluates(), "the old model runs");
    let fine = newer();
    let replies = upload(&mut bench, &fine, fine.signature());
    assert!(matches!(
        replies.last(),
        Some(UploadReply::Activated { .. })
    ));
}

/// Samples like this one until the device wants to restart; `None` when it does not within so many.
fn restarts_after(bench: &mut Bench, health: [ChipState; CHIPS], samples: u64) -> Option<u64> {
    (1..samples).find(|_| {
        bench.sample_with(health);
        bench.watch.restart_now()
    })
}

#[test]
fn a_trial_that_cannot_succeed_ends_by_itself_and_lets_the_next_upload_in() {
    let mismatched = {
        let of_another = reference_rig(model(), None);
        let block = jointwatch_shared::wire::rig_block::encode(&of_another).unwrap();
        sealed_as(2, reference_network(), &block)
    };
    let mut two_dead = [ChipState::Ok; CHIPS];
    (two_dead[2], two_dead[4]) = (ChipState::Bus, ChipState::TimedOut);
    let fine = newer();
    // A second, at the rate of a device that has no rig block to use.
    let at_once = 1000..=1000;
    for (new, health, within) in [
        (&mismatched, [ChipState::Ok; CHIPS], at_once),
        (&fine, two_dead, 60 * RATE_HZ..=62 * RATE_HZ),
    ] {
        let mut bench = Bench::start([good(), new.clone()]);
        let busy = upload(&mut bench, &fine, fine.signature());
        assert_eq!(busy[0], UploadReply::Refused(Refusal::Busy));
        let after =
            restarts_after(&mut bench, health, 70 * RATE_HZ).expect("it goes back by itself");
        assert!(within.contains(&after), "{after}");
        let mut bench = bench.restart();
        assert!(bench.evaluates(), "the old model runs");
        let replies = upload(&mut bench, &fine, fine.signature());
        assert!(matches!(
            replies.last(),
            Some(UploadReply::Activated { .. })
        ));
    }
}

#[test]
fn one_dead_chip_does_not_hold_a_trial_up_and_without_another_model_none_restarts() {
    let mut one_dead = [ChipState::Ok; CHIPS];
    one_dead[2] = ChipState::Bus;
    let mut bench = Bench::start([good(), newer()]);
    assert_eq!(restarts_after(&mut bench, one_dead, 70 * RATE_HZ), None);
    let slot = jointwatch_shared::wire::telemetry::Slot::B;
    assert!(events(&bench.reports()).contains(&Event::ModelConfirmed { slot }));

    let mut bench = Bench::start([newer(), Slot::Empty]);
    assert_eq!(
        restarts_after(&mut bench, [ChipState::Bus; CHIPS], 70 * RATE_HZ),
        None
    );
}

#[test]
fn a_model_without_a_rig_block_proves_itself_by_raw_counts() {
    let mut bench = Bench::start([good(), sealed_as(2, reference_network(), &[])]);
    assert_eq!(
        restarts_after(&mut bench, [ChipState::Ok; CHIPS], 70_000),
        None
    );
    let slot = jointwatch_shared::wire::telemetry::Slot::B;
    assert!(events(&bench.reports()).contains(&Event::ModelConfirmed { slot }));
}
