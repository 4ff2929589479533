//! Cumulative sums: a small change that lasts adds up, chance does not (Page, Biometrika 41, 1954,
//! 100–115).

use super::block::Statistics;
use super::limits::{Cusum, SIDES};
use super::logarithm::SHARE;
use super::verdict::{Cause, Onset, State};

/// Where the statistics of a gross change begin.
pub(super) const GROSS: usize = 5;
/// What each of them says when it is reached.
pub(super) const CAUSES: [Cause; SIDES] = [
    Cause::ErrorGrew,
    Cause::Stiffer,
    Cause::Softer,
    Cause::MoreFriction,
    Cause::LessFriction,
    Cause::ForceGone,
    Cause::ForceUnexpected,
];
/// The fewest blocks that raise an alarm: of the error, and of a stiffness or a friction, which
/// have a direction to be told by.
const MIN_BLOCKS: [i32; 2] = [16, 6];
/// What one block adds to the sum of a stiffness or a friction at most, in the unit of [`SHARE`]:
/// three quarters of the shift that a change by 10 % of the RMS force makes.
pub const MAX_OF_SHARE: i32 = 3 * SHARE / 80;

/// The fewest blocks that raise an alarm by statistic `side` (0: the error). A gross change takes
/// as few as a direction.
pub fn least_blocks(side: usize) -> i32 {
    let [error, share] = MIN_BLOCKS;
    if side == 0 { error } else { share }
}

/// What one block adds to the sum of statistic `side` (0: the error) at most. A model that is wrong
/// for a moment, where the joint goes far, is wrong for some blocks in a row and by many times its
/// usual error; held to this, such a burst counts for little beside a change that lasts.
pub fn most_of_block(side: usize, threshold: i32) -> i32 {
    let part = threshold / least_blocks(side) + 1;
    if (1..GROSS).contains(&side) {
        part.min(MAX_OF_SHARE)
    } else {
        part
    }
}

/// Blocks, some 4 s, within which every change is sudden: chance decides then how a sum rises.
const AT_ONCE: u16 = 64;

/// One cumulative sum and where it stands.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Level {
    sum: i32,
    /// Blocks since the sum was last 0, and the sum of the sums after each of them.
    blocks: u16,
    area: u64,
    pub(super) state: State,
    /// How what it tells of came, as it was when the state last became graver.
    pub(super) onset: Onset,
}

/// The values whose cumulative sums are kept, in the order of [`CAUSES`], without those of a gross
/// change.
pub(super) fn values(seen: &Statistics) -> [i32; GROSS] {
    let (stiffness, friction) = (seen.stiffness, seen.friction);
    [
        seen.error,
        stiffness,
        stiffness.saturating_neg(),
        friction,
        friction.saturating_neg(),
    ]
}

impl Level {
    /// S ← max(0, S + min(y − drift, most)), `most` as [`most_of_block`] has it; the sum is held at
    /// one and a half thresholds, so that a joint that is well again is found so.
    pub(super) fn add(&mut self, value: i32, side: Cusum, most: i32) {
        let step = value.saturating_sub(side.drift).min(most);
        let most = side.threshold + side.threshold / 2;
        self.sum = self.sum.saturating_add(step).clamp(0, most.max(0));
        if self.sum == 0 {
            (self.blocks, self.area) = (0, 0);
        } else {
            self.blocks = self.blocks.saturating_add(1);
            self.area = self.area.saturating_add(u64::from(self.sum.unsigned_abs()));
        }
    }

    /// Takes the [next](Self::next) state.
    pub(super) fn review(&mut self, side: Cusum) {
        let next = self.next(side);
        if next > self.state {
            self.onset = self.onset();
        }
        self.state = next;
    }

    /// How what the sum tells of came. A change that is there at once adds the same to every block:
    /// the sum rises along a line, and its mean since it was 0 is a half of it. What drifts
    /// adds more to each block: along a parabola the mean is a third. The line between
    /// them is 5/12.
    fn onset(&self) -> Onset {
        let whole = u64::from(self.sum.unsigned_abs()) * u64::from(self.blocks);
        if self.blocks > AT_ONCE && self.area.saturating_mul(12) < 5 * whole {
            Onset::Slow
        } else {
            Onset::Sudden
        }
    }

    /// Suspect from three quarters of the threshold on and alarm from the whole; alarm ends below a
    /// half, suspect below a quarter.
    fn next(&self, side: Cusum) -> State {
        let (sum, threshold) = (self.sum, side.threshold);
        if sum >= threshold || self.state == State::Alarm && sum >= threshold / 2 {
            State::Alarm
        } else if sum >= threshold - threshold / 4
            || self.state >= State::Suspect && !self.is_low(side)
        {
            State::Suspect
        } else {
            State::Healthy
        }
    }

    /// Whether it is so far from suspect as one that has ended must be.
    pub(super) fn is_low(&self, side: Cusum) -> bool {
        self.sum <= side.threshold / 4
    }

