//! LS7366R: the quadrature counter, from LSI/CSI's datasheet "32-bit quadrature counter with serial
//! interface".
//!
//! An instruction is one chip select: a byte whose bits 7–6 say what to do (clear, read, write,
//! load) and bits 5–3 to which register; then the register's bytes, highest first. Free-running
//! count only: in the other count modes of MDR0 this counter stands still, so that a driver which
//! sets one is found out.

use super::{Chip, UNDRIVEN};

/// Bits 7–6 of an instruction.
#[derive(Clone, Copy, PartialEq)]
enum Operation {
    Clear,
    Read,
    Write,
    Load,
}

// Bits 5–3 of an instruction.
const MDR0: u8 = 1;
const MDR1: u8 = 2;
const DTR: u8 = 3;
const CNTR: u8 = 4;
const OTR: u8 = 5;
const STR: u8 = 6;

// STR, from bit 7 down: carry, borrow, compare, index, count enable, power loss, direction, sign.
const CARRY: u8 = 0x80;
const BORROW: u8 = 0x40;
const COMPARE: u8 = 0x20;
const INDEX: u8 = 0x10;
const COUNT_ENABLE: u8 = 0x08;
const POWER_LOSS: u8 = 0x04;
const UP: u8 = 0x02;
const SIGN: u8 = 0x01;

/// The counter and its encoder.
#[derive(Clone, Debug)]
pub struct Ls7366r {
    mdr0: u8,
    mdr1: u8,
    data: u32,
    count: u32,
    latch: u32,
    /// The latched bits of STR; count enable and sign are live.
    flags: u8,
    /// The encoder's position in quarters of its cycle: edges of its two signals.
    edges: i64,
}

impl Default for Ls7366r {
    fn default() -> Self {
        Self {
            mdr0: 0,
            mdr1: 0,
            data: 0,
            count: 0,
            latch: 0,
            flags: POWER_LOSS,
            edges: 0,
        }
    }
}

impl Ls7366r {
    /// The encoder moves to a position, in quarters of its cycle.
    pub fn turn_to(&mut self, edges: i64) {
        // Edges that one count takes: bits 1–0 of MDR0; 0 is clock and direction, which an encoder
        // is not.
        let per_count = match self.mdr0 & 3 {
            1 => 4,
            2 => 2,
            3 => 1,
            _ => 0,
        };
        let counts = if per_count == 0 {
            0
        } else {
            edges.div_euclid(per_count) - self.edges.div_euclid(per_count)
        };
        self.edges = edges;
        if counts == 0 || !self.counts() {
            return;
        }
        let before = i64::from(self.count);
        let range = i64::from(self.mask()) + 1;
        let after = before + counts;
        self.count = after.rem_euclid(range) as u32;
        self.flags &= !UP;
        if counts > 0 {
            self.flags |= UP;
        }
        if after >= range {
            self.flags |= CARRY;
        }
        if after < 0 {
            self.flags |= BORROW;
        }
        if self.count == self.data & self.mask() {
            self.flags |= COMPARE;
        }
    }

    /// The encoder's index pulse.
    pub fn index_pulse(&mut self) {
        match self.mdr0 >> 4 & 3 {
            0 => return,
            1 => self.count = self.data & self.mask(),
            2 => self.count = 0,
            _ => self.latch = self.count,
        }
        self.flags |= INDEX;
    }

    /// Whether it counts: not disabled in MDR1 (bit 2), and free-running (MDR0, bits 3–2).
    fn counts(&self) -> bool {
        self.mdr1 & 0x04 == 0 && self.mdr0 & 0x0C == 0
    }

    /// Bytes of count, data and latch: MDR1, bits 1–0.
    fn width(&self) -> usize {
        4 - usize::from(self.mdr1 & 3)
    }

    fn mask(&self) -> u32 {
        u32::MAX >> (32 - 8 * self.width())
    }

    fn status(&self) -> u8 {
        let enable = if self.mdr1 & 0x04 == 0 {
            COUNT_ENABLE
        } else {
            0
        };
        let top = self.count >> (8 * self.width() - 1) & 1;
        self.flags | enable | if top == 1 { SIGN } else { 0 }
    }

    /// The register's bytes as they are shifted out.
    fn bytes_of(&self, register: u8) -> Vec<u8> {
        let wide = |value: u32| value.to_be_bytes()[4 - self.width()..].to_vec();
        match register {
            MDR0 => vec![self.mdr0],
            MDR1 => vec![self.mdr1],
            CNTR | OTR => wide(self.latch),
            STR => vec![self.status()],
            _ => Vec::new(),
        }
    }

    fn write(&mut self, register: u8, bytes: &[u8]) {
        match (register, bytes) {
            (MDR0, [value, ..]) => self.mdr0 = *value,
            (MDR1, [value, ..]) => self.mdr1 = *value,
            (DTR, bytes) if bytes.len() >= self.width() => {
                let bytes = &bytes[..self.width()];
                self.data = bytes.iter().fold(0, |word, b| word << 8 | u32::from(*b));
            }
            _ => {}
        }
    }
}

