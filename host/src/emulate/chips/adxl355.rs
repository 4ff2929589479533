//! ADXL355: the accelerometer, from Analog Devices' "ADXL354/ADXL355 Data Sheet".
//!
//! The first byte of a chip select is the address times two, plus one to read; the bytes after it
//! go to or come from the addresses that follow. Results are 20 bits, left-justified in three
//! bytes.

use super::{Chip, UNDRIVEN};

/// Directions that the accelerometer measures: x, y, z.
pub const DIRECTIONS: usize = 3;
/// Codes per g in the finest unit, that of the ±2.048 g range; each wider range halves it.
pub const RANGES: u8 = 3;

const REGISTERS: usize = 0x30;
// Addresses, table "Register Map".
const STATUS: usize = 0x04;
const FIFO_ENTRIES: usize = 0x05;
const TEMPERATURE: usize = 0x06;
const DATA: usize = 0x08;
const FILTER: usize = 0x28;
const FIFO_SAMPLES: usize = 0x29;
const RANGE: usize = 0x2C;
const POWER_CTL: usize = 0x2D;
const RESET: usize = 0x2F;
/// The first register that can be written.
const WRITABLE: usize = 0x1E;

/// Entries of the FIFO, one per direction.
const FIFO_DEPTH: u8 = 96;
/// The temperature's code at 25 °C, 12 bits.
const TEMPERATURE_CODE: [u8; 2] = 1885_u16.to_be_bytes();

// STATUS.
const DATA_READY: u8 = 0x01;
const FIFO_FULL: u8 = 0x02;
const FIFO_OVERRUN: u8 = 0x04;
const NVM_BUSY: u8 = 0x10;

/// The accelerometer and what it feels.
#[derive(Clone, Debug)]
pub struct Adxl355 {
    registers: [u8; REGISTERS],
    codes: [i32; DIRECTIONS],
    /// Entries that nobody took out.
    waiting: u8,
    part: u8,
}

impl Default for Adxl355 {
    fn default() -> Self {
        let mut chip = Self {
            registers: [0; REGISTERS],
            codes: [0; DIRECTIONS],
            waiting: 0,
            part: 0xED,
        };
        chip.power_on();
        chip
    }
}

impl Adxl355 {
    /// Makes it a chip with another PARTID; its supply comes on.
    pub fn replaced(&mut self, part: u8) {
        self.part = part;
        self.power_on();
    }

    /// Results per second: 4000, halved by each step of FILTER.
    pub fn rate_hz(&self) -> f64 {
        4000.0 / f64::from(1_u32 << (self.registers[FILTER] & 0x0F).min(10))
    }

    /// A result is ready; accelerations in codes of the ±2.048 g range.
    pub fn measure(&mut self, accelerations: [i64; DIRECTIONS]) {
        // Whatever it was busy with after its reset is done by now.
        self.registers[STATUS] &= !NVM_BUSY;
        if self.registers[POWER_CTL] & 1 == 1 {
            return;
        }
        let coarser = (self.registers[RANGE] & 3).max(1) - 1;
        for (code, input) in self.codes.iter_mut().zip(accelerations) {
            *code = (input >> coarser).clamp(-(1 << 19), (1 << 19) - 1) as i32;
        }
        self.registers[STATUS] |= DATA_READY;
        if self.waiting + DIRECTIONS as u8 > FIFO_DEPTH {
            self.registers[STATUS] |= FIFO_OVERRUN;
        } else {
            self.waiting += DIRECTIONS as u8;
        }
        if self.waiting >= self.registers[FIFO_SAMPLES] {
            self.registers[STATUS] |= FIFO_FULL;
        }
    }

