//! One instant of the whole rig: every counter latched at once, bridges and accelerometers read,
//! each chip's health beside.
//!
//! The order makes the channels belong together. First one instruction on a chip select that all
//! counters share moves every count into its latch: that edge is the instant. Then the converter,
//! whose four channels sample together, then the accelerometers, each read in one go; last the
//! latched counts, which can wait. What is left, from converter and accelerometer filters and the
//! time on the bus, is the same for every sample: the rig block holds it as a delay per
//! channel, and the chain makes up for it.
//!
//! A chip that fails keeps its last good code and says what is wrong; the others go on.

use super::ads131m04::Ads131m04;
use super::adxl355::Adxl355;
use super::ls7366r::{LOAD_OTR, Ls7366r};
use super::presence::{ChipState, Visit, Watched};
use embedded_hal::spi::SpiDevice;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::Faults;
use jointwatch_shared::wire::wiring::{
    ACCELEROMETERS, CHANNELS, COUNTERS, DIRECTIONS, Readings, Signed, Wiring,
};

/// Chips of a board: the counters, the converter, the accelerometers, in this order.
pub const CHIPS: usize = COUNTERS + 1 + ACCELEROMETERS;
/// The converter's place among them.
pub const CONVERTER: usize = COUNTERS;

/// What each chip is called in a log.
pub const CHIP_NAMES: [&str; CHIPS] = [
    "counter 0",
    "counter 1",
    "counter 2",
    "counter 3",
    "bridges",
    "accelerometer 0",
    "accelerometer 1",
];

/// One instant of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Acquired {
    /// Raw codes as the chips gave them.
    pub readings: Readings,
    /// The same in the order of the chain.
    pub sample: RawSample,
    /// How each chip did, in the order of [`CHIP_NAMES`].
    pub health: [ChipState; CHIPS],
    /// Bit i is set when channel i of the converter stands at a rail.
    pub saturated_channels: u8,
    /// For each accelerometer, bit i is set when direction i stands at a rail.
    pub saturated_directions: [u8; ACCELEROMETERS],
    /// Bit i is set while counter i counts from an unknown zero.
    pub lost_references: u8,
}

impl Acquired {
    /// Whether every fitted chip gave a code that may be used.
    pub fn usable(&self) -> bool {
        let fitted = self.health.iter().filter(|h| **h != ChipState::NotFitted);
        fitted.copied().all(ChipState::usable)
    }
}

impl Acquired {
    /// What went wrong, channel by channel of the chain, as the monitor takes it.
    pub fn faults(&self, wiring: &Wiring) -> Faults {
        let mut faults = Faults::default();
        for (number, axis) in wiring.axes.iter().enumerate() {
            let counter = |place: Option<Signed>| place.map(|p| (usize::from(p.place), 0));
            let converted =
                |place: Signed| (CONVERTER, self.saturated_channels >> (place.place & 7) & 1);
            let sources = [
                counter(Some(axis.far)),
                counter(axis.near),
                counter(axis.body),
                None,
                Some(converted(axis.force)),
                axis.input.map(converted),
            ];
            for (channel, source) in sources.into_iter().enumerate() {
                if let Some((chip, saturated)) = source {
                    let bit = Faults::bit(number, channel);
                    self.add_fault(&mut faults, bit, chip, saturated);
                    if chip < COUNTERS && self.lost_references >> (chip & 7) & 1 != 0 {
                        faults.reference_lost |= bit;
                    }
                }
            }
            for one in axis.acceleration.iter().flatten() {
                let chip = usize::from(one.chip);
                let mask = self.saturated_directions.get(chip).copied().unwrap_or(0);
                let saturated = mask >> (one.direction & 7) & 1;
                let bit = Faults::bit(number, ACCELERATION_CHANNEL);
                self.add_fault(&mut faults, bit, CONVERTER + 1 + chip, saturated);
            }
        }
        faults
    }

    fn add_fault(&self, faults: &mut Faults, bit: u16, chip: usize, saturated: u8) {
        match self.health.get(chip).copied().unwrap_or_default() {
            ChipState::Ok | ChipState::Saturated if saturated != 0 => faults.saturated |= bit,
            ChipState::Ok | ChipState::Saturated => {}
            ChipState::Crc => faults.checksum |= bit,
            ChipState::Starting | ChipState::NotFitted => faults.missing |= bit,
            ChipState::Bus
            | ChipState::Identity
            | ChipState::Settings
            | ChipState::TimedOut
            | ChipState::Restarted => faults.time_out |= bit,
        }
    }
}

/// The accelerometer's place among the channels of an axis.
pub(crate) const ACCELERATION_CHANNEL: usize = 3;

