//! What only the device's owner may do: nothing is erased, restarted, taken back or acknowledged
//! without a signature, and no signature works twice.

mod alarms;
mod hostile;
mod spoilt_flash;

use crate::bench::{Bench, RATE_HZ, Slot, content, reference_rig, sealed_as};
use crate::signing;
use jointwatch_firmware::store::ERASURES_PER_HOUR;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::reference_model;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{Header, Order, RIG_OFFSET};
use jointwatch_shared::wire::telemetry::{
    Answered, Event, Hello, ModelFault, Refusal, Report, Request, Signature, Slot as Place,
    UploadReply, UploadRequest,
};
use jointwatch_shared::wire::{blob, rig_block};

/// A model with its rig block, as the n-th release.
fn release(number: u32, model: &Model) -> Slot {
    let rig = reference_rig(model, Some(blob::checksum_of(model)));
    sealed_as(number, model, &rig_block::encode(&rig).unwrap())
}

/// A device that finds release 1 in its flash with its bytes changed so.
fn found(change: impl FnOnce(&mut [u8])) -> Bench {
    let mut slot = release(1, reference_model());
    let Slot::Bytes(bytes) = &mut slot else {
        panic!("it has bytes")
    };
    change(bytes);
    Bench::start([slot, Slot::Empty])
}

/// A device that runs release 1, which has proven itself.
fn proven() -> Bench {
    let mut bench = Bench::start([release(1, reference_model()), Slot::Empty]);
    run(&mut bench, 11);
    bench
}

fn run(bench: &mut Bench, seconds: u64) {
    for _ in 0..seconds * RATE_HZ {
        bench.sample(RawSample::default());
    }
}

fn answer(bench: &mut Bench, request: &Request) -> Answered {
    bench.reports();
    bench.ask(request);
    let find = |report| match report {
        Report::Answer(answer) => Some(answer.answered),
        _ => None,
    };
    bench
        .reports()
        .into_iter()
        .find_map(find)
        .expect("an answer")
}

fn hello(bench: &mut Bench) -> Hello {
    bench.reports();
    bench.ask(&Request::Hello);
    let find = |report| match report {
        Report::Hello(hello) => Some(hello),
        _ => None,
    };
    bench.reports().into_iter().find_map(find).expect("a hello")
}

fn step(bench: &mut Bench, step: UploadRequest) -> UploadReply {
    bench.reports();
    bench.ask(&Request::Upload(step));
    let find = |report| match report {
        Report::Upload(reply) => Some(reply),
        _ => None,
    };
    bench.reports().into_iter().find_map(find).expect("a reply")
}

fn begin(bench: &mut Bench, header: Header, signature: Signature) -> UploadReply {
    let signature = Some(signature);
    step(bench, UploadRequest::Begin { header, signature })
}

/// The begin of an upload under its own signature.
fn offer(bench: &mut Bench, slot: &Slot) -> UploadReply {
    begin(bench, slot.header(), slot.signature().unwrap())
}

/// All chunks of a slot after this reply to its begin; the last reply.
fn chunks(bench: &mut Bench, slot: &Slot, mut reply: UploadReply) -> UploadReply {
    for (piece, offset) in content(slot).chunks(128).zip((0..).step_by(128)) {
        assert!(matches!(reply, UploadReply::Accepted { .. }), "{reply:?}");
        let data = piece.try_into().expect("at most 128");
        reply = step(bench, UploadRequest::Chunk { offset, data });
    }
    reply
}

/// A whole upload; its last reply.
fn upload(bench: &mut Bench, slot: &Slot) -> UploadReply {
    let mut reply = offer(bench, slot);
    if let UploadReply::Accepted { .. } = reply {
        reply = chunks(bench, slot, reply);
    }
    match reply {
        UploadReply::Accepted { .. } => step(bench, UploadRequest::Finish),
        refused => refused,
    }
}

/// A whole upload that ends with the new model.
fn uploaded(bench: &mut Bench, slot: &Slot) {
    let reply = upload(bench, slot);
    assert!(matches!(reply, UploadReply::Activated { .. }), "{reply:?}");
}

