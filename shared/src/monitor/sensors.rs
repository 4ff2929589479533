//! Is a sensor lying? Faults that the drivers report, counted; and channels that stand still while
//! their axis moves.

use super::limits::{CHANNELS, Limits};
use super::verdict::Cause;
use crate::chain::RawSample;

/// Kinds of fault that a driver or the chain reports for a single sample.
pub(super) const KINDS: usize = 6;

/// What went wrong with the sensors at one instant. In every word, bit 6·axis + channel stands for
/// one channel, channels in the order of [`RawAxis`](crate::chain::RawAxis): far and near
/// displacement counter, body counter, accelerometer, force, input. Laid out as in C, as the
/// counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Faults {
    /// The converter stood at a rail of its code.
    pub saturated: u16,
    /// The value was outside what the sensor's data sheet allows.
    pub out_of_range: u16,
    /// The checksum of the transfer was wrong.
    pub checksum: u16,
    /// The sensor did not answer in time, or the bus failed.
    pub time_out: u16,
    /// There was no new value: the sample is missing or repeated.
    pub missing: u16,
    /// The counter lost its count and began anew, so that its zero is not the rig's any more; as
    /// long as that is so.
    pub reference_lost: u16,
    /// Samples that were lost right before this one; `missing` says of which channels.
    pub lost: u32,
}

impl Faults {
    /// The bit of one channel.
    pub fn bit(axis: usize, channel: usize) -> u16 {
        1 << ((CHANNELS * axis + channel) & 15)
    }

    /// Whether anything went wrong.
    pub fn any(&self) -> bool {
        let of_samples = self.saturated | self.out_of_range | self.checksum;
        (of_samples | self.time_out | self.missing | self.reference_lost) != 0 || self.lost != 0
    }

    /// Every kind with its channels.
    pub fn kinds(&self) -> [(Cause, u16); KINDS] {
        [
            (Cause::TimeOut, self.time_out),
            (Cause::Checksum, self.checksum),
            (Cause::Missing, self.missing),
            (Cause::Saturated, self.saturated),
            (Cause::OutOfRange, self.out_of_range),
            (Cause::ReferenceLost, self.reference_lost),
        ]
    }
}

/// A rate of samples, 1 in 2⁻¹⁶, over the last 2^`log_memory` blocks or so: recursive, one part of
/// so many is forgotten per block.
pub(super) fn forget(rate: &mut i32, count: u16, log_block: u32, log_memory: u32) {
    let now = (i32::from(count) << 16) >> (log_block & 15);
    *rate += (now - *rate) >> (log_memory & 15);
}

/// Binary logarithm of the blocks over which faults are counted.
const FAULT_MEMORY: u32 = 3;
/// Blocks of a gap that are counted: after twice the memory, a longer one makes no difference.
const MAX_OF_GAP: u32 = 16;
/// Blocks in which a channel stands still and its axis moves until it is called stuck.
const STUCK_BLOCKS: u8 = 4;

/// One channel within a block: its first count and how far it went from there.
#[derive(Clone, Copy, Debug, Default)]
struct ChannelSpan {
    first: i32,
    least: i32,
    most: i32,
    /// Blocks in a row in which it stood still while its axis moved.
    still: u8,
}

impl ChannelSpan {
    /// How far it went within the block.
    fn span(&self) -> u32 {
        self.most.wrapping_sub(self.least) as u32
    }

    /// Takes the first count of a block in.
    #[inline(always)]
    fn begin(&mut self, value: i32) {
        (self.first, self.least, self.most) = (value, 0, 0);
    }

    /// Takes the next count in.
    #[inline(always)]
    fn follow(&mut self, value: i32) {
        // Counters wrap, so what counts is the way from the first one.
        let way = value.wrapping_sub(self.first);
        if way < self.least {
            self.least = way;
        }
        if way > self.most {
            self.most = way;
        }
    }
}

/// What is kept of the sensors between samples.
#[derive(Clone, Debug, Default)]
pub(super) struct SensorState {
    counts: [u16; KINDS],
    channels: [u16; KINDS],
    /// The channels of the last block in which there were any.
    last: [u16; KINDS],
    rates: [i32; KINDS],
    spans: [[ChannelSpan; CHANNELS]; 2],
    /// The axis whose courses the last sample was taken into.
    turn: usize,
    /// Axes of whose block there was a sample.
    started: [bool; 2],
    /// Channels that are stuck.
    stuck: u16,
    /// Channels that stood still in the last block while their axis moved.
    suspected: u16,
}

/// What is wrong with the sensors: the cause, its channels, and its rate in 2⁻¹⁶ (all of it for a
/// channel that is stuck).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SensorFault {
    pub(super) cause: Cause,
    pub(super) channels: u16,
    pub(super) rate: i32,
}

