//! LS7366R: a 32-bit counter for one quadrature encoder, read through a latch so that several give
//! one instant.
//!
//! LSI/CSI, "LS7366R 32-bit quadrature counter with serial interface". SPI mode 0, most significant
//! bit first; every instruction is a chip select of its own. The chip has no identity register: a
//! count that is written through its data register and comes back through its latch takes the place
//! of one.

use super::{ChipFault, Found, Reading, Sensor, kept};
use embedded_hal::spi::SpiDevice;
use jointwatch_shared::wire::wiring::Counter;

// Instruction byte: operation in bits 7–6 (00 clear, 01 read, 10 write, 11 load), register in bits
// 5–3 (001 MDR0, 010 MDR1, 011 DTR, 100 CNTR, 101 OTR, 110 STR). Datasheet, "IR" (instruction
// register).
const CLEAR_STR: u8 = 0x30;
const READ_MDR0: u8 = 0x48;
const READ_MDR1: u8 = 0x50;
const READ_OTR: u8 = 0x68;
const READ_STR: u8 = 0x70;
const WRITE_MDR0: u8 = 0x88;
const WRITE_MDR1: u8 = 0x90;
const WRITE_DTR: u8 = 0x98;
/// Data register into counter.
const LOAD_CNTR: u8 = 0xE0;
/// Counter into latch. Some published code sends 0xE4 for it, which by the datasheet's bits loads
/// the counter.
pub const LOAD_OTR: u8 = 0xE8;

// MDR0, datasheet "MDR0": bits 1–0 counts per cycle (01 one, 10 two, 11 four), bits 3–2 = 00 free
// running, bits 5–4 index (00 unused, 01 loads the counter from the data register), bit 6 = 0
// asynchronous index, bit 7 = 0 filter clock ÷ 1.
const MDR0_INDEX_LOADS_COUNTER: u8 = 0x10;
/// MDR1, datasheet "MDR1": four bytes, counting enabled, no flags on the pins.
const MDR1_FOUR_BYTES: u8 = 0x00;
/// The same with counting disabled (bit 2): while the counter is set up, so that one whose set-up
/// did not end shows it.
const MDR1_STANDS_STILL: u8 = 0x04;
// STR, datasheet "STR": bit 4 an index came, bit 3 counting is enabled, bit 2 power was lost since
// it was cleared.
const STR_INDEX: u8 = 0x10;
const STR_ENABLED: u8 = 0x08;
const STR_POWER_LOST: u8 = 0x04;

/// What is written to the counter to see whether it comes back; neither half is what an undriven
/// line reads.
const PATTERN: i32 = 0x5A3C_C3A5;
/// What a line reads that nothing drives, besides zeros. No register of a counter in use holds it.
const UNDRIVEN: u8 = 0xFF;

/// One counter on its own chip select.
pub struct Ls7366r<S> {
    bus: S,
    settings: Counter,
    /// Its count was written over, and the set-up has not ended.
    begun_anew: bool,
}

impl<S: SpiDevice> Ls7366r<S> {
    /// The counter behind `bus`; nothing is sent yet.
    pub fn new(bus: S, settings: Counter) -> Self {
        Self {
            bus,
            settings,
            begun_anew: false,
        }
    }

    fn instruct(&mut self, instruction: u8) -> Result<(), ChipFault<S::Error>> {
        self.bus
            .transfer_in_place(&mut [instruction])
            .map_err(ChipFault::Bus)
    }

    fn read_byte(&mut self, instruction: u8) -> Result<u8, ChipFault<S::Error>> {
        let mut bytes = [instruction, 0];
        self.bus
            .transfer_in_place(&mut bytes)
            .map_err(ChipFault::Bus)?;
        let [_, value] = bytes;
        Ok(value)
    }

    fn write_byte(&mut self, instruction: u8, value: u8) -> Result<(), ChipFault<S::Error>> {
        self.bus
            .transfer_in_place(&mut [instruction, value])
            .map_err(ChipFault::Bus)
    }