    /// The sum in 1/1000 of the threshold.
    pub(super) fn permille(&self, side: Cusum) -> u16 {
        let shift = if side.threshold >= 1 << 20 { 8 } else { 0 };
        let (sum, threshold) = (self.sum >> shift, side.threshold >> shift);
        let permille = (sum.max(0) as u32).saturating_mul(1000) / (threshold.max(1) as u32);
        permille.min(u32::from(u16::MAX)) as u16
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::limits::MAX_CUSUM;
    use super::super::limits::tests::axis;
    use super::*;
    use crate::monitor::OCTAVE;

    const SIDE: Cusum = Cusum {
        drift: 100,
        threshold: 1000,
    };

    #[test]
    fn what_lasts_adds_up_and_no_burst_raises_an_alarm() {
        for statistic in 0..SIDES {
            for threshold in [1000, 1 << 20, MAX_CUSUM] {
                let side = Cusum {
                    drift: 100,
                    threshold,
                };
                let mut level = Level::default();
                for _ in 1..least_blocks(statistic) {
                    level.add(i32::MAX, side, most_of_block(statistic, threshold));
                    assert_ne!(level.next(side), State::Alarm);
                }
            }
        }
        assert_eq!(most_of_block(1, MAX_CUSUM), MAX_OF_SHARE);
        let mut level = Level::default();
        let mut blocks = 0;
        while level.next(SIDE) != State::Alarm {
            level.add(150, SIDE, 60);
            blocks += 1;
        }
        assert_eq!(blocks, 1000 / 50);
        assert_eq!(level.permille(SIDE), 1000);
        for _ in 0..10_000 {
            level.add(99, SIDE, 60);
        }
        assert_eq!(level.sum, 0, "below the drift it falls");
    }

    #[test]
    fn alarm_and_suspect_end_later_than_they_begin() {
        let mut level = Level::default();
        let mut seen = std::vec::Vec::new();
        // Up by 50 per block to the stop, and down again.
        for value in [150; 40].into_iter().chain([50; 40]) {
            level.add(value, SIDE, 60);
            level.review(SIDE);
            if seen.last().is_none_or(|&(_, state)| state != level.state) {
                seen.push((level.sum, level.state));
            }
        }
        let wanted = [
            (50, State::Healthy),
            (750, State::Suspect),
            (1000, State::Alarm),
            (450, State::Suspect),
            (250, State::Healthy),
        ];
        assert_eq!(seen, wanted);
    }

    #[test]
    fn extremes_stay_in_range() {
        let side = Cusum {
            drift: -(1 << 24),
            threshold: 1 << 24,
        };
        let mut level = Level::default();
        for value in [i32::MAX, i32::MIN, i32::MAX] {
            for _ in 0..100 {
                level.add(value, side, most_of_block(0, side.threshold));
                level.review(side);
            }
        }
        assert_eq!((level.state, level.permille(side)), (State::Alarm, 1500));
    }

    #[test]
    fn what_grows_is_told_from_what_is_there_at_once() {
        let side = Cusum {
            drift: 100,
            threshold: 100_000,
        };
        // What is above the drift, block after block; the sum waits at 0 before it.
        let of = |rise: fn(i32) -> i32| {
            let mut level = Level::default();
            (0..500).for_each(|_| level.add(0, side, i32::MAX));
            for block in 0.. {
                level.add(100 + rise(block), side, i32::MAX);
                level.review(side);
                if level.state == State::Alarm {
                    break;
                }
            }
            (level.onset, level.blocks)
        };
        assert_eq!(of(|_| 500), (Onset::Sudden, 200));
        assert_eq!(of(|block| 10 * block).0, Onset::Slow);
        // One that comes within four seconds is sudden however it came.
        assert_eq!(of(|block| 100 * block), (Onset::Sudden, 45));
        // What jumps, and then stays.
        assert_eq!(of(|block| (50 * block).min(500)).0, Onset::Sudden);
    }

    #[test]
    fn a_direction_has_the_cause_of_its_sign() {
        let seen = Statistics {
            stiffness: 3,
            friction: 5,
            ..Statistics::default()
        };
        let said = CAUSES.iter().zip(values(&seen));
        for (cause, wanted) in [
            (Cause::Stiffer, 3),
            (Cause::Softer, -3),
            (Cause::MoreFriction, 5),
            (Cause::LessFriction, -5),
        ] {
            let own = said.clone().find(|(said, _)| **said == cause);
            assert_eq!(own.map(|(_, value)| value), Some(wanted), "{cause:?}");
        }
    }

    #[test]
    fn a_gross_change_is_one_between_a_healthy_error_and_all_of_the_force() {
        let mut limits = axis();
        for (drift, wanted) in [
            (-20 * OCTAVE, -49 * OCTAVE / 16),
            (-15 * OCTAVE / 2, -7 * OCTAVE / 2),
            (-6 * OCTAVE, -15 * OCTAVE / 4),
            (MAX_CUSUM, -2 * OCTAVE),
        ] {
            limits.error.drift = drift;
            limits.gross = [0, 40];
            let [gone, unexpected] = limits.gross_sums();
            assert_eq!([gone.drift, unexpected.drift], [wanted; 2]);
            // Never under six octaves; else in quarters of one.
            assert_eq!(
                [gone.threshold, unexpected.threshold],
                [6 * OCTAVE, 10 * OCTAVE]
            );
        }
    }
}