impl Chip for Ls7366r {
    fn select(&mut self, bytes: &mut [u8]) {
        let Some((instruction, rest)) = bytes.split_first_mut() else {
            return;
        };
        let operation = match *instruction >> 6 {
            0 => Operation::Clear,
            1 => Operation::Read,
            2 => Operation::Write,
            _ => Operation::Load,
        };
        let register = *instruction >> 3 & 7;
        *instruction = UNDRIVEN;
        let sent = rest.to_vec();
        rest.fill(UNDRIVEN);
        match (operation, register) {
            (Operation::Clear, MDR0) => self.mdr0 = 0,
            (Operation::Clear, MDR1) => self.mdr1 = 0,
            (Operation::Clear, CNTR) => self.count = 0,
            (Operation::Clear, STR) => self.flags &= UP,
            (Operation::Load, CNTR) => self.count = self.data & self.mask(),
            (Operation::Load, OTR) => self.latch = self.count,
            (Operation::Read, register) => {
                // Reading the count goes through the latch.
                if register == CNTR {
                    self.latch = self.count;
                }
                for (place, byte) in rest.iter_mut().zip(self.bytes_of(register)) {
                    *place = byte;
                }
            }
            (Operation::Write, register) => self.write(register, &sent),
            _ => {}
        }
    }

    /// The encoder stays where it is; the chip forgets everything.
    fn power_on(&mut self) {
        *self = Self {
            edges: self.edges,
            ..Self::default()
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(chip: &mut Ls7366r, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        chip.select(&mut bytes);
        bytes[1..].to_vec()
    }

    #[test]
    fn counts_in_each_quadrature_mode_and_width() {
        for (mode, counts) in [(0, 0), (1, 25), (2, 50), (3, 100)] {
            let mut chip = Ls7366r::default();
            ask(&mut chip, &[0x88, mode]);
            chip.turn_to(100);
            assert_eq!(ask(&mut chip, &[0x60, 0, 0, 0, 0]), [0, 0, 0, counts]);
        }
        let mut chip = Ls7366r::default();
        ask(&mut chip, &[0x88, 3]);
        ask(&mut chip, &[0x90, 2]);
        chip.turn_to(-1);
        assert_eq!(
            ask(&mut chip, &[0x60, 0, 0, 0, 0]),
            [0xFF, 0xFF, 0xFF, 0xFF]
        );
        assert_eq!(ask(&mut chip, &[0x70, 0]), [0x4D], "borrow, sign");
        chip.turn_to(0x1_0003);
        assert_eq!(
            ask(&mut chip, &[0x60, 0, 0, 0]),
            [0, 3, 0xFF],
            "two bytes wide"
        );
    }

    #[test]
    fn a_latch_holds_while_the_encoder_moves_on() {
        let mut chip = Ls7366r::default();
        ask(&mut chip, &[0x88, 3]);
        chip.turn_to(7);
        ask(&mut chip, &[0xE8]);
        chip.turn_to(9);
        assert_eq!(ask(&mut chip, &[0x68, 0, 0, 0, 0]), [0, 0, 0, 7]);
        // What some published code sends for it loads the counter from the data register.
        ask(&mut chip, &[0x98, 0, 0, 1, 0]);
        ask(&mut chip, &[0xE4]);
        assert_eq!(ask(&mut chip, &[0x60, 0, 0, 0, 0]), [0, 0, 1, 0]);
    }

    #[test]
    fn status_tells_a_lost_supply_until_it_is_cleared() {
        let mut chip = Ls7366r::default();
        assert_eq!(ask(&mut chip, &[0x70, 0]), [0x0C]);
        ask(&mut chip, &[0x30]);
        assert_eq!(ask(&mut chip, &[0x70, 0]), [0x08]);
        ask(&mut chip, &[0x90, 0x04]);
        assert_eq!(ask(&mut chip, &[0x70, 0]), [0x00], "counting disabled");
        chip.power_on();
        assert_eq!(ask(&mut chip, &[0x70, 0]), [0x0C]);
    }

    #[test]
    fn the_index_does_what_its_mode_says() {
        for (mode, count) in [(0x03, 40), (0x13, 5), (0x23, 0)] {
            let mut chip = Ls7366r::default();
            ask(&mut chip, &[0x88, mode]);
            ask(&mut chip, &[0x98, 0, 0, 0, 5]);
            chip.turn_to(40);
            chip.index_pulse();
            assert_eq!(ask(&mut chip, &[0x60, 0, 0, 0, 0]), [0, 0, 0, count]);
        }
        let mut chip = Ls7366r::default();
        ask(&mut chip, &[0x88, 0x07]);
        chip.turn_to(40);
        assert_eq!(
            ask(&mut chip, &[0x60, 0, 0, 0, 0]),
            [0; 4],
            "not free-running"
        );
    }
}
