//! TIM2 tells when to sample; TIM5, which runs on, tells how many instants went by without a
//! sample.

use super::chip::{RCC, TIM2};
use super::count;
use crate::board::driver::instants::Instants;
use crate::clock::{Clock, Rate, Source};

/// The timer that gives the sampling instants; when they are due, on TIM5.
#[derive(Debug)]
pub struct Ticker(Instants);

/// Starts to sample. To be called once.
pub fn start(clock: Clock, rate: Rate) -> Ticker {
    // SAFETY: the start calls this once, before interrupts are on; later on TIM2 belongs to the
    // sampling task.
    let (rcc, timer) = unsafe { (&*RCC::PTR, &*TIM2::PTR) };
    // Timers run at twice their bus's clock where that is divided (RM0090, “Clocks”).
    let hz = match clock.source {
        Source::Crystal => clock.hz / 2,
        Source::Internal => clock.hz,
    };
    // At least 1600 counts, and they fit.
    let period = rate.counts(hz);
    rcc.apb1enr().modify(|_, w| w.tim2en().enabled());
    rcc.apb1enr().read();
    timer.arr().write(|w| w.set(period.saturating_sub(1)));
    timer.egr().write(|w| w.ug().update());
    timer.sr().write(|w| w.uif().clear());
    timer.dier().write(|w| w.uie().enabled());
    timer.cr1().write(|w| w.cen().enabled());
    Ticker(Instants::every(period))
}

impl Ticker {
    /// Called at each instant: says how many before it went by unnoticed.
    pub fn tick(&mut self) -> u32 {
        // SAFETY: see `start`.
        unsafe { (*TIM2::PTR).sr().write(|w| w.uif().clear()) };
        self.0.tick(count())
    }
}
