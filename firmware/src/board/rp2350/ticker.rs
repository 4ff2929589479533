//! TIMER0, which counts the processor's clock: its first alarm tells when to sample.

use crate::board::driver::instants::Instants;
use crate::clock::{Clock, Rate};
use rp235x_pac::TIMER0;

/// The first alarm's bit (section 12.8.5, INTE, INTF and INTR).
const ALARM: u32 = 1;

/// When samples are due.
#[derive(Debug)]
pub struct Ticker(Instants);

fn timer() -> &'static rp235x_pac::timer0::RegisterBlock {
    // SAFETY: the registers exist for as long as the program; once they run, they belong to the
    // sampling task.
    unsafe { &*TIMER0::PTR }
}

fn now() -> u32 {
    timer().timerawl().read().bits()
}

/// Sets the alarm, or off the interrupt where its time has just gone by: an alarm is for one count
/// alone.
fn set_alarm(due: u32) {
    // SAFETY: any count may be compared with, and the interrupt's bit is that of the alarm.
    unsafe {
        timer().alarm0().write(|w| w.bits(due));
        if now().wrapping_sub(due).cast_signed() >= 0 {
            timer().intf().write(|w| w.bits(ALARM));
        }
    }
}

/// Starts to sample. To be called once; interrupt `TIMER0_IRQ_0` is the instant.
pub fn start(clock: Clock, rate: Rate) -> Ticker {
    let period = rate.counts(clock.hz);
    timer().source().write(|w| w.clk_sys().clk_sys());
    // SAFETY: the alarm's bit.
    timer().inte().write(|w| unsafe { w.bits(ALARM) });
    set_alarm(now().wrapping_add(period));
    Ticker(Instants::every(period))
}

impl Ticker {
    /// Called at each instant: says how many before it went by unnoticed.
    pub fn tick(&mut self) -> u32 {
        // SAFETY: the alarm's bit, which is cleared by writing a one, and forced no longer.
        unsafe {
            timer().intf().write(|w| w.bits(0));
            timer().intr().write(|w| w.bits(ALARM));
        }
        let now = now();
        let missed = self.0.tick(now);
        set_alarm(self.0.due(now));
        missed
    }
}