/// The chips of a board.
pub struct Sensors<L, C: SpiDevice, A: SpiDevice, X: SpiDevice> {
    latch: L,
    counters: [Option<Watched<Ls7366r<C>>>; COUNTERS],
    converter: Watched<Ads131m04<A>>,
    accelerometers: [Option<Watched<Adxl355<X>>>; ACCELEROMETERS],
    /// Of each counter, the beginning from which it counts as the rig wants it: the first that was
    /// seen, or the last before its index.
    referenced: [Option<u32>; COUNTERS],
    /// Whose turn it is to show its status.
    turn: usize,
}

impl<L: SpiDevice, C: SpiDevice, A: SpiDevice, X: SpiDevice> Sensors<L, C, A, X> {
    /// The chips behind their chip selects; `latch` selects all counters at once. Nothing is sent
    /// yet: the first [`Sensors::acquire`] begins to set the chips up.
    pub fn new(
        wiring: &Wiring,
        latch: L,
        counters: [C; COUNTERS],
        converter: A,
        accelerometers: [X; ACCELEROMETERS],
    ) -> Self {
        let mut settings = wiring.counters.into_iter();
        let counters = counters.map(|bus| {
            let settings = settings.next().flatten();
            settings.map(|settings| Watched::new(Ls7366r::new(bus, settings)))
        });
        let mut settings = wiring.accelerometers.into_iter();
        let accelerometers = accelerometers.map(|bus| {
            let settings = settings.next().flatten();
            settings.map(|settings| Watched::new(Adxl355::new(bus, settings)))
        });
        Self {
            latch,
            counters,
            converter: Watched::new(Ads131m04::new(converter, wiring.converter)),
            accelerometers,
            referenced: [None; COUNTERS],
            turn: 0,
        }
    }

    /// How often counter `place` began anew at its start count; what it counted before is lost
    /// then.
    pub fn counter_restarts(&self, place: usize) -> u32 {
        let counter = self.counters.get(place).and_then(Option::as_ref);
        counter.map_or(0, Watched::restarts)
    }

    /// Reads every chip that is wired, once, and sorts their codes into the chain's sample.
    pub fn acquire(&mut self, wiring: &Wiring) -> Acquired {
        let mut acquired = Acquired::default();
        let latched = self.latch.transfer_in_place(&mut [LOAD_OTR]);

        let bridges: Visit<[i32; CHANNELS]> = self.converter.visit();
        acquired.readings.channels = bridges.value;
        acquired.saturated_channels = bridges.saturated;
        if let Some(place) = acquired.health.get_mut(CONVERTER) {
            *place = bridges.health;
        }
        let accelerometers = self.accelerometers.iter_mut();
        let healths = acquired.health.iter_mut().skip(CONVERTER + 1);
        let places = acquired.readings.accelerations.iter_mut();
        let places = places.zip(&mut acquired.saturated_directions);
        for ((chip, health), (codes, saturated)) in accelerometers.zip(healths).zip(places) {
            if let Some(chip) = chip {
                let visit: Visit<[i32; DIRECTIONS]> = chip.visit();
                (*codes, *saturated, *health) = (visit.value, visit.saturated, visit.health);
            }
        }
        let places = acquired.readings.counters.iter_mut();
        let places = places.zip(&mut acquired.health).zip(&mut self.referenced);
        let counters = self.counters.iter_mut().zip(places);
        for (number, (counter, ((count, health), referenced))) in counters.enumerate() {
            if let Some(counter) = counter {
                let its_turn = number == self.turn;
                let index;
                (*count, *health, index) = read_counter(counter, latched.is_ok(), its_turn);
                // A counter that ran on while the controller restarted was not set up from nothing
                // even once.
                let runs = referenced.is_none() && *health == ChipState::Ok;
                if index || runs {
                    *referenced = Some(counter.restarts());
                }
                let is_lost = referenced.is_some_and(|known| counter.restarts() > known);
                acquired.lost_references |= u8::from(is_lost) << (number & 7);
            }
        }
        self.turn = if self.turn + 1 < COUNTERS {
            self.turn + 1
        } else {
            0
        };
        acquired.sample = wiring.raw_sample(&acquired.readings);
        acquired
    }
}

/// One counter: its latched count, or the last good one when there was no latch; its status when it
/// is its turn, and whether that says that an index came.
fn read_counter<C: SpiDevice>(
    counter: &mut Watched<Ls7366r<C>>,
    latched: bool,
    its_turn: bool,
) -> (i32, ChipState, bool) {
    if !counter.is_running() {
        let visit = counter.visit();
        return (visit.value, visit.health, false);
    }
    if !latched {
        // Its latch holds the sample before: that is what the caller gets, marked as a failure.
        counter.report(ChipState::Bus);
        return (counter.last(), ChipState::Bus, false);
    }
    let mut index = false;
    if its_turn {
        match counter.sensor_mut().check_status() {
            Ok(seen) => index = seen,
            Err(fault) => {
                let health = ChipState::of(&fault);
                counter.report(health);
                return (counter.last(), health, false);
            }
        }
    }
    let visit = counter.visit();
    (visit.value, visit.health, index)
}

#[cfg(test)]
mod chips;
#[cfg(test)]
mod tests;
