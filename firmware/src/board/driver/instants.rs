//! When the samples are due, on a counter that runs on, and how many instants went by without one.

use core::num::NonZeroU32;

/// The sampling instants, a period apart.
#[derive(Debug)]
pub(in crate::board) struct Instants {
    /// Counts from one to the next.
    period: NonZeroU32,
    /// When the next one is due; none before the first.
    due: Option<u32>,
}

impl Instants {
    /// Instants `period` counts apart.
    pub(in crate::board) fn every(period: u32) -> Self {
        // From 1 Hz to 10 kHz, as the start has checked: no clock of a board makes that 0.
        let period = NonZeroU32::new(period).unwrap_or(NonZeroU32::MIN);
        Self { period, due: None }
    }

    /// At an instant, when the counter stands at `now`: says how many before it went by unnoticed.
    pub(in crate::board) fn tick(&mut self, now: u32) -> u32 {
        let late = match self.due {
            // A little early, where the first tick was a little late.
            Some(due) => now.wrapping_sub(due).cast_signed().max(0).cast_unsigned(),
            None => 0,
        };
        let missed = late / self.period;
        let periods = missed.saturating_add(1).wrapping_mul(self.period.get());
        self.due = Some(self.due.unwrap_or(now).wrapping_add(periods));
        missed
    }

    /// When the next one is due, for a timer that does not start anew by itself; `now` before the
    /// first.
    #[cfg(feature = "rp2350")]
    pub(in crate::board) fn due(&self, now: u32) -> u32 {
        self.due.unwrap_or(now)
    }
}
