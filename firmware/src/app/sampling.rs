//! The first step of a sample: reads every chip at one instant and hands the frame on.

use crate::sensor::acquire::{CHIPS, Sensors};
use crate::sensor::presence::ChipState;
use embedded_hal::spi::SpiDevice;
use heapless::spsc::Producer;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::Faults;
use jointwatch_shared::wire::wiring::Wiring;

/// One instant, as it is handed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Its number since the restart, from 0; counts the samples that were taken.
    pub number: u64,
    /// Instants right before it at which no sample was taken.
    pub missed: u32,
    /// Samples right before it that were taken and found no room in a queue.
    pub overruns: u32,
    /// Counts in the order of the chain.
    pub sample: RawSample,
    /// What was wrong, channel by channel.
    pub faults: Faults,
    /// How each chip did.
    pub health: [ChipState; CHIPS],
}

impl Frame {
    /// Whether samples are missing right before it, whatever for.
    pub fn follows_gap(&self) -> bool {
        self.missed > 0 || self.overruns > 0
    }
}

/// Reads every chip at each sampling instant.
pub struct Sampler<L, C: SpiDevice, A: SpiDevice, X: SpiDevice> {
    sensors: Sensors<L, C, A, X>,
    wiring: Wiring,
    number: u64,
    missed: u32,
    overruns: u32,
}

impl<L: SpiDevice, C: SpiDevice, A: SpiDevice, X: SpiDevice> Sampler<L, C, A, X> {
    /// Samples these chips, wired so.
    pub fn new(sensors: Sensors<L, C, A, X>, wiring: Wiring) -> Self {
        Self {
            sensors,
            wiring,
            number: 0,
            missed: 0,
            overruns: 0,
        }
    }

    /// Takes one sample; `missed` instants before it went by without one. A frame that finds no
    /// room is counted in the next that does.
    pub fn sample(&mut self, missed: u32, frames: &mut Producer<'_, Frame>) {
        let acquired = self.sensors.acquire(&self.wiring);
        self.missed = self.missed.saturating_add(missed);
        let frame = Frame {
            number: self.number,
            missed: self.missed,
            overruns: self.overruns,
            sample: acquired.sample,
            faults: acquired.faults(&self.wiring),
            health: acquired.health,
        };
        self.number = self.number.saturating_add(1);
        if frames.enqueue(frame).is_ok() {
            (self.missed, self.overruns) = (0, 0);
        } else {
            self.overruns = self.overruns.saturating_add(1);
        }
    }
}
