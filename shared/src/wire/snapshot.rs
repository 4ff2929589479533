//! The residual around an alarm: always recorded, kept when an alarm comes, and sent in pieces.

use crate::monitor::{State, Verdict};
use crate::wire::telemetry::{SNAPSHOT_PIECE, Snapshot};
use heapless::Vec;

/// Residuals of a snapshot.
const LENGTH: usize = 64;
/// How many of them follow the alarm.
const AFTER: u8 = LENGTH as u8 / 2;
/// Residuals per second; each sample's where there are fewer.
const PER_SECOND: u32 = 250;
/// Pieces of a whole snapshot.
const PIECES: u8 = LENGTH.div_ceil(SNAPSHOT_PIECE) as u8;

/// A ring of residuals, oldest at `next` once it is full.
#[derive(Clone, Copy, Debug)]
struct Ring {
    residuals: [[i32; 2]; LENGTH],
    next: u8,
    filled: u8,
}

impl Ring {
    const EMPTY: Self = Self {
        residuals: [[0; 2]; LENGTH],
        next: 0,
        filled: 0,
    };

    fn push(&mut self, residual: [i32; 2]) {
        if let Some(place) = self.residuals.get_mut(usize::from(self.next)) {
            *place = residual;
        }
        self.next = if usize::from(self.next) + 1 < LENGTH {
            self.next + 1
        } else {
            0
        };
        self.filled = self.filled.saturating_add(1).min(LENGTH as u8);
    }

    /// From the oldest on.
    fn iter(&self) -> impl Iterator<Item = [i32; 2]> {
        let (newer, older) = self
            .residuals
            .split_at_checked(usize::from(self.next))
            .unwrap_or_default();
        let unused = LENGTH.saturating_sub(usize::from(self.filled));
        older.iter().chain(newer).copied().skip(unused)
    }
}

/// Records residuals and keeps those around the last alarm.
#[derive(Clone, Debug)]
pub struct Recorder {
    every: u16,
    /// Samples until the next one is recorded.
    left: u16,
    ring: Ring,
    /// Residuals still to be recorded after an alarm, and samples from the newest one before it to
    /// the alarm.
    ending: Option<(u8, u16)>,
    kept: Ring,
    alarm: u16,
    first: i32,
    /// The next piece to be sent.
    piece: u8,
}

impl Recorder {
    /// For a rig of this sample rate, Hz.
    pub fn new(rate_hz: u32) -> Self {
        Self {
            every: ((rate_hz / PER_SECOND) as u16).max(1),
            left: 0,
            ring: Ring::EMPTY,
            ending: None,
            kept: Ring::EMPTY,
            alarm: 0,
            first: 0,
            piece: PIECES,
        }
    }

    /// Takes the residual of one sample.
    pub fn sample(&mut self, residual: [i32; 2]) {
        if self.left > 0 {
            self.left -= 1;
            return;
        }
        self.left = self.every - 1;
        self.ring.push(residual);
        if let Some((left, since)) = self.ending {
            if left > 1 {
                self.ending = Some((left - 1, since));
                return;
            }
            self.ending = None;
            self.kept = self.ring;
            self.alarm = self.alarm.saturating_add(1);
            let before = i32::from(self.ring.filled) - i32::from(AFTER) - 1;
            self.first = -(before * i32::from(self.every) + i32::from(since));
            self.piece = 0;
        }
    }

    /// The verdict over the sample that was taken last, and the one before it: keeps what is around
    /// an alarm that begins; nothing new while another snapshot is still being recorded.
    pub fn verdict(&mut self, before: &Verdict, said: &Verdict) {
        let begins = said.state == State::Alarm && before.state != State::Alarm;
        if begins && self.ending.is_none() && self.ring.filled > 0 {
            self.ending = Some((AFTER, self.every - 1 - self.left));
        }
    }

    /// Sends the last one again; false when there is none.
    pub fn again(&mut self) -> bool {
        if self.alarm > 0 {
            self.piece = 0;
        }
        self.alarm > 0
    }

    /// The next piece that is to be sent.
    pub fn piece(&mut self) -> Option<Snapshot> {
        let pieces = self.kept.filled.div_ceil(SNAPSHOT_PIECE as u8);
        if self.piece >= pieces {
            return None;
        }
        let start = usize::from(self.piece) * SNAPSHOT_PIECE;
        let mut residual: Vec<_, SNAPSHOT_PIECE> = Vec::new();
        for one in self.kept.iter().skip(start) {
            if residual.push(one).is_err() {
                break;
            }
        }
        let snapshot = Snapshot {
            alarm: self.alarm,
            piece: self.piece.into(),
            pieces: pieces.into(),
            first: self.first + start as i32 * i32::from(self.every),
            every: self.every,
            residual,
        };
        self.piece += 1;
        Some(snapshot)
    }
}