/// Eight bytes of an upload.
fn chunk(offset: u32) -> UploadRequest {
    let data = heapless::Vec::from_slice(&[0; 8]).unwrap();
    UploadRequest::Chunk { offset, data }
}

/// The answer to an order of the owner.
fn ordered(bench: &mut Bench, order: Order) -> Answered {
    let number = hello(bench).access.number;
    answer(bench, &signing::order(0, order, number))
}

fn refused(why: Refusal) -> UploadReply {
    UploadReply::Refused(why)
}

/// Release 2 beside release 1, both proven, the second one running.
fn two_proven() -> Bench {
    let mut bench = proven();
    let second = release(2, reference_network());
    uploaded(&mut bench, &second);
    let mut bench = bench.restart();
    run(&mut bench, 11);
    let kept = Event::ModelConfirmed { slot: Place::B };
    assert!(bench.reports().contains(&Report::Event(kept)));
    bench
}

#[test]
fn what_nobody_signed_erases_nothing() {
    let before = two_proven().into_flash();
    let mut bench = two_proven();
    let slot = release(3, reference_model());
    let header = slot.header();
    let newer = |release| {
        let mut newer = header;
        newer.release = release;
        newer
    };
    for number in 0..10_001 {
        let request = UploadRequest::Begin {
            header: newer(3 + number),
            signature: None,
        };
        assert_eq!(step(&mut bench, request), refused(Refusal::Unsigned));
    }
    let genuine = slot.signature().unwrap();
    // Someone else's, none at all, and the owner's, for another header.
    for signature in [
        signing::by(7, &header.signed_bytes()),
        Signature::new([0; 64]),
        Signature::new([0xFF; 64]),
        signing::by(0, &newer(4).signed_bytes()),
    ] {
        let reply = begin(&mut bench, header, signature);
        assert_eq!(reply, refused(Refusal::Signature));
    }
    for forged in [
        newer(4),
        Header {
            rig_len: 4092,
            ..header
        },
        Header {
            digest: Bytes::new([1; 32]),
            ..header
        },
        Header {
            class: Bytes::new([0; 16]),
            ..header
        },
    ] {
        let reply = begin(&mut bench, forged, genuine);
        assert_eq!(reply, refused(Refusal::Signature));
    }
    assert_eq!(step(&mut bench, chunk(0)), refused(Refusal::NotBegun));
    assert!(bench.into_flash() == before, "the flash was touched");
}

#[test]
fn what_is_for_another_class_or_not_newer_is_refused_and_erases_nothing() {
    let before = two_proven().into_flash();
    let mut bench = two_proven();
    let header = release(3, reference_model()).header();
    for (header, why) in [
        (
            Header {
                class: Bytes::new(*b"another\0\0\0\0\0\0\0\0\0"),
                ..header
            },
            Refusal::Class,
        ),
        (
            Header {
                release: 2,
                ..header
            },
            Refusal::NotNewer { newest: 2 },
        ),
        (
            Header {
                release: 0,
                ..header
            },
            Refusal::NotNewer { newest: 2 },
        ),
        (
            Header {
                rig_len: 4097,
                ..header
            },
            Refusal::Length {
                seen: 8193,
                most: 8192,
            },
        ),
    ] {
        let signature = signing::signature(&header);
        assert_eq!(begin(&mut bench, header, signature), refused(why));
    }
    assert!(bench.into_flash() == before, "the flash was touched");
}

#[test]
fn erasures_are_counted_over_restarts_and_capped_by_the_hour() {
    let mut bench = two_proven();
    let mut header = release(3, reference_model()).header();
    // One was for the second release.
    for number in 1..u32::from(ERASURES_PER_HOUR) {
        header.release += 1;
        let signature = signing::signature(&header);
        let reply = begin(&mut bench, header, signature);
        assert_eq!(reply, UploadReply::Accepted { next: 0 });
        // The same again erases nothing.
        let reply = begin(&mut bench, header, signature);
        assert_eq!(reply, UploadReply::Accepted { next: 0 });
        assert_eq!(hello(&mut bench).access.erasures, number + 1);
        if number % 7 == 0 {
            bench = bench.restart();
            assert!(bench.evaluates(), "the model goes on");
        }
    }
    for _ in 0..2 {
        header.release += 1;
        let signature = signing::signature(&header);
        let reply = begin(&mut bench, header, signature);
        assert_eq!(reply, refused(Refusal::TooOften));
        bench = bench.restart();
    }
    let all = u32::from(ERASURES_PER_HOUR);
    assert_eq!(hello(&mut bench).access.erasures, all);
    run(&mut bench, 3599);
    let signature = signing::signature(&header);
    let reply = begin(&mut bench, header, signature);
    assert_eq!(reply, refused(Refusal::TooOften));
    run(&mut bench, 2);
    let reply = begin(&mut bench, header, signature);
    assert_eq!(reply, UploadReply::Accepted { next: 0 });
    assert_eq!(hello(&mut bench).access.erasures, all + 1);
}