impl SensorState {
    /// Takes one sample in.
    pub(super) fn sample(&mut self, limits: &Limits, raw: &RawSample, faults: &Faults) {
        if faults.any() {
            self.count(faults);
        }
        // The axes in turn: eight samples of a block, at least, say well enough how far a channel
        // went.
        self.turn ^= 1;
        let own = self.turn & 1;
        if own >= limits.axes.len() {
            return;
        }
        let raw = &raw[own];
        let [of_far, of_near] = raw.displacement;
        let [far, near, body, acceleration, force, _] = &mut self.spans[own];
        if self.started[own] {
            far.follow(of_far);
            near.follow(of_near);
            body.follow(raw.body);
            acceleration.follow(raw.acceleration);
            force.follow(raw.force);
        } else {
            far.begin(of_far);
            near.begin(of_near);
            body.begin(raw.body);
            acceleration.begin(raw.acceleration);
            force.begin(raw.force);
            self.started[own] = true;
        }
    }

    #[inline(never)]
    fn count(&mut self, faults: &Faults) {
        let tallies = self.counts.iter_mut().zip(&mut self.channels);
        for ((count, channels), (cause, seen)) in tallies.zip(faults.kinds()) {
            // A gap counts by the samples that it swallowed, a driver's repeated value as one.
            let samples = match cause {
                Cause::Missing => faults.lost.max(u32::from(seen != 0)),
                _ => u32::from(seen != 0),
            };
            *count = count.saturating_add(samples.min(u16::MAX.into()) as u16);
            *channels |= seen;
        }
    }

    /// Ends the block of an axis: channels that stood still. The axes come one after the other, the
    /// first one first.
    pub(super) fn end_courses(&mut self, limits: &Limits, axis: usize) {
        let axis = axis & 1;
        if axis == 0 {
            (self.stuck, self.suspected) = (0, 0);
        }
        let Some(limits) = limits.axes.get(axis) else {
            return;
        };
        // An input, the last one, may stand still while its axis moves.
        let measured = || limits.moving_counts.iter().take(CHANNELS - 1);
        let mut moves = false;
        for (span, &least) in self.spans[axis].iter().zip(measured()) {
            moves |= least != 0 && span.span() >= least;
        }
        let all = self.spans[axis].iter_mut().zip(measured());
        for (channel, (span, &least)) in all.enumerate() {
            if span.span() != 0 || least == 0 {
                span.still = 0;
            } else if moves {
                span.still = span.still.saturating_add(1);
                self.suspected |= Faults::bit(axis, channel);
            }
            if span.still >= STUCK_BLOCKS {
                self.stuck |= Faults::bit(axis, channel);
            }
        }
        self.started[axis] = false;
    }

    /// Ends `blocks` blocks of the faults' rates, all but one of them in a gap. True when the
    /// block, whose courses have ended, is not to be trusted.
    pub(super) fn end_rates(&mut self, log_block: u32, blocks: u32) -> bool {
        let tallies = self.counts.iter_mut().zip(&mut self.channels);
        let most = 1_u16 << (log_block & 15);
        for ((rate, last), (count, channels)) in
            self.rates.iter_mut().zip(&mut self.last).zip(tallies)
        {
            // What is left after blocks of which every sample had this fault or none.
            let gap = blocks.saturating_sub(1).min(MAX_OF_GAP);
            let in_gap = if *count >= most { most } else { 0 };
            for _ in 0..gap {
                forget(rate, in_gap, log_block, FAULT_MEMORY);
                *count = count.saturating_sub(in_gap);
            }
            forget(rate, (*count).min(most), log_block, FAULT_MEMORY);
            if *channels != 0 {
                *last = *channels;
            }
            (*count, *channels) = (0, 0);
        }
        self.suspected != 0
    }

    /// The worst of what is wrong: a channel that is stuck, else the kind of fault with the highest
    /// rate.
    pub(super) fn worst(&self) -> SensorFault {
        if self.stuck != 0 {
            return SensorFault {
                cause: Cause::Stuck,
                channels: self.stuck,
                rate: 1 << 16,
            };
        }
        let mut worst = SensorFault {
            cause: Cause::TimeOut,
            channels: 0,
            rate: 0,
        };
        let kinds = Faults::default().kinds();
        for (((cause, _), &rate), &channels) in kinds.iter().zip(&self.rates).zip(&self.last) {
            if rate > worst.rate {
                worst = SensorFault {
                    cause: *cause,
                    channels,
                    rate,
                };
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_counts_by_the_blocks_that_it_swallowed() {
        let mut state = SensorState::default();
        state.count(&Faults {
            missing: 1,
            lost: 5 * 64,
            ..Faults::default()
        });
        state.end_rates(6, 5);
        // After five blocks without a sample: 1 − (7/8)⁵ of the time.
        let SensorFault { cause, rate, .. } = state.worst();
        let share = f64::from(rate) / 65536.0;
        assert_eq!(cause, Cause::Missing);
        assert!((share - 0.487).abs() < 0.002, "{share}");
    }
}
