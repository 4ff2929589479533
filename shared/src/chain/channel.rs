//! A channel that is not in time with the others: read so many samples ago, between its samples.

use crate::chain::filter::{DELAY_ENDS, Delay, MAX_DELAY};
use crate::chain::interpolate::{Between, mix};
use crate::fault::Error;
use crate::wire::rig::Rig;

/// Where a channel is read: how many samples ago, and between which ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Channel {
    /// Age of the oldest of the four samples.
    oldest: u16,
    weights: [i32; 4],
}

/// Samples of a counter that wait for one that is late.
const COUNTER_SAMPLES: usize = 8;
/// Places of the ring that holds them.
pub(super) const COUNTER_PLACES: usize = COUNTER_SAMPLES + DELAY_ENDS;

/// What counters that are late or early cost, the worst of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Settling {
    /// Samples that have to follow an instant before every counter is known there.
    pub(super) wait: usize,
    /// Samples that have to come before it.
    pub(super) before: usize,
}

impl Settling {
    /// Of a rig's counters.
    pub(super) fn of(rig: &Rig) -> Self {
        let delays = rig
            .axes
            .iter()
            .flat_map(|axis| [axis.delays.displacement, axis.delays.body]);
        delays.fold(Self::default(), |worst, late| {
            let between = Between::at(late);
            let weights = between.integer_weights();
            let used =
                |place: Option<usize>| i64::from(between.whole) - 1 + place.unwrap_or(1) as i64;
            let oldest = used(weights.iter().position(|weight| *weight != 0));
            let newest = used(weights.iter().rposition(|weight| *weight != 0));
            Self {
                wait: worst.wait.max(newest.max(0) as usize),
                before: worst.before.max((-oldest).max(0) as usize),
            }
        })
    }
}

impl Channel {
    /// The channel that is late by so many samples, in a chain that waits `delay` samples and keeps
    /// those up to `most`.
    fn new(quantity: &'static str, late: f64, delay: usize, most: usize) -> Result<Self, Error> {
        let between = Between::at(late);
        let weights = between.integer_weights();
        let most = most as i64;
        let oldest = delay as i64 + 1 - i64::from(between.whole);
        // A sample with weight 0 need not be there.
        let ages = (0..4).zip(weights).filter(|(_, weight)| *weight != 0);
        let reached = ages.map(|(place, _)| oldest - place);
        if let Some(age) = reached.into_iter().find(|age| !(0..=most).contains(age)) {
            return Err(Error::OutOfRange {
                quantity,
                seen: age as f64,
                least: 0.0,
                most: most as f64,
            });
        }
        Ok(Self {
            // As many as the longest filter has taps, at most.
            oldest: oldest.clamp(0, most + 1) as u16,
            weights,
        })
    }

    /// A channel that waits for the filters.
    pub(super) fn filtered(quantity: &'static str, late: f64, delay: usize) -> Result<Self, Error> {
        Self::new(quantity, late, delay, MAX_DELAY)
    }

    /// A counter, where any counter of the rig is late; `None` where all are in time.
    pub(super) fn counter(late: f64, wait: usize) -> Result<Option<Self>, Error> {
        if wait == 0 && late == 0.0 {
            return Ok(None);
        }
        let quantity = "age of the count that the delay of its counter asks for";
        Self::new(quantity, late, wait, COUNTER_SAMPLES - 1).map(Some)
    }

    /// The channel's code at the chain's instant.
    pub(super) fn read(&self, values: &Delay) -> i32 {
        let oldest = usize::from(self.oldest);
        match values.four(oldest) {
            Some(four) => mix(&self.weights, *four),
            None => mix(&self.weights, values.four_apart(oldest)),
        }
    }

    /// The counter's count at the chain's instant, also where it wraps in between.
    fn read_counter(&self, values: &Delay<COUNTER_PLACES>) -> i32 {
        let counts = values.four_apart(usize::from(self.oldest));
        let [_, near, ..] = counts;
        let steps = counts.map(|count| count.wrapping_sub(near));
        near.wrapping_add(mix(&self.weights, steps))
    }
}

/// A new count into a counter's samples, and the count at the chain's instant out of them.
#[inline(always)]
pub(super) fn in_time(
    channel: Option<&Channel>,
    values: &mut Delay<COUNTER_PLACES>,
    count: i32,
) -> i32 {
    match channel {
        None => count,
        Some(channel) => {
            values.push(count);
            channel.read_counter(values)
        }
    }
}
