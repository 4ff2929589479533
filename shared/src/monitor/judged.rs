//! How much of the recent time an axis was judged, how long ago it was last, and what kept it from
//! being judged.
//!
//! *Healthy* is a statement about what was seen: it is made when enough blocks were judged and no
//! sum stands near its threshold, and ends when too few of the recent ones were judged.

use super::verdict::Cause;

/// Blocks of the recent time: some 8 s.
pub const RECENT: u32 = 128;
/// The fewest judged blocks of the recent time after which a joint is called healthy: as many as an
/// alarm by the error takes.
const FEWEST: u32 = 16;
/// A joint is called healthy from a quarter of the recent time on, and no longer where less than a
/// fifth was judged.
const BEGINS: u32 = 4;
const ENDS: u32 = 5;
/// Binary logarithm of the unjudged blocks over which the reasons are weighed.
const REASON_MEMORY: u32 = 4;

/// What keeps a block from being judged.
pub(super) const REASONS: [Cause; 4] = [
    Cause::TooGentle,
    Cause::OutsideRange,
    Cause::SensorFault,
    Cause::SamplesLost,
];

/// What keeps a block from being judged, as a place in [`REASONS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Reason {
    #[default]
    Gentle,
    Outside,
    Sensor,
    Lost,
}

/// What is kept of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Judged {
    /// One bit per block, the newest lowest: whether it was judged.
    bits: u128,
    /// Blocks since the start, up to [`RECENT`], and judged ones among them.
    seen: u32,
    count: u32,
    /// Blocks since the last judged one, or since the start.
    since: u32,
    weights: [i32; REASONS.len()],
    is_healthy: bool,
}

impl Judged {
    /// Ends `blocks` blocks, all but the last of them in a gap; what kept the last from being
    /// judged, if anything did. Healthy begins only where the sums are `low`: a joint that was
    /// changed before the power came on would else be called healthy until it is found.
    pub(super) fn end(&mut self, blocks: u32, unjudged: Option<Reason>, low: bool) {
        let gap = blocks.saturating_sub(1);
        if gap > 0 {
            self.pass(gap, Reason::Lost);
        }
        match unjudged {
            Some(reason) => self.pass(1, reason),
            None => {
                self.shift(1);
                self.bits |= 1;
                self.since = 0;
            }
        }
        self.count = self.bits.count_ones();
        let (times, may_be) = if self.is_healthy {
            (ENDS, true)
        } else {
            (BEGINS, low)
        };
        self.is_healthy = may_be && self.count >= FEWEST && self.count * times >= self.seen;
    }

    fn shift(&mut self, blocks: u32) {
        self.bits = self.bits.checked_shl(blocks).unwrap_or(0);
        self.seen = self.seen.saturating_add(blocks).min(RECENT);
        self.since = self.since.saturating_add(blocks);
    }

    fn pass(&mut self, blocks: u32, reason: Reason) {
        self.shift(blocks);
        for (place, weight) in self.weights.iter_mut().enumerate() {
            let now = if place == reason as usize { 1 << 16 } else { 0 };
            *weight = if blocks > 1 {
                now
            } else {
                *weight + ((now - *weight) >> REASON_MEMORY)
            };
        }
    }

    /// Whether enough was judged lately.
    pub(super) fn is_healthy(&self) -> bool {
        self.is_healthy
    }

    /// Whether it is too early to say more than that.
    pub(super) fn is_starting(&self) -> bool {
        self.seen < FEWEST || (self.count * BEGINS >= self.seen && !self.is_healthy)
    }

    /// Blocks since the last judged one, or since the start.
    pub(super) fn since(&self) -> u32 {
        self.since
    }

    /// The share of the recent blocks that was judged, in 1/1000.
    pub(super) fn permille(&self) -> u16 {
        (self.count * 1000 / self.seen.max(1)) as u16
    }

    /// What kept most of the latest unjudged blocks from being judged.
    pub(super) fn reason(&self) -> Cause {
        let mut most = (0, Cause::TooGentle);
        for (&weight, cause) in self.weights.iter().zip(REASONS) {
            if weight > most.0 {
                most = (weight, cause);
            }
        }
        most.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn healthy_ends_when_too_little_of_the_recent_time_was_judged() {
        let mut judged = Judged::default();
        for block in 1..=16 {
            assert!(!judged.is_healthy() && judged.is_starting(), "{block}");
            judged.end(1, None, true);
        }
        assert!(judged.is_healthy());
        for _ in 0..200 {
            judged.end(1, None, true);
        }
        assert_eq!((judged.permille(), judged.since()), (1000, 0));
        let mut blocks = 0;
        while judged.is_healthy() && blocks < 1000 {
            judged.end(1, Some(Reason::Gentle), true);
            blocks += 1;
        }
        // 25 of 128 are less than a fifth.
        assert_eq!((blocks, judged.since()), (128 - 25, 128 - 25));
        assert!(!judged.is_starting());
        assert_eq!(judged.reason(), Cause::TooGentle);
        // Another reason has to hold for most of what is weighed.
        judged.end(1, Some(Reason::Outside), true);
        assert_eq!(judged.reason(), Cause::TooGentle);
        for _ in 0..20 {
            judged.end(1, Some(Reason::Outside), true);
        }
        assert_eq!(judged.reason(), Cause::OutsideRange);
    }

    #[test]
    fn a_sum_that_stands_high_keeps_healthy_from_beginning_but_does_not_end_it() {
        let mut judged = Judged::default();
        for _ in 0..100 {
            judged.end(1, None, false);
            assert!(!judged.is_healthy() && judged.is_starting());
        }
        judged.end(1, None, true);
        assert!(judged.is_healthy() && !judged.is_starting());
        judged.end(1, None, false);
        assert!(judged.is_healthy());
    }

    #[test]
    fn a_gap_counts_by_the_blocks_that_it_swallowed() {
        let mut judged = Judged::default();
        for _ in 0..128 {
            judged.end(1, None, true);
        }
        judged.end(65, None, true);
        assert_eq!((judged.permille(), judged.since()), (1000 * 64 / 128, 0));
        assert!(judged.is_healthy());
        judged.end(u32::MAX, Some(Reason::Sensor), true);
        assert!(!judged.is_healthy() && !judged.is_starting());
        assert_eq!((judged.permille(), judged.since()), (0, u32::MAX));
        assert_eq!(judged.reason(), Cause::SamplesLost);
    }
}