    /// Sets the count, and sees whether it comes back through the latch. The counter must stand
    /// still.
    fn load(&mut self, count: i32) -> Result<(), ChipFault<S::Error>> {
        let [a, b, c, d] = count.to_be_bytes();
        self.bus
            .transfer_in_place(&mut [WRITE_DTR, a, b, c, d])
            .map_err(ChipFault::Bus)?;
        self.instruct(LOAD_CNTR)?;
        self.instruct(LOAD_OTR)?;
        let seen = self.latched()?;
        if seen == count {
            Ok(())
        } else {
            Err(nobody(seen as u32))
        }
    }

    fn latched(&mut self) -> Result<i32, ChipFault<S::Error>> {
        let mut bytes = [READ_OTR, 0, 0, 0, 0];
        self.bus
            .transfer_in_place(&mut bytes)
            .map_err(ChipFault::Bus)?;
        let [_, count @ ..] = bytes;
        Ok(i32::from_be_bytes(count))
    }

    /// MDR0 as the settings ask for it.
    fn mode(&self) -> u8 {
        let counts = match self.settings.quadrature {
            1 => 0b01,
            2 => 0b10,
            _ => 0b11,
        };
        let index = if self.settings.index {
            MDR0_INDEX_LOADS_COUNTER
        } else {
            0
        };
        counts | index
    }

    /// Writes a register and reads it back.
    fn set(&mut self, [write, read]: [u8; 2], value: u8) -> Result<(), ChipFault<S::Error>> {
        self.write_byte(write, value)?;
        kept(read, self.read_byte(read)?.into(), value.into())
    }

    /// Both modes, and of the status whether it counts and kept its supply.
    fn registers(&mut self) -> Result<[u8; 3], ChipFault<S::Error>> {
        let (mdr0, mdr1) = (self.read_byte(READ_MDR0)?, self.read_byte(READ_MDR1)?);
        let status = self.read_byte(READ_STR)?;
        let undriven = [mdr0, mdr1, status].contains(&UNDRIVEN);
        if undriven || mdr1 | status == 0 {
            return Err(nobody(status.into()));
        }
        Ok([mdr0, mdr1, status & (STR_POWER_LOST | STR_ENABLED)])
    }

    /// Whether the counter still has its supply and counts; two bytes on the bus. True when an
    /// index came since the set-up and loaded the start count.
    ///
    /// # Errors
    /// [`ChipFault::WrongIdentity`] when nothing answers, [`ChipFault::Restarted`] when it lost its
    /// supply, [`ChipFault::ConfigNotKept`] when it does not count.
    pub fn check_status(&mut self) -> Result<bool, ChipFault<S::Error>> {
        let status = self.read_byte(READ_STR)?;
        if status == UNDRIVEN || status == 0 {
            return Err(nobody(status.into()));
        }
        if status & STR_POWER_LOST != 0 {
            return Err(ChipFault::Restarted);
        }
        kept(READ_STR, status.into(), (status | STR_ENABLED).into())?;
        Ok(self.settings.index && status & STR_INDEX != 0)
    }
}

/// What comes instead of a count when no counter is there, or does not hear.
fn nobody<E>(seen: u32) -> ChipFault<E> {
    ChipFault::WrongIdentity {
        seen,
        wanted: PATTERN as u32,
    }
}

impl<S: SpiDevice> Sensor for Ls7366r<S> {
    type Error = S::Error;
    type Value = i32;

    /// The chip has no reset; there is nothing to send.
    fn restart(&mut self) -> Result<(), ChipFault<S::Error>> {
        Ok(())
    }

    /// A counter that has its settings and never lost its supply keeps its count: only the bus was
    /// at fault then. So its count is written over only when two looks agree that it is not so,
    /// and what was written to a mode register comes back; a transfer that is lost or damaged
    /// costs a try, and never a count.
    fn set_up(&mut self) -> Result<Found, ChipFault<S::Error>> {
        let mode = self.mode();
        let seen = self.registers()?;
        if self.registers()? != seen {
            return Err(ChipFault::NotUnderstood);
        }
        if seen != [mode, MDR1_FOUR_BYTES, STR_ENABLED] {
            self.set([WRITE_MDR0, READ_MDR0], mode)?;
            self.set([WRITE_MDR1, READ_MDR1], MDR1_STANDS_STILL)?;
            self.begun_anew = true;
            self.load(PATTERN)?;
            self.load(self.settings.start)?;
            self.instruct(CLEAR_STR)?;
            if self.read_byte(READ_STR)? & STR_POWER_LOST != 0 {
                return Err(ChipFault::Restarted);
            }
            self.set([WRITE_MDR1, READ_MDR1], MDR1_FOUR_BYTES)?;
            self.check_status()?;
        }
        Ok(if core::mem::take(&mut self.begun_anew) {
            Found::Fresh
        } else {
            Found::Kept
        })
    }

