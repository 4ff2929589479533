//! TIMER1 tells when to sample; TIMER2, which runs on, tells how many instants went by without a
//! sample.

use crate::board::driver::instants::Instants;
use crate::clock::{Clock, Rate};
use nrf52840_pac::timer0::RegisterBlock;
use nrf52840_pac::{TIMER1, TIMER2};

/// Timers run at a quarter of the processor's clock (“TIMER”).
const DIVIDED: u32 = 4;

/// When samples are due, on TIMER2.
#[derive(Debug)]
pub struct Ticker(Instants);

/// Both timers; once they run, they belong to the sampling task.
fn timers() -> [&'static RegisterBlock; 2] {
    // SAFETY: the registers exist for as long as the program.
    unsafe { [&*TIMER1::PTR, &*TIMER2::PTR] }
}

/// Starts to sample. To be called once; interrupt `TIMER1` is the instant.
pub fn start(clock: Clock, rate: Rate) -> Ticker {
    let period = rate.counts(clock.hz / DIVIDED);
    let [sampling, running] = timers();
    for timer in [sampling, running] {
        timer.bitmode.write(|w| w.bitmode()._32bit());
        // SAFETY: the undivided clock of the timers.
        timer.prescaler.write(|w| unsafe { w.bits(0) });
    }
    // SAFETY: any value may be compared with.
    sampling.cc[0].write(|w| unsafe { w.bits(period) });
    sampling.shorts.write(|w| w.compare0_clear().enabled());
    sampling.intenset.write(|w| w.compare0().set());
    for timer in [running, sampling] {
        // SAFETY: a task is triggered by writing a one.
        timer.tasks_start.write(|w| unsafe { w.bits(1) });
    }
    Ticker(Instants::every(period))
}

impl Ticker {
    /// Called at each instant: says how many before it went by unnoticed.
    pub fn tick(&mut self) -> u32 {
        let [sampling, running] = timers();
        sampling.events_compare[0].reset();
        // SAFETY: as above.
        running.tasks_capture[0].write(|w| unsafe { w.bits(1) });
        self.0.tick(running.cc[0].read().bits())
    }
}