#[test]
fn an_order_is_carried_out_once_and_only_when_the_owner_signs_it() {
    let mut bench = two_proven();
    let number = hello(&mut bench).access.number;
    let good = signing::order(0, Order::Restart, number);
    for (request, why) in [
        (
            signing::order(7, Order::Restart, number),
            Answered::NotSigned,
        ),
        (
            signing::order(0, Order::Restart, number + 1),
            Answered::Stale,
        ),
    ] {
        assert_eq!(answer(&mut bench, &request), why);
    }
    let Request::Order { signature, .. } = good else {
        panic!("an order is an order")
    };
    let other = Request::Order {
        order: Order::RollBack,
        number,
        signature,
    };
    assert_eq!(answer(&mut bench, &other), Answered::NotSigned);
    run(&mut bench, 3);
    assert!(!bench.watch.restart_now());
    assert_eq!(answer(&mut bench, &good), Answered::Done);
    assert_eq!(answer(&mut bench, &good), Answered::Stale);
    run(&mut bench, 1);
    assert!(bench.watch.restart_now());
    let mut bench = bench.restart();
    assert_eq!(answer(&mut bench, &good), Answered::Stale);
    assert_eq!(hello(&mut bench).access.number, number + 1);
    // The second key is trusted as well.
    let by_second = signing::order(1, Order::Restart, number + 1);
    assert_eq!(answer(&mut bench, &by_second), Answered::Done);
}

#[test]
fn a_model_that_was_taken_back_comes_never_again() {
    let mut bench = two_proven();
    let number = hello(&mut bench).access.number;
    let back = signing::order(0, Order::RollBack, number);
    assert_eq!(answer(&mut bench, &back), Answered::Done);
    // The other slot holds the only model now.
    let third = release(3, reference_network());
    let reply = upload(&mut bench, &third);
    assert_eq!(reply, refused(Refusal::Busy));
    run(&mut bench, 1);
    assert!(bench.watch.restart_now());
    let mut bench = bench.restart();
    let said = hello(&mut bench);
    assert_eq!(said.model.map(|model| model.slot), Some(Place::A));
    assert_eq!(said.access.newest, 2);
    // Nor is there anything further back.
    let back = signing::order(0, Order::RollBack, number + 1);
    assert_eq!(answer(&mut bench, &back), Answered::Nothing);
    let second = release(2, reference_network());
    let reply = upload(&mut bench, &second);
    assert_eq!(reply, refused(Refusal::NotNewer { newest: 2 }));
    // Not even when its slot was erased meanwhile, and the device restarted.
    assert!(matches!(
        offer(&mut bench, &third),
        UploadReply::Accepted { .. }
    ));
    let mut bench = bench.restart();
    let reply = upload(&mut bench, &second);
    assert_eq!(reply, refused(Refusal::NotNewer { newest: 2 }));
    uploaded(&mut bench, &third);
}

