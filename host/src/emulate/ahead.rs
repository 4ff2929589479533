//! Transfers with the chips that are made before the device asks for them, so that one answer brings all of a sample instead of one each.
//!
//! What the device transfers comes again every few samples, when the same counter shows its status, as long as nothing goes wrong. Both
//! ends remember the transfers of the samples before. A transfer that is not what was expected is asked for, and so is every one after
//! it in its sample; what was made ahead from there on is taken back first, so that no chip ever hears what it would not have heard.

use super::board::Place;
use super::link::Host;
use jointwatch_shared::wire::wiring::COUNTERS;

/// Kinds of transfers: counters from 0, then these.
const CONVERTER: u8 = 4;
const ACCELEROMETER: u8 = 5;
const LAST_CHIP: u8 = 6;
pub(super) const LATCH: u8 = 7;

/// Transfers and bytes of a sample that both ends remember.
const TRANSFERS: usize = 16;
const ROOM: usize = 160;

/// One transfer of the kinds up to [`LATCH`].
pub(super) fn transfer(host: &mut impl Host, kind: u8, bytes: &mut [u8]) {
    match kind {
        LATCH => host.select_counters(bytes),
        CONVERTER => host.select(Place::Converter, bytes),
        ACCELEROMETER..=LAST_CHIP => {
            host.select(
                Place::Accelerometer(usize::from(kind - ACCELEROMETER)),
                bytes,
            );
        }
        counter => host.select(Place::Counter(usize::from(counter)), bytes),
    }
}

/// What is remembered.
#[derive(Default)]
pub(super) struct Ahead {
    /// Kind, and what went out: of as many samples as counters take turns.
    turns: [Vec<(u8, Vec<u8>)>; COUNTERS],
    /// Whose turn this sample is.
    turn: usize,
    /// Whether its transfers were made ahead, and none was taken back.
    made: bool,
    /// Whether one of this sample has found no room.
    full: bool,
}

impl Ahead {
    /// Keeps a transfer that was asked for.
    pub(super) fn remember(&mut self, kind: u8, bytes: &[u8]) {
        let list = &mut self.turns[self.turn];
        let held: usize = list.iter().map(|(_, bytes)| bytes.len()).sum();
        self.full |= list.len() == TRANSFERS || held + bytes.len() > ROOM;
        if !self.full {
            list.push((kind, bytes.to_vec()));
        }
    }

    /// The device has made the first `count` of them, and no others that were made ahead.
    pub(super) fn take_back(&mut self, host: &mut impl Host, count: usize) {
        let list = &mut self.turns[self.turn];
        if self.made && count < list.len() {
            host.take_back();
            for (kind, bytes) in list.iter().take(count) {
                transfer(host, *kind, &mut bytes.clone());
            }
        }
        list.truncate(count);
        self.made = false;
    }

    /// Makes those of the next sample, and appends what came in.
    pub(super) fn make(&mut self, host: &mut impl Host, answer: &mut Vec<u8>) {
        self.turn = (self.turn + 1) % COUNTERS;
        host.keep();
        for (kind, bytes) in &self.turns[self.turn] {
            let begin = answer.len();
            answer.extend_from_slice(bytes);
            transfer(host, *kind, &mut answer[begin..]);
        }
        self.made = true;
        self.full = false;
    }
}

#[cfg(test)]
mod tests {
    use super::super::link::{Memory, Next};
    use super::*;

    /// Chips that answer how many transfers they have heard, and remember which.
    #[derive(Default)]
    struct Chips {
        heard: Vec<(String, Vec<u8>)>,
        kept: usize,
    }

    impl Host for Chips {
        fn select(&mut self, place: Place, bytes: &mut [u8]) {
            self.heard.push((format!("{place:?}"), bytes.to_vec()));
            bytes.fill(self.heard.len() as u8);
        }
        fn select_counters(&mut self, bytes: &[u8]) {
            self.heard.push(("latch".into(), bytes.to_vec()));
        }
        fn keep(&mut self) {
            self.kept = self.heard.len();
        }
        fn take_back(&mut self) {
            self.heard.truncate(self.kept);
        }
        fn next(&mut self) -> Next {
            unreachable!("no sample is waited for")
        }
        fn sent(&mut self, _: &[u8]) {}
        fn received(&mut self, _: usize) -> Vec<u8> {
            Vec::new()
        }
        fn started(&mut self, _: u32) {}
        fn stages(&mut self, _: &[u32]) {}
        fn memory(&mut self, _: Memory) {}
    }

    /// Transfers of a sample, what is made ahead of it given: those that agree are taken, the others asked for.
    fn sample(ahead: &mut Ahead, chips: &mut Chips, wanted: &[(u8, Vec<u8>)]) -> usize {
        ahead.make(chips, &mut Vec::new());
        let expected = ahead.turns[ahead.turn].clone();
        let same = expected
            .iter()
            .zip(wanted)
            .take_while(|(a, b)| a == b)
            .count();
        if same < wanted.len() {
            ahead.take_back(chips, same);
        }
        for (kind, bytes) in &wanted[same..] {
            ahead.remember(*kind, bytes);
            transfer(chips, *kind, &mut bytes.clone());
        }
        let remembered = wanted.len().min(TRANSFERS);
        ahead.take_back(chips, remembered);
        same
    }

    #[test]
    fn chips_hear_what_was_asked_for_and_nothing_else() {
        let (mut ahead, mut chips) = (Ahead::default(), Chips::default());
        let usual = |status: u8| {
            vec![
                (LATCH, vec![0xE8]),
                (0, vec![0x68, 0, 0, 0, 0]),
                (status, vec![0x70, 0]),
                (CONVERTER, vec![0; 18]),
            ]
        };
        let mut heard = Vec::new();
        let mut ahead_of = Vec::new();
        for number in 0..40_u8 {
            let mut wanted = usual(number % COUNTERS as u8);
            match number {
                // A chip is asked once more, another not at all, one sample is endless.
                17 => wanted.insert(2, (ACCELEROMETER, vec![1; 9])),
                23 => drop(wanted.pop()),
                29 => wanted.extend(vec![(LAST_CHIP, vec![2; 9]); 30]),
                _ => {}
            }
            ahead_of.push(sample(&mut ahead, &mut chips, &wanted));
            heard.extend(wanted.into_iter().map(|(_, bytes)| bytes));
        }
        let bytes: Vec<Vec<u8>> = chips.heard.into_iter().map(|(_, bytes)| bytes).collect();
        assert_eq!(bytes, heard);
        // All of a usual sample comes ahead, from the second time on that a counter shows its status.
        assert_eq!(ahead_of[..4], [0; 4]);
        assert_eq!(ahead_of[4..17], [4; 13]);
        assert_eq!((ahead_of[17], ahead_of[21]), (2, 2));
        assert_eq!((ahead_of[23], ahead_of[27]), (3, 3));
    }
}
