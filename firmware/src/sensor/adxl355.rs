//! ADXL355: a three-axis accelerometer of low noise with 20-bit codes.
//!
//! Analog Devices, "ADXL354/ADXL355 Data Sheet", section "Register Map". SPI mode 0; the first byte
//! is the register's address times two, plus one for reading; further bytes follow at the next
//! addresses (section "SPI Protocol").

use super::{ChipFault, Found, Reading, Sensor, at_rails, kept};
use embedded_hal::spi::SpiDevice;
use jointwatch_shared::wire::wiring::{Accelerometer, DIRECTIONS};

// Addresses, table "Register Map".
const DEVID_AD: u8 = 0x00;
const STATUS: u8 = 0x04;
const FILTER: u8 = 0x28;
const SYNC: u8 = 0x2B;
const RANGE: u8 = 0x2C;
const POWER_CTL: u8 = 0x2D;
const RESET: u8 = 0x2F;

/// DEVID_AD (Analog Devices), DEVID_MST (MEMS) and PARTID (355 in octal).
const IDENTITY: [u8; 3] = [0xAD, 0x1D, 0xED];
/// Resets the chip when written to RESET.
const RESET_CODE: u8 = 0x52;
/// RANGE, bit 7: the reset value, which concerns I²C only.
const RANGE_RESET: u8 = 0x80;
/// SYNC, bits 1–0 = 10: external sync, with interpolation to the instant of the sync pulse.
const SYNC_EXTERNAL: u8 = 0x02;
// POWER_CTL, bit 0: standby.
const STANDBY: u8 = 0x01;
const MEASURE: u8 = 0x00;
// STATUS.
const NVM_BUSY: u8 = 1 << 4;
const DATA_READY: u8 = 1;

/// The lowest and the highest of 20 bits.
const RAILS: [i32; 2] = [-(1 << 19), (1 << 19) - 1];

/// One accelerometer on its chip select.
pub struct Adxl355<S> {
    bus: S,
    settings: Accelerometer,
}

impl<S: SpiDevice> Adxl355<S> {
    /// The accelerometer behind `bus`; nothing is sent yet.
    pub fn new(bus: S, settings: Accelerometer) -> Self {
        Self { bus, settings }
    }

    /// Reads from `register` on, in one go.
    fn registers<const COUNT: usize>(
        &mut self,
        register: u8,
    ) -> Result<[u8; COUNT], ChipFault<S::Error>> {
        // No more than 13 registers are read at once.
        let mut bytes = [0; 14];
        bytes[0] = register << 1 | 1;
        let used = bytes.get_mut(..=COUNT).ok_or(ChipFault::NotReady)?;
        self.bus.transfer_in_place(used).map_err(ChipFault::Bus)?;
        let [_, read @ ..] = bytes;
        read.first_chunk().copied().ok_or(ChipFault::NotReady)
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), ChipFault<S::Error>> {
        self.bus
            .transfer_in_place(&mut [register << 1, value])
            .map_err(ChipFault::Bus)
    }
}

impl<S: SpiDevice> Sensor for Adxl355<S> {
    type Error = S::Error;
    type Value = [i32; DIRECTIONS];

    fn restart(&mut self) -> Result<(), ChipFault<S::Error>> {
        self.write(RESET, RESET_CODE)
    }

    fn set_up(&mut self) -> Result<Found, ChipFault<S::Error>> {
        let seen: [u8; 3] = self.registers(DEVID_AD)?;
        if seen != IDENTITY {
            let number = |[a, b, c]: [u8; 3]| u32::from_be_bytes([0, a, b, c]);
            return Err(ChipFault::WrongIdentity {
                seen: number(seen),
                wanted: number(IDENTITY),
            });
        }
        let [status] = self.registers(STATUS)?;
        if status & NVM_BUSY != 0 {
            return Err(ChipFault::NotReady);
        }
        let sync = if self.settings.external_sync {
            SYNC_EXTERNAL
        } else {
            0
        };
        let settings = [
            (FILTER, self.settings.filter & 0x0F),
            (SYNC, sync),
            (RANGE, RANGE_RESET | self.settings.range & 3),
            (POWER_CTL, MEASURE),
        ];
        // Settings may only change in standby; the one that ends it comes last.
        self.write(POWER_CTL, STANDBY)?;
        for (register, value) in settings {
            self.write(register, value)?;
        }
        for (register, wanted) in settings {
            let [seen] = self.registers(register)?;
            kept(register, seen.into(), wanted.into())?;
        }
        Ok(Found::Fresh)
    }

