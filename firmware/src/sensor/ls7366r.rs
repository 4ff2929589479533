//! LS7366R: a 32-bit counter for one quadrature encoder, read through a latch so that several give one instant.
//!
//! LSI/CSI, "LS7366R 32-bit quadrature counter with serial interface". SPI mode 0, most significant bit first; every
//! instruction is a chip select of its own. The chip has no identity register: a count that is written through its data
//! register and comes back through its latch takes the place of one.

use super::{Fault, Found, Reading, Sensor};
use embedded_hal::spi::SpiDevice;
use jointwatch_shared::wiring::Counter;

// Instruction byte: operation in bits 7–6 (00 clear, 01 read, 10 write, 11 load), register in bits 5–3 (001 MDR0,
// 010 MDR1, 011 DTR, 100 CNTR, 101 OTR, 110 STR). Datasheet, "IR" (instruction register).
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
/// Counter into latch. Some published code sends 0xE4 for it, which by the datasheet's bits loads the counter.
pub const LOAD_OTR: u8 = 0xE8;

// MDR0, datasheet "MDR0": bits 1–0 counts per cycle (01 one, 10 two, 11 four), bits 3–2 = 00 free running, bits 5–4
// index (00 unused, 01 loads the counter from the data register), bit 6 = 0 asynchronous index, bit 7 = 0 filter clock ÷ 1.
const MDR0_INDEX_LOADS_COUNTER: u8 = 0x10;
/// MDR1, datasheet "MDR1": four bytes, counting enabled, no flags on the pins.
const MDR1_FOUR_BYTES: u8 = 0x00;
// STR, datasheet "STR": bit 3 counting is enabled, bit 2 power was lost since it was cleared.
const STR_ENABLED: u8 = 0x08;
const STR_POWER_LOST: u8 = 0x04;

/// What is written to the counter to see whether it comes back; neither half is what an undriven line reads.
const PATTERN: i32 = 0x5A3C_C3A5;
/// An encoder may move between the two.
const PATTERN_MAY_MOVE: u32 = 1 << 16;

/// One counter on its own chip select.
pub struct Ls7366r<S> {
    bus: S,
    settings: Counter,
}

impl<S: SpiDevice> Ls7366r<S> {
    /// The counter behind `bus`; nothing is sent yet.
    pub fn new(bus: S, settings: Counter) -> Self {
        Self { bus, settings }
    }

    fn instruct(&mut self, instruction: u8) -> Result<(), Fault<S::Error>> {
        self.bus
            .transfer_in_place(&mut [instruction])
            .map_err(Fault::Bus)
    }

    fn read_byte(&mut self, instruction: u8) -> Result<u8, Fault<S::Error>> {
        let mut bytes = [instruction, 0];
        self.bus.transfer_in_place(&mut bytes).map_err(Fault::Bus)?;
        let [_, value] = bytes;
        Ok(value)
    }

    fn write_byte(&mut self, instruction: u8, value: u8) -> Result<(), Fault<S::Error>> {
        self.bus
            .transfer_in_place(&mut [instruction, value])
            .map_err(Fault::Bus)
    }

    /// Sets the count.
    fn load(&mut self, count: i32) -> Result<(), Fault<S::Error>> {
        let [a, b, c, d] = count.to_be_bytes();
        self.bus
            .transfer_in_place(&mut [WRITE_DTR, a, b, c, d])
            .map_err(Fault::Bus)?;
        self.instruct(LOAD_CNTR)
    }

    fn latched(&mut self) -> Result<i32, Fault<S::Error>> {
        let mut bytes = [READ_OTR, 0, 0, 0, 0];
        self.bus.transfer_in_place(&mut bytes).map_err(Fault::Bus)?;
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

    fn expect(&mut self, register: u8, wanted: u8) -> Result<(), Fault<S::Error>> {
        let seen = self.read_byte(register)?;
        if seen == wanted {
            Ok(())
        } else {
            Err(Fault::ConfigNotKept {
                register,
                seen: seen.into(),
                wanted: wanted.into(),
            })
        }
    }

    /// Whether the counter still has its supply and counts; two bytes on the bus.
    ///
    /// # Errors
    /// [`Fault::Restarted`] when it lost its supply (so does a line that reads ones), [`Fault::ConfigNotKept`] when it
    /// does not count (so does a line that reads zeros).
    pub fn check_status(&mut self) -> Result<(), Fault<S::Error>> {
        let status = self.read_byte(READ_STR)?;
        if status & STR_POWER_LOST != 0 {
            return Err(Fault::Restarted);
        }
        if status & STR_ENABLED == 0 {
            return Err(Fault::ConfigNotKept {
                register: READ_STR,
                seen: status.into(),
                wanted: (status | STR_ENABLED).into(),
            });
        }
        Ok(())
    }
}

impl<S: SpiDevice> Sensor for Ls7366r<S> {
    type Error = S::Error;
    type Value = i32;

