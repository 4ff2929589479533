//! TIM2 tells when to sample; TIM5, which runs on, tells how many instants went by without a sample.

use super::chip::{RCC, TIM2};
use super::count;
use crate::clock::{Clock, Rate, Source};
use core::num::NonZeroU32;

/// The timer that gives the sampling instants.
#[derive(Debug)]
pub struct Ticker {
    /// Counts of the timers' clock from one sample to the next.
    period: NonZeroU32,
    /// When the next one is due, on TIM5; none before the first.
    due: Option<u32>,
}

/// Starts to sample. To be called once.
pub fn start(clock: Clock, rate: Rate) -> Ticker {
    // SAFETY: the start calls this once, before interrupts are on; later on TIM2 belongs to the sampling task.
    let (rcc, timer) = unsafe { (&*RCC::PTR, &*TIM2::PTR) };
    // Timers run at twice their bus's clock where that is divided (RM0090, “Clocks”).
    let hz = match clock.source {
        Source::Crystal => clock.hz / 2,
        Source::Internal => clock.hz,
    };
    // From 1 Hz to 10 kHz, as the start has checked: at least 1600 counts, and they fit.
    let period = NonZeroU32::new(rate.counts(hz)).unwrap_or(NonZeroU32::MIN);
    rcc.apb1enr().modify(|_, w| w.tim2en().enabled());
    rcc.apb1enr().read();
    timer.arr().write(|w| w.set(period.get().saturating_sub(1)));
    timer.egr().write(|w| w.ug().update());
    timer.sr().write(|w| w.uif().clear());
    timer.dier().write(|w| w.uie().enabled());
    timer.cr1().write(|w| w.cen().enabled());
    Ticker { period, due: None }
}

impl Ticker {
    /// Called at each instant: says how many before it went by unnoticed.
    pub fn tick(&mut self) -> u32 {
        // SAFETY: see `start`.
        unsafe { (*TIM2::PTR).sr().write(|w| w.uif().clear()) };
        let now = count();
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
}