    fn read(&mut self, address: usize) -> u8 {
        match address {
            FIFO_ENTRIES => self.waiting,
            TEMPERATURE | 0x07 => TEMPERATURE_CODE[address - TEMPERATURE],
            DATA..0x11 => {
                let direction = (address - DATA) / 3;
                let bytes = (self.codes[direction] << 4).to_be_bytes();
                if address == 0x10 {
                    self.registers[STATUS] &= !DATA_READY;
                }
                bytes[1 + (address - DATA) % 3]
            }
            // Write only.
            RESET => 0,
            address => self.registers.get(address).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, address: usize, value: u8) {
        match address {
            RESET if value == 0x52 => self.power_on(),
            RESET => {}
            WRITABLE..RESET => self.registers[address] = value,
            _ => {}
        }
    }
}

impl Chip for Adxl355 {
    fn select(&mut self, bytes: &mut [u8]) {
        let Some((head, rest)) = bytes.split_first_mut() else {
            return;
        };
        let (reads, first) = (*head & 1 == 1, usize::from(*head >> 1));
        *head = UNDRIVEN;
        for (address, byte) in (first..).zip(rest) {
            if reads {
                *byte = self.read(address);
            } else {
                self.write(address, *byte);
                *byte = UNDRIVEN;
            }
        }
    }

    fn power_on(&mut self) {
        self.registers = [0; REGISTERS];
        self.registers[..4].copy_from_slice(&[0xAD, 0x1D, self.part, 0x01]);
        self.registers[STATUS] = NVM_BUSY;
        self.registers[FIFO_SAMPLES] = 0x60;
        self.registers[RANGE] = 0x81;
        self.registers[POWER_CTL] = 0x01;
        self.codes = [0; DIRECTIONS];
        self.waiting = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(chip: &mut Adxl355, address: u8, count: usize) -> Vec<u8> {
        let mut bytes = vec![address << 1 | 1];
        bytes.resize(1 + count, 0);
        chip.select(&mut bytes);
        bytes[1..].to_vec()
    }

    fn write(chip: &mut Adxl355, address: u8, value: u8) {
        chip.select(&mut [address << 1, value]);
    }

    #[test]
    fn begins_in_standby_with_its_identity() {
        let mut chip = Adxl355::default();
        assert_eq!(read(&mut chip, 0, 5), [0xAD, 0x1D, 0xED, 0x01, 0x10]);
        chip.measure([1; 3]);
        assert_eq!(read(&mut chip, 4, 1), [0], "nothing in standby");
        assert_eq!(read(&mut chip, 0x28, 6), [0, 0x60, 0, 0, 0x81, 0x01]);
        write(&mut chip, 0, 7);
        assert_eq!(read(&mut chip, 0, 1), [0xAD], "read only");
    }

    #[test]
    fn results_are_twenty_bits_in_the_range_that_was_set() {
        let mut chip = Adxl355::default();
        write(&mut chip, 0x2D, 0);
        for (range, codes) in [
            (1, [8, -8, (1 << 19) - 1]),
            (2, [4, -4, 1 << 18]),
            (3, [2, -2, 1 << 17]),
        ] {
            write(&mut chip, 0x2C, 0x80 | range);
            chip.measure([8, -8, 1 << 19]);
            let bytes = read(&mut chip, 8, 9);
            for (direction, code) in codes.into_iter().enumerate() {
                let word = &bytes[3 * direction..];
                let seen = i32::from_be_bytes([word[0], word[1], word[2], 0]) >> 12;
                assert_eq!(seen, code, "range {range}");
            }
        }
    }

    #[test]
    fn a_result_is_new_until_it_was_read() {
        let mut chip = Adxl355::default();
        write(&mut chip, 0x2D, 0);
        chip.measure([0; 3]);
        assert_eq!(read(&mut chip, 4, 13)[..4], [1, 3, 0x07, 0x5D]);
        assert_eq!(read(&mut chip, 4, 1), [0]);
        for _ in 0..40 {
            chip.measure([0; 3]);
        }
        assert_eq!(read(&mut chip, 4, 2), [7, 96], "full and overrun");
        write(&mut chip, 0x2F, 0x51);
        assert_eq!(read(&mut chip, 0x2D, 1), [0], "not the reset code");
        write(&mut chip, 0x2F, 0x52);
        assert_eq!(read(&mut chip, 4, 2), [0x10, 0]);
        assert_eq!(read(&mut chip, 0x2D, 1), [1]);
    }

    #[test]
    fn the_filter_says_how_often_there_is_a_result() {
        let mut chip = Adxl355::default();
        for (filter, hz) in [(0, 4000.0), (1, 2000.0), (10, 3.90625), (15, 3.90625)] {
            write(&mut chip, 0x28, filter);
            assert_eq!(chip.rate_hz(), hz);
        }
    }
}
