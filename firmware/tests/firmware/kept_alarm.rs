//! What a device remembers of an alarm, whatever power does: one that stands is never lost, one
//! that was acknowledged does not come back, and nothing else that the journal holds goes back
//! either.

use crate::failing_flash::{Cut, Flash, Operation, cuts};
use jointwatch_firmware::store::{Store, Trust, Upload, Verifier};
use jointwatch_shared::wire::blob::BLOB_LEN;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{CLASS_LEN, Entry, Header, Order, SIGNATURE_LEN};
use jointwatch_shared::wire::telemetry::{
    KeptAlarm, Signature, UploadReply, UploadRequest, Verdict,
};

const CLASS: [u8; CLASS_LEN] = *b"bench\0\0\0\0\0\0\0\0\0\0\0";
const SIGNATURE: [u8; SIGNATURE_LEN] = [7; SIGNATURE_LEN];
const ALARM: KeptAlarm = KeptAlarm {
    sample: 123_456_789_012,
    verdict: Verdict {
        state: 3,
        cause: 33,
        axis: 1,
        channel: 0,
        permille: 1017,
    },
};

/// Signatures have tests of their own.
#[derive(Clone, Copy)]
struct Anybody;

impl Verifier for Anybody {
    fn holds(&self, _: &[u8], _: &[u8; SIGNATURE_LEN]) -> bool {
        true
    }
}

fn start(flash: Flash) -> Store<Flash, Anybody> {
    let trust = Trust {
        keys: [Some(Anybody), Some(Anybody)],
        class: CLASS,
        unsigned: false,
    };
    let mut store = Store::new(flash, trust);
    store.start(&mut [0; BLOB_LEN]);
    store
}

/// What a device does between two restarts.
type Session = fn(&mut Store<Flash, Anybody>);

fn raise(store: &mut Store<Flash, Anybody>) {
    let _ = store.keep_alarm(ALARM);
}

fn order(store: &mut Store<Flash, Anybody>, order: Order) {
    let Ok(Entry { number, .. }) = store.standing() else {
        return;
    };
    let _ = store.order(order, number, &SIGNATURE, &mut [0; BLOB_LEN]);
}

fn acknowledge(store: &mut Store<Flash, Anybody>) {
    order(store, Order::Acknowledge);
}

fn restart(store: &mut Store<Flash, Anybody>) {
    order(store, Order::Restart);
}

/// The beginning of an upload: what is remembered goes to the other journal, and a sector is
/// erased.
fn erase(store: &mut Store<Flash, Anybody>) {
    let header = Header {
        rig_len: 0,
        release: 9,
        class: Bytes::new(CLASS),
        digest: Bytes::new([0; 32]),
    };
    let begin = UploadRequest::Begin {
        header,
        signature: Some(Signature::new(SIGNATURE)),
    };
    let reply = Upload::new().step(store, &begin, &mut [0; BLOB_LEN]);
    let done = matches!(reply, UploadReply::Accepted { .. });
    assert!(done || store.flash().is_dead(), "{reply:?}");
}

/// The flash behind these sessions, none of them cut short.
fn after(sessions: &[Session]) -> Flash {
    sessions.iter().fold(Flash::erased(), |mut flash, session| {
        flash.power(None, 3);
        let mut store = start(flash);
        session(&mut store);
        store.into_flash()
    })
}

/// What a restart remembers.
fn remembered(flash: &Flash, seed: u64) -> Entry {
    let mut flash = flash.clone();
    flash.power(None, seed);
    start(flash).remembered().expect("it can be read")
}