    /// The chip has no reset; there is nothing to send.
    fn restart(&mut self) -> Result<(), Fault<S::Error>> {
        Ok(())
    }

    /// A counter that has its settings and never lost its supply keeps its count: only the bus was at fault then.
    fn set_up(&mut self) -> Result<Found, Fault<S::Error>> {
        let mode = self.mode();
        let kept = [
            self.read_byte(READ_MDR0)?,
            self.read_byte(READ_MDR1)?,
            self.read_byte(READ_STR)? & (STR_POWER_LOST | STR_ENABLED),
        ];
        if kept == [mode, MDR1_FOUR_BYTES, STR_ENABLED] {
            return Ok(Found::Kept);
        }
        self.write_byte(WRITE_MDR1, MDR1_FOUR_BYTES)?;
        // Without the index until the start count is in place.
        self.write_byte(WRITE_MDR0, mode & !MDR0_INDEX_LOADS_COUNTER)?;
        self.load(PATTERN)?;
        self.instruct(LOAD_OTR)?;
        let seen = self.latched()?;
        if seen.wrapping_sub(PATTERN).unsigned_abs() > PATTERN_MAY_MOVE {
            return Err(Fault::WrongIdentity {
                seen: seen as u32,
                wanted: PATTERN as u32,
            });
        }
        self.load(self.settings.start)?;
        self.write_byte(WRITE_MDR0, mode)?;
        self.instruct(CLEAR_STR)?;
        self.expect(READ_MDR0, mode)?;
        self.expect(READ_MDR1, MDR1_FOUR_BYTES)?;
        self.check_status()?;
        Ok(Found::Fresh)
    }

    /// The count at the last latch ([`LOAD_OTR`]); a free-running counter wraps, so it is never at a rail.
    fn read(&mut self) -> Result<Reading<i32>, Fault<S::Error>> {
        Ok(Reading {
            value: self.latched()?,
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

    /// A chip at power-on, which moves three counts while it is set up.
    fn power_on() -> Vec<Exchange> {
        vec![
            answered(0x48, &[0]),
            answered(0x50, &[0]),
            answered(0x70, &[0x0C]),
            sent(&[0x90, 0x00]),
            sent(&[0x88, 0x03]),
            sent(&[0x98, 0x5A, 0x3C, 0xC3, 0xA5]),
            sent(&[0xE0]),
            sent(&[0xE8]),
            answered(0x68, &[0x5A, 0x3C, 0xC3, 0xA8]),
            sent(&[0x98, 0xFF, 0xFF, 0xFC, 0x18]),
            sent(&[0xE0]),
            sent(&[0x88, 0x13]),
            sent(&[0x30]),
            answered(0x48, &[0x13]),
            answered(0x50, &[0x00]),
            answered(0x70, &[0x08]),
        ]
    }

    fn set_up(exchanges: &[Exchange]) -> Result<Found, Fault<embedded_hal::spi::ErrorKind>> {
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
        let script = [
            answered(0x48, &[0x13]),
            answered(0x50, &[0x00]),
            // Sign and direction bits besides.
            answered(0x70, &[0x0B]),
        ];
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
    fn no_chip_and_a_wrong_one_are_told() {
        for line in [0x00, 0xFF] {
            let mut script = power_on();
            for exchange in &mut script {
                exchange.1.fill(line);
            }
            script.truncate(9);
            let seen = u32::from_be_bytes([line; 4]);
            let wanted = 0x5A3C_C3A5;
            assert_eq!(set_up(&script), Err(Fault::WrongIdentity { seen, wanted }));
        }
    }

    #[test]
    fn every_register_that_is_not_kept_is_named() {
        for (at, register, wanted) in [(13, READ_MDR0, 0x13), (14, READ_MDR1, 0)] {
            let mut script = power_on();
            script[at].1[1] ^= 0x40;
            script.truncate(at + 1);
            let fault = Fault::ConfigNotKept {
                register,
                seen: wanted ^ 0x40,
                wanted,
            };
            assert_eq!(set_up(&script), Err(fault));
        }
        let mut script = power_on();
        script[15].1[1] = 0x0C;
        assert_eq!(set_up(&script), Err(Fault::Restarted));
        script[15].1[1] = 0x01;
        let fault = Fault::ConfigNotKept {
            register: READ_STR,
            seen: 0x01,
            wanted: 0x09,
        };
        assert_eq!(set_up(&script), Err(fault));
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
