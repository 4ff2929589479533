//! Flash that is worn out, or whose supply is too low: it is not erased, and nothing that could not
//! be written is said to hold.

use super::{
    chunks, found, hello, offer, ordered, proven, refused, release, run, step, two_proven, upload,
};
use crate::bench::Flash;
use jointwatch_firmware::store::ERASURES_PER_LIFE;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::reference_model;
use jointwatch_shared::wire::slot::{ENTRY_LEN, Entry, JOURNAL_OFFSET, Order, SEAL_OFFSET};
use jointwatch_shared::wire::telemetry::{
    Answered, Event, Refusal, Report, Slot as Place, UploadReply, UploadRequest,
};

#[test]
fn a_flash_at_the_end_of_its_life_is_not_erased() {
    for (erasures, taken) in [(ERASURES_PER_LIFE - 1, true), (ERASURES_PER_LIFE, false)] {
        let entry = Entry {
            number: 9,
            erasures,
            ..Entry::default()
        };
        let mut bench = found(|bytes| {
            bytes[JOURNAL_OFFSET..][..ENTRY_LEN].copy_from_slice(&entry.encode());
        });
        let third = release(3, reference_model());
        let reply = offer(&mut bench, &third);
        if taken {
            assert_eq!(reply, UploadReply::Accepted { next: 0 });
        } else {
            assert_eq!(reply, refused(Refusal::Worn));
        }
    }
}

#[test]
fn a_place_of_the_journal_that_lost_power_is_passed_over() {
    let mut bench = found(|bytes| bytes[JOURNAL_OFFSET..][..ENTRY_LEN].fill(0xF0));
    let third = release(3, reference_model());
    let reply = offer(&mut bench, &third);
    assert_eq!(reply, UploadReply::Accepted { next: 0 });
    assert_eq!(hello(&mut bench.restart()).access.erasures, 1);
}

#[test]
fn a_full_journal_refuses_what_it_cannot_remember() {
    // Every place was once begun and lost power.
    let mut bench = found(|bytes| bytes[JOURNAL_OFFSET..].fill(0xF0));
    assert!(bench.evaluates());
    let third = release(3, reference_model());
    let reply = offer(&mut bench, &third);
    assert_eq!(reply, refused(Refusal::Worn));
}

#[test]
fn orders_that_fill_both_journals_leave_room_for_the_upload_that_makes_some() {
    let mut bench = proven();
    let carried_out = (0..5000)
        .take_while(|_| ordered(&mut bench, Order::Restart) == Answered::Done)
        .count();
    // A journal has 200 places on this flash.
    assert_eq!(carried_out, 200 + 100);
    let second = release(2, reference_network());
    let reply = offer(&mut bench, &second);
    assert_eq!(reply, UploadReply::Accepted { next: 0 });
    let restart = ordered(&mut bench, Order::Restart);
    assert_eq!(restart, Answered::Done);
}

#[test]
fn a_flash_that_takes_nothing_is_told_and_nothing_of_it_counts() {
    // A supply that is too low, and cells that are worn out.
    for spoil in [
        (|flash: &mut Flash| flash.is_low = true) as fn(&mut Flash),
        |flash| flash.deaf = 0..usize::MAX,
    ] {
        let mut bench = two_proven();
        bench.flash(spoil);
        let number = hello(&mut bench).access.number;
        let restart = ordered(&mut bench, Order::Restart);
        assert_eq!(restart, Answered::Failed);
        assert!(!bench.watch.restart_now());
        let third = release(3, reference_model());
        let reply = offer(&mut bench, &third);
        assert_eq!(reply, refused(Refusal::Flash));
        assert_eq!(hello(&mut bench).access.number, number);
    }
    // Cells that are worn out behind the last chunk, all of them or only those of the seal: what is
    // there is not sealed.
    for deaf in [0..usize::MAX, SEAL_OFFSET..SEAL_OFFSET + 4] {
        let mut bench = two_proven();
        let third = release(3, reference_model());
        let reply = offer(&mut bench, &third);
        chunks(&mut bench, &third, reply);
        bench.flash(|flash| flash.deaf = deaf);
        let reply = step(&mut bench, UploadRequest::Finish);
        assert_eq!(reply, refused(Refusal::Flash));
    }
}

#[test]
fn a_model_whose_proof_cannot_be_marked_is_not_said_to_be_kept() {
    let mut bench = proven();
    let second = release(2, reference_network());
    upload(&mut bench, &second);
    let mut bench = bench.restart();
    bench.flash(|flash| flash.deaf = 0..usize::MAX);
    bench.reports();
    run(&mut bench, 30);
    let kept = Event::ModelConfirmed { slot: Place::B };
    assert!(!bench.reports().contains(&Report::Event(kept)));
}

#[test]
fn a_new_model_whose_start_cannot_be_marked_leaves_the_one_before_it_alone() {
    let mut bench = proven();
    let second = release(2, reference_network());
    upload(&mut bench, &second);
    // The mark of its first start does not take: the slot of release 1 must not be erased, nor the
    // trial end in a restart.
    let mut bench = bench.restart_after(|flash| flash.deaf = 0..usize::MAX);
    let third = release(3, reference_network());
    let reply = upload(&mut bench, &third);
    assert_eq!(reply, refused(Refusal::Busy));
}
