//! Transfers that the host makes before the device asks for them, so that one answer brings all of a sample instead of one each.
//!
//! What the device transfers comes again every few samples, when the same counter shows its status, as long as nothing goes wrong. Both
//! ends remember the transfers of the samples before, as many of each as find room. A transfer that is not what was expected is asked
//! for, and so is every one after it in its sample; the host first takes back what it made ahead from there on.

use super::chips::LATCH;
use super::files::Files;
use crate::board::semihosting::exit;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use jointwatch_shared::wire::wiring::COUNTERS;

/// Takes back what was made ahead from this transfer on.
const TAKE_BACK: u8 = 8;

/// Transfers and bytes of a sample that are remembered.
const TRANSFERS: usize = 16;
const ROOM: usize = 160;
/// Bytes of RAM that only this emulation takes.
pub(super) const EMULATED: usize = size_of_val(&TURNS) + size_of_val(&ANSWERS);

/// The transfers of one sample.
struct Turn {
    known: AtomicUsize,
    /// What was transferred with, and how many bytes each time.
    kinds: [AtomicU8; TRANSFERS],
    lengths: [AtomicU8; TRANSFERS],
    /// What went out, one behind the other.
    sent: [AtomicU8; ROOM],
}

/// Of as many samples as counters take turns.
static TURNS: [Turn; COUNTERS] = [const {
    Turn {
        known: AtomicUsize::new(0),
        kinds: [const { AtomicU8::new(0) }; TRANSFERS],
        lengths: [const { AtomicU8::new(0) }; TRANSFERS],
        sent: [const { AtomicU8::new(0) }; ROOM],
    }
}; COUNTERS];
/// What came in for those that were made ahead.
static ANSWERS: [AtomicU8; ROOM] = [const { AtomicU8::new(0) }; ROOM];
/// Whose turn this sample is.
static TURN: AtomicUsize = AtomicUsize::new(0);
/// Of this sample, how many were made, and how many bytes they had.
static MADE: AtomicUsize = AtomicUsize::new(0);
static BYTES: AtomicUsize = AtomicUsize::new(0);
/// Whether everything so far in this sample was as expected; whether everything was remembered.
static EXPECTED: AtomicBool = AtomicBool::new(false);
static REMEMBERED: AtomicBool = AtomicBool::new(true);

/// The transfers that this sample's are held against.
fn turn() -> &'static Turn {
    let [first, ..] = &TURNS;
    TURNS.get(TURN.load(Ordering::Relaxed)).unwrap_or(first)
}

/// One transfer, ahead or asked for.
pub(super) fn transfer(files: Files, kind: u8, bytes: &mut [u8]) {
    let (made, begin) = (MADE.load(Ordering::Relaxed), BYTES.load(Ordering::Relaxed));
    let end = begin + bytes.len();
    if EXPECTED.load(Ordering::Relaxed) {
        if turn().holds(made, kind, begin, bytes) {
            let answers = ANSWERS.get(begin..end).unwrap_or_default();
            for (place, answer) in bytes.iter_mut().zip(answers) {
                *place = answer.load(Ordering::Relaxed);
            }
            MADE.store(made + 1, Ordering::Relaxed);
            BYTES.store(end, Ordering::Relaxed);
            return;
        }
        EXPECTED.store(false, Ordering::Relaxed);
        files.request(TAKE_BACK, &[made as u8]);
    }
    // The first that finds no room ends that for this sample.
    let remembered =
        REMEMBERED.load(Ordering::Relaxed) && turn().remember(made, kind, begin, bytes);
    REMEMBERED.store(remembered, Ordering::Relaxed);
    if remembered {
        MADE.store(made + 1, Ordering::Relaxed);
        BYTES.store(end, Ordering::Relaxed);
    }
    files.request(kind, bytes);
    if kind != LATCH {
        files.answer(bytes);
    }
}

impl Turn {
    /// Where the transfer of this number has its kind, its length and its bytes; `None` beyond what is remembered.
    fn places(
        &self,
        number: usize,
        begin: usize,
        length: usize,
    ) -> Option<(&AtomicU8, &AtomicU8, &[AtomicU8])> {
        Some((
            self.kinds.get(number)?,
            self.lengths.get(number)?,
            self.sent.get(begin..begin + length)?,
        ))
    }

    /// Whether its transfer of this number is this one.
    fn holds(&self, number: usize, kind: u8, begin: usize, bytes: &[u8]) -> bool {
        let Some((known_kind, length, sent)) = self.places(number, begin, bytes.len()) else {
            return false;
        };
        number < self.known.load(Ordering::Relaxed)
            && known_kind.load(Ordering::Relaxed) == kind
            && usize::from(length.load(Ordering::Relaxed)) == bytes.len()
            && sent
                .iter()
                .zip(bytes)
                .all(|(a, b)| a.load(Ordering::Relaxed) == *b)
    }

    /// Keeps a transfer; false where there is no room for it.
    fn remember(&self, number: usize, kind: u8, begin: usize, bytes: &[u8]) -> bool {
        let Some((known_kind, length, sent)) = self.places(number, begin, bytes.len()) else {
            return false;
        };
        known_kind.store(kind, Ordering::Relaxed);
        length.store(bytes.len() as u8, Ordering::Relaxed);
        for (place, &byte) in sent.iter().zip(bytes) {
            place.store(byte, Ordering::Relaxed);
        }
        true
    }
}

/// Ends a sample: how many transfers are remembered of it. Those that were made ahead and not asked for are not.
pub(super) fn end() -> u8 {
    let made = MADE.load(Ordering::Relaxed);
    turn().known.store(made, Ordering::Relaxed);
    made as u8
}

/// Begins a sample with what the host made ahead.
pub(super) fn begin(files: Files) {
    TURN.store(
        (TURN.load(Ordering::Relaxed) + 1) % COUNTERS,
        Ordering::Relaxed,
    );
    let turn = turn();
    let known = turn.lengths.iter().take(turn.known.load(Ordering::Relaxed));
    let total: usize = known
        .map(|length| usize::from(length.load(Ordering::Relaxed)))
        .sum();
    let mut room = [0; ROOM];
    let Some(answers) = room.get_mut(..total) else {
        exit(false)
    };
    files.answer(answers);
    for (place, &answer) in ANSWERS.iter().zip(&*answers) {
        place.store(answer, Ordering::Relaxed);
    }
    MADE.store(0, Ordering::Relaxed);
    BYTES.store(0, Ordering::Relaxed);
    EXPECTED.store(true, Ordering::Relaxed);
    REMEMBERED.store(true, Ordering::Relaxed);
}