    /// Status and all three directions in one go, so that they belong to one sample.
    ///
    /// A chip that was reset stands still in standby: it has nothing new, for ever.
    fn read(&mut self) -> Result<Reading<[i32; DIRECTIONS]>, ChipFault<S::Error>> {
        // Status, FIFO entries, two bytes of temperature, then three bytes for each direction.
        let [status, _, _, _, codes @ ..]: [u8; 13] = self.registers(STATUS)?;
        if status & NVM_BUSY != 0 {
            return Err(ChipFault::NotReady);
        }
        let (codes, _) = codes.as_chunks::<3>();
        let mut value = [0; DIRECTIONS];
        for (place, &[high, middle, low]) in value.iter_mut().zip(codes) {
            // 20 bits, left-justified in 24; the lowest four are reserved.
            *place = i32::from_be_bytes([high, middle, low, 0]) >> 12;
        }
        let [least, most] = RAILS;
        Ok(Reading {
            value,
            saturated: at_rails(&value, least, most),
            fresh: status & DATA_READY != 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::script::{Exchange, Scripted, with_every_bus_failure};
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const SETTINGS: Accelerometer = Accelerometer {
        range: 2,
        filter: 1,
        external_sync: true,
    };

    fn written(register: u8, value: u8) -> Exchange {
        (vec![register * 2, value], vec![0; 2])
    }

    fn asked(register: u8, answer: &[u8]) -> Exchange {
        let mut sent = vec![register * 2 + 1];
        sent.resize(1 + answer.len(), 0);
        (sent, [&[0xFF], answer].concat())
    }

    fn after_reset() -> Vec<Exchange> {
        let mut script = vec![asked(0x00, &[0xAD, 0x1D, 0xED]), asked(0x04, &[0x00])];
        let settings = [(0x28, 0x01), (0x2B, 0x02), (0x2C, 0x82), (0x2D, 0x00)];
        script.push(written(0x2D, 0x01));
        script.extend(settings.map(|(register, value)| written(register, value)));
        script.extend(settings.map(|(register, value)| asked(register, &[value])));
        script
    }

    fn set_up(exchanges: &[Exchange]) -> Result<Found, ChipFault<embedded_hal::spi::ErrorKind>> {
        let mut chip = Adxl355::new(Scripted::new(exchanges), SETTINGS);
        let found = chip.set_up();
        chip.bus.done();
        found
    }

    fn read(
        status: u8,
        codes: [u8; 9],
    ) -> Result<Reading<[i32; 3]>, ChipFault<embedded_hal::spi::ErrorKind>> {
        let answer = [&[status, 96, 0x07, 0x5F][..], &codes].concat();
        let mut chip = Adxl355::new(Scripted::new(&[asked(0x04, &answer)]), SETTINGS);
        let reading = chip.read();
        chip.bus.done();
        reading
    }

    #[test]
    fn is_reset_and_set_up_as_the_datasheet_says() {
        let mut chip = Adxl355::new(Scripted::new(&[written(0x2F, 0x52)]), SETTINGS);
        assert_eq!(chip.restart(), Ok(()));
        chip.bus.done();
        assert_eq!(set_up(&after_reset()), Ok(Found::Fresh));
    }

    #[test]
    fn codes_are_twenty_bits_with_a_sign() {
        // 1, −1 with the reserved bits set, and 0x12345.
        let codes = [0x00, 0x00, 0x10, 0xFF, 0xFF, 0xFF, 0x12, 0x34, 0x5A];
        let reading = read(0x07, codes).unwrap();
        let value = [1, -1, 0x1_2345];
        assert_eq!(
            reading,
            Reading {
                value,
                saturated: 0,
                fresh: true
            }
        );
        assert!(!read(0x06, codes).unwrap().fresh);
    }

    #[test]
    fn a_code_at_a_rail_is_passed_on_and_marked() {
        let codes = [0x7F, 0xFF, 0xF0, 0x80, 0x00, 0x10, 0x80, 0x00, 0x00];
        let reading = read(0x01, codes).unwrap();
        assert_eq!(reading.value, [(1 << 19) - 1, -(1 << 19) + 1, -(1 << 19)]);
        assert_eq!(reading.saturated, 0b101);
    }

    #[test]
    fn a_code_that_stands_still_is_passed_on() {
        for _ in 0..3 {
            let reading = read(0x01, [0, 1, 0, 0, 1, 0, 0, 1, 0]).unwrap();
            assert_eq!((reading.value, reading.fresh), ([16; 3], true));
        }
    }

    #[test]
    fn the_bus_may_fail_at_every_exchange() {
        with_every_bus_failure(&after_reset(), |bus| {
            Adxl355::new(&mut *bus, SETTINGS).set_up()
        });
        with_every_bus_failure(&[asked(0x04, &[0; 13])], |bus| {
            Adxl355::new(&mut *bus, SETTINGS).read()
        });
        with_every_bus_failure(&[written(0x2F, 0x52)], |bus| {
            Adxl355::new(&mut *bus, SETTINGS).restart()
        });
    }

    #[test]
    fn another_chip_and_no_chip_are_told() {
        for (identity, seen) in [
            ([0xAD, 0x1D, 0xF2], 0xAD_1DF2),
            ([0x00; 3], 0),
            ([0xFF; 3], 0xFF_FFFF),
        ] {
            let script = [asked(0x00, &identity)];
            let wanted = 0xAD_1DED;
            assert_eq!(
                set_up(&script),
                Err(ChipFault::WrongIdentity { seen, wanted })
            );
        }
    }

    #[test]
    fn every_register_that_is_not_kept_is_named() {
        for (at, register, wanted) in [
            (7, FILTER, 1),
            (8, SYNC, 2),
            (9, RANGE, 0x82),
            (10, POWER_CTL, 0),
        ] {
            let mut script = after_reset();
            script[at].1[1] ^= 0x04;
            script.truncate(at + 1);
            let fault = ChipFault::ConfigNotKept {
                register,
                seen: wanted ^ 0x04,
                wanted,
            };
            assert_eq!(set_up(&script), Err(fault));
        }
    }

    #[test]
    fn a_chip_that_is_starting_and_a_line_of_ones_are_not_ready() {
        let script = [asked(0x00, &IDENTITY), asked(0x04, &[0x10])];
        assert_eq!(set_up(&script), Err(ChipFault::NotReady));
        assert_eq!(read(0xFF, [0xFF; 9]), Err(ChipFault::NotReady));
    }
}