#[test]
fn a_revoked_key_opens_nothing_and_the_last_one_cannot_be_revoked() {
    let mut bench = two_proven();
    assert_eq!(hello(&mut bench).access.keys, 0b11);
    let number = hello(&mut bench).access.number;
    // The model that runs is signed by the first key.
    let wrong = signing::order(1, Order::RevokeOther, number);
    assert_eq!(answer(&mut bench, &wrong), Answered::Nothing);
    let right = signing::order(0, Order::RevokeOther, number);
    assert_eq!(answer(&mut bench, &right), Answered::Done);
    let third = release(3, reference_model());
    let by_second = signing::by(1, &third.header().signed_bytes());
    for _ in 0..2 {
        let order = signing::order(1, Order::RevokeOther, number + 1);
        assert_eq!(answer(&mut bench, &order), Answered::NotSigned);
        let reply = begin(&mut bench, third.header(), by_second);
        assert_eq!(reply, refused(Refusal::Signature));
        assert_eq!(hello(&mut bench).access.keys, 0b01);
        bench = bench.restart();
        assert!(bench.evaluates());
    }
    // An erasure does not bring it back.
    assert!(matches!(
        offer(&mut bench, &third),
        UploadReply::Accepted { .. }
    ));
    let mut bench = bench.restart();
    let reply = begin(&mut bench, third.header(), by_second);
    assert_eq!(reply, refused(Refusal::Signature));
}

#[test]
fn content_that_is_not_what_was_signed_neither_runs_nor_is_sealed() {
    // A sound pair, under the signature of another one.
    let mut bench = two_proven();
    let third = release(3, reference_model());
    let mut header = third.header();
    header.digest = Bytes::new([0x5A; 32]);
    let signature = signing::signature(&header);
    let reply = begin(&mut bench, header, signature);
    chunks(&mut bench, &third, reply);
    let reply = step(&mut bench, UploadRequest::Finish);
    assert!(matches!(
        reply,
        UploadReply::Refused(Refusal::Checksum { .. })
    ));
    assert!(bench.restart().evaluates());

    // The same in flash: a rig block without limits where one with limits was signed.
    let other = rig_block::encode(&reference_rig(reference_model(), None)).unwrap();
    let mut bench = found(|bytes| bytes[RIG_OFFSET..][..other.len()].copy_from_slice(&other));
    let said = bench.reports();
    assert!(!bench.evaluates());
    let refused = Event::ModelRefused {
        slot: Place::A,
        fault: ModelFault::Checksum,
    };
    bench.sample(RawSample::default());
    let said = [said, bench.reports()].concat();
    assert!(said.contains(&Report::Event(refused)), "{said:?}");
}

#[test]
fn there_is_no_going_back_to_a_model_that_has_not_run() {
    let mut bench = proven();
    let second = release(2, reference_network());
    uploaded(&mut bench, &second);
    let back = ordered(&mut bench, Order::RollBack);
    assert_eq!(back, Answered::Nothing);
}

#[test]
fn a_chunk_that_does_not_follow_the_one_before_it_or_the_header_is_refused() {
    let mut bench = proven();
    let second = release(2, reference_network());
    let reply = offer(&mut bench, &second);
    assert_eq!(reply, UploadReply::Accepted { next: 0 });
    let length = content(&second).len() as u32;
    for (offset, why) in [
        (16, Refusal::WrongOffset { next: 0 }),
        (length - 8, Refusal::WrongOffset { next: 0 }),
        (length - 4, Refusal::BeyondEnd),
    ] {
        assert_eq!(step(&mut bench, chunk(offset)), refused(why));
    }
}

#[test]
fn a_begin_that_is_refused_leaves_the_upload_under_way_alone() {
    let mut bench = proven();
    let second = release(2, reference_network());
    let reply = offer(&mut bench, &second);
    assert_eq!(reply, UploadReply::Accepted { next: 0 });
    let nobodys = UploadRequest::Begin {
        header: release(3, reference_model()).header(),
        signature: None,
    };
    assert_eq!(step(&mut bench, nobodys), refused(Refusal::Unsigned));
    assert_eq!(
        step(&mut bench, chunk(0)),
        UploadReply::Accepted { next: 8 }
    );
}

#[test]
fn a_model_that_was_taken_back_on_trial_comes_never_again() {
    let mut bench = proven();
    let second = release(2, reference_network());
    upload(&mut bench, &second);
    let mut bench = bench.restart();
    let back = ordered(&mut bench, Order::RollBack);
    assert_eq!(back, Answered::Done);
    let mut bench = bench.restart();
    let reply = upload(&mut bench, &second);
    assert_eq!(reply, refused(Refusal::NotNewer { newest: 2 }));
}