/// Goes through every cut of a session: what is remembered behind it has to be right, and what a
/// second try leaves as well.
fn every_cut(
    before: &[Session],
    session: Session,
    right: impl Fn(&Entry, Cut),
    at_last: impl Fn(&Entry, Cut),
) {
    let flash = after(before);
    let counted = remembered(&flash, 1);
    let operations: Vec<Operation> = {
        let mut flash = flash.clone();
        flash.power(None, 1);
        let mut store = start(flash);
        session(&mut store);
        store.into_flash().operations
    };
    assert!(!operations.is_empty());
    for (number, cut) in cuts(&operations, false).into_iter().enumerate() {
        let mut flash = flash.clone();
        flash.power(Some(cut), number as u64);
        let mut store = start(flash);
        session(&mut store);
        let mut flash = store.into_flash();
        assert!(flash.is_dead(), "{cut:?} was never reached");
        // A word in doubt may read otherwise every time.
        for seed in 0..8 {
            let seen = remembered(&flash, number as u64 + seed);
            right(&seen, cut);
            assert!(seen.number >= counted.number && seen.erasures >= counted.erasures);
        }
        flash.power(None, number as u64 + 11);
        let mut store = start(flash);
        session(&mut store);
        let flash = store.into_flash();
        let whole = remembered(&flash, 1);
        for seed in 0..8 {
            let seen = remembered(&flash, number as u64 + seed);
            at_last(&seen, cut);
            assert!(seen.number >= whole.number, "{cut:?}: {seen:?}, {whole:?}");
        }
    }
}

#[test]
fn an_alarm_that_power_fails_on_is_kept_whole_or_not_at_all() {
    let right = |seen: &Entry, cut| {
        assert!(seen.alarm.is_none_or(|alarm| alarm == ALARM), "{cut:?}");
    };
    let at_last = |seen: &Entry, cut| assert_eq!(seen.alarm, Some(ALARM), "{cut:?}");
    every_cut(&[], raise, right, at_last);
    every_cut(&[erase, restart], raise, right, at_last);
}

#[test]
fn an_alarm_that_stands_outlasts_every_cut_of_an_erasure_and_of_an_order() {
    let stands = |seen: &Entry, cut| assert_eq!(seen.alarm, Some(ALARM), "{cut:?}");
    for before in [&[raise as Session][..], &[erase, raise, restart]] {
        every_cut(before, erase, stands, stands);
        every_cut(before, restart, stands, stands);
        every_cut(before, raise_again, stands, stands);
    }
}

/// Another alarm does not take the place of the one that stands; something has to be written for
/// power to fail on.
fn raise_again(store: &mut Store<Flash, Anybody>) {
    let mut other = ALARM;
    other.sample += 1;
    let _ = store.keep_alarm(other);
    restart(store);
}

#[test]
fn an_alarm_that_was_acknowledged_does_not_come_back() {
    let either = |seen: &Entry, cut| {
        assert!(seen.alarm.is_none_or(|alarm| alarm == ALARM), "{cut:?}");
    };
    let gone = |seen: &Entry, cut| assert_eq!(seen.alarm, None, "{cut:?}");
    every_cut(&[raise], acknowledge, either, gone);
    every_cut(&[raise, acknowledge], restart, gone, gone);
    every_cut(&[raise, acknowledge], erase, gone, gone);
}

#[test]
fn an_alarm_that_power_failed_on_does_not_undo_what_was_remembered_after_it() {
    let mut raised = Flash::erased();
    raised.power(None, 1);
    let mut store = start(raised);
    raise(&mut store);
    let operations = store.into_flash().operations;
    for (number, cut) in cuts(&operations, false).into_iter().enumerate() {
        let mut flash = Flash::erased();
        flash.power(Some(cut), number as u64);
        let mut store = start(flash);
        raise(&mut store);
        let mut flash = store.into_flash();
        flash.power(None, number as u64 + 5);
        let mut store = start(flash);
        order(&mut store, Order::RevokeOther);
        let flash = store.into_flash();
        // Its last bits may read as they were meant to be, now and then.
        for seed in 0..200 {
            assert_eq!(remembered(&flash, seed).revoked, 0b10, "{cut:?}");
        }
    }
}