    /// The count at the last latch ([`LOAD_OTR`]); a free-running counter wraps, so it is never at
    /// a rail.
    fn read(&mut self) -> Result<Reading<i32>, ChipFault<S::Error>> {
        let mut value = self.latched()?;
        if value == 0 || value == -1 {
            // So does a line read that nothing drives.
            self.check_status()?;
            value = self.latched()?;
        }
        Ok(Reading {
            value,
            saturated: 0,
            fresh: true,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::script::{Exchange, Scripted, with_every_bus_failure};
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const SETTINGS: Counter = Counter {
        quadrature: 4,
        start: -1000,
        index: true,
    };

    fn sent(bytes: &[u8]) -> Exchange {
        (bytes.to_vec(), vec![0; bytes.len()])
    }

    fn answered(instruction: u8, answer: &[u8]) -> Exchange {
        let mut sent = vec![instruction];
        sent.resize(1 + answer.len(), 0);
        (sent, [&[0], answer].concat())
    }

    /// A chip at power-on.
    fn power_on() -> Vec<Exchange> {
        let look = [
            answered(0x48, &[0]),
            answered(0x50, &[0]),
            answered(0x70, &[0x0C]),
        ];
        let anew = [
            sent(&[0x88, 0x13]),
            answered(0x48, &[0x13]),
            sent(&[0x90, 0x04]),
            answered(0x50, &[0x04]),
            sent(&[0x98, 0x5A, 0x3C, 0xC3, 0xA5]),
            sent(&[0xE0]),
            sent(&[0xE8]),
            answered(0x68, &[0x5A, 0x3C, 0xC3, 0xA5]),
            sent(&[0x98, 0xFF, 0xFF, 0xFC, 0x18]),
            sent(&[0xE0]),
            sent(&[0xE8]),
            answered(0x68, &[0xFF, 0xFF, 0xFC, 0x18]),
            sent(&[0x30]),
            answered(0x70, &[0x00]),
            sent(&[0x90, 0x00]),
            answered(0x50, &[0x00]),
            answered(0x70, &[0x08]),
        ];
        [look.clone().to_vec(), look.to_vec(), anew.to_vec()].concat()
    }

    fn set_up(exchanges: &[Exchange]) -> Result<Found, ChipFault<embedded_hal::spi::ErrorKind>> {
        let mut chip = Ls7366r::new(Scripted::new(exchanges), SETTINGS);
        let found = chip.set_up();
        chip.bus.done();
        found
    }

    #[test]
    fn is_set_up_as_the_datasheet_says_and_read_through_its_latch() {
        assert_eq!(set_up(&power_on()), Ok(Found::Fresh));
        for (bytes, count) in [
            ([0xFF, 0xFF, 0xFF, 0xFE], -2),
            ([0x80, 0, 0, 0], i32::MIN),
            ([0x01, 0x02, 0x03, 0x04], 0x0102_0304),
        ] {
            let script = [answered(0x68, &bytes)];
            let mut chip = Ls7366r::new(Scripted::new(&script), SETTINGS);
            let reading = chip.read().unwrap();
            assert_eq!(
                (reading.value, reading.saturated, reading.fresh),
                (count, 0, true)
            );
            chip.bus.done();
        }
    }

    #[test]
    fn a_count_that_stands_still_is_passed_on() {
        let script = vec![answered(0x68, &[0, 0, 1, 0]); 50];
        let mut chip = Ls7366r::new(Scripted::new(&script), SETTINGS);
        for _ in 0..50 {
            assert_eq!(chip.read().map(|r| r.value), Ok(256));
        }
        chip.bus.done();
    }

    #[test]
    fn a_counter_that_kept_its_supply_keeps_its_count() {
        let mut script = Vec::new();
        // Sign and direction bits besides; it moves meanwhile.
        for status in [0x0B, 0x08] {
            script.push(answered(0x48, &[0x13]));
            script.push(answered(0x50, &[0x00]));
            script.push(answered(0x70, &[status]));
        }
        assert_eq!(set_up(&script), Ok(Found::Kept));
    }

    #[test]
    fn the_bus_may_fail_at_every_exchange() {
        with_every_bus_failure(&power_on(), |bus| {
            Ls7366r::new(&mut *bus, SETTINGS).set_up()
        });
        with_every_bus_failure(&[answered(0x68, &[0; 4])], |bus| {
            Ls7366r::new(&mut *bus, SETTINGS).read()
        });
        with_every_bus_failure(&[answered(0x70, &[0x08])], |bus| {
            Ls7366r::new(&mut *bus, SETTINGS).check_status()
        });
    }

    #[test]
    fn no_chip_is_told_and_its_count_left_alone() {
        for (line, exchanges) in [(0x00, 3), (0xFF, 3)] {
            let mut script = power_on();
            for exchange in &mut script {
                exchange.1.fill(line);
            }
            script.truncate(exchanges);
            let fault = nobody(line.into());
            assert_eq!(set_up(&script), Err(fault));
        }
        // What a line reads that nothing drives is no count, unless the chip answers besides.
        for line in [0x00, 0xFF] {
            let script = [
                answered(0x68, &[line; 4]),
                answered(0x70, &[line]),
                answered(0x68, &[line; 4]),
                answered(0x70, &[0x08]),
                answered(0x68, &[0, 0, 0, 7]),
            ];
            let mut chip = Ls7366r::new(Scripted::new(&script), SETTINGS);
            assert_eq!(chip.read(), Err(nobody(line.into())));
            assert_eq!(chip.read().map(|r| r.value), Ok(7));
            chip.bus.done();
        }
    }

    #[test]
    fn two_looks_that_do_not_agree_change_nothing() {
        for at in 0..6 {
            let mut script = power_on();
            script[at].1[1] ^= 0x04;
            script.truncate(6);
            assert_eq!(set_up(&script), Err(ChipFault::NotUnderstood), "{at}");
        }
    }

    #[test]
    fn whatever_does_not_come_back_ends_the_set_up_where_it_is() {
        let kept = |register, seen, wanted| {
            Err(ChipFault::ConfigNotKept {
                register,
                seen,
                wanted,
            })
        };
        for (at, outcome) in [
            (7, kept(READ_MDR0, 0x53, 0x13)),
            (9, kept(READ_MDR1, 0x44, 0x04)),
            (13, Err(nobody(0x1A3C_C3A5))),
            (17, Err(nobody(0xBFFF_FC18))),
            (21, kept(READ_MDR1, 0x40, 0x00)),
        ] {
            let mut script = power_on();
            script[at].1[1] ^= 0x40;
            script.truncate(at + 1);
            assert_eq!(set_up(&script), outcome, "{at}");
        }
        for (at, status, outcome) in [
            (19, 0x04, Err(ChipFault::Restarted)),
            (22, 0x0C, Err(ChipFault::Restarted)),
            (22, 0x01, kept(READ_STR, 0x01, 0x09)),
        ] {
            let mut script = power_on();
            script[at].1[1] = status;
            script.truncate(at + 1);
            assert_eq!(set_up(&script), outcome, "{at}");
        }
    }

    #[test]
    fn a_set_up_of_which_only_the_end_was_lost_still_began_anew() {
        let mut script = power_on();
        let last = script.last_mut().unwrap();
        last.1[1] = 0xFF;
        for _ in 0..2 {
            script.push(answered(0x48, &[0x13]));
            script.push(answered(0x50, &[0x00]));
            script.push(answered(0x70, &[0x08]));
        }
        let mut chip = Ls7366r::new(Scripted::new(&script), SETTINGS);
        assert_eq!(chip.set_up(), Err(nobody(0xFF)));
        assert_eq!(chip.set_up(), Ok(Found::Fresh));
        chip.bus.done();
    }

    #[test]
    fn the_mode_follows_the_settings() {
        for (quadrature, index, mode) in [
            (1, false, 0x01),
            (2, false, 0x02),
            (4, false, 0x03),
            (2, true, 0x12),
        ] {
            let settings = Counter {
                quadrature,
                index,
                start: 0,
            };
            let chip = Ls7366r::new(Scripted::new(&[]), settings);
            assert_eq!(chip.mode(), mode);
            chip.bus.done();
        }
    }
}
