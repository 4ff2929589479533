//! ADS131M04: four 24-bit converters, from Texas Instruments' datasheet SBAS890 "ADS131M04
//! 4-Channel, Simultaneously-Sampling, 24-Bit, Delta-Sigma ADC".
//!
//! A frame is command, arguments and checksum in; the answer to the frame before, four codes and a
//! checksum out. Codes come from a queue of two conversions. A command whose checksum is asked for
//! and does not match is not carried out.

use super::{Chip, UNDRIVEN};
use std::collections::VecDeque;

/// Channels of the converter.
pub const CHANNELS: usize = 4;
/// Finest input unit: a code at gain 128. A code at gain g is 128/g of them.
pub const UNITS_PER_CODE_AT_GAIN_1: i64 = 128;
/// The clock that the board feeds it, Hz; the modulator runs at half of it.
const CLOCK_HZ: f64 = 8_192_000.0;

// Addresses, table "Register Map".
const ID: usize = 0x00;
const STATUS: usize = 0x01;
const MODE: usize = 0x02;
const CLOCK: usize = 0x03;
const GAIN1: usize = 0x04;
const REGISTERS: usize = 0x40;
/// Reset values that are not zero: ID, STATUS, MODE, CLOCK, CFG, and the gain calibration of each
/// channel.
const RESET_VALUES: [(usize, u16); 9] = [
    (ID, 0x2401),
    (STATUS, 0x0500),
    (MODE, 0x0510),
    (CLOCK, 0x0F0E),
    (0x06, 0x0600),
    (0x0C, 0x8000),
    (0x11, 0x8000),
    (0x16, 0x8000),
    (0x1B, 0x8000),
];

// STATUS.
const LOCKED: u16 = 1 << 15;
const CRC_ERROR: u16 = 1 << 12;
const CRC_ANSI: u16 = 1 << 11;
const RESET_FLAG: u16 = 1 << 10;
// MODE.
const RX_CRC: u16 = 1 << 12;

/// What the next frame begins with.
#[derive(Clone, Debug, PartialEq)]
enum Answer {
    /// STATUS as it is then.
    Status,
    Word(u16),
    /// The acknowledgement of a read of several registers, and what they hold; no codes in that
    /// frame.
    Registers(u16, Vec<u16>),
}

/// The converter and what lies at its inputs.
#[derive(Clone, Debug)]
pub struct Ads131m04 {
    registers: [u16; REGISTERS],
    answer: Answer,
    /// At most two conversions that were not read.
    queue: VecDeque<[i32; CHANNELS]>,
    /// The conversion that was sent last: sent again while there is none newer.
    sent: [i32; CHANNELS],
    standby: bool,
    /// The identity it has; another one makes it another chip.
    identity: u16,
}

impl Default for Ads131m04 {
    fn default() -> Self {
        let mut chip = Self {
            registers: [0; REGISTERS],
            answer: Answer::Word(0),
            queue: VecDeque::new(),
            sent: [0; CHANNELS],
            standby: false,
            identity: 0x2401,
        };
        chip.power_on();
        chip
    }
}

impl Ads131m04 {
    /// Makes it a chip with another ID register; its supply comes on.
    pub fn replaced(&mut self, identity: u16) {
        self.identity = identity;
        self.power_on();
    }

    /// Conversions per second: the modulator's clock over the oversampling.
    pub fn rate_hz(&self) -> f64 {
        let ratio = match self.registers[CLOCK] >> 2 & 7 {
            7 => 16_256.0,
            step => f64::from(128_u32 << step),
        };
        CLOCK_HZ / 2.0 / ratio
    }

    /// A conversion ends; inputs in codes at gain 128.
    pub fn convert(&mut self, inputs: [i64; CHANNELS]) {
        if self.standby {
            return;
        }
        let mut codes = [0; CHANNELS];
        for (channel, (code, input)) in codes.iter_mut().zip(inputs).enumerate() {
            if self.enabled() >> channel & 1 == 1 {
                let gain = 1_i64 << (self.registers[GAIN1] >> (4 * channel) & 7);
                let exact = input.saturating_mul(gain) / UNITS_PER_CODE_AT_GAIN_1;
                *code = exact.clamp(-(1 << 23), (1 << 23) - 1) as i32;
            }
        }
        self.queue.push_back(codes);
        if self.queue.len() > 2 {
            self.queue.pop_front();
        }
    }

    /// A mask of the channels that are on.
    fn enabled(&self) -> u16 {
        self.registers[CLOCK] >> 8 & 0xF
    }

    fn status(&self) -> u16 {
        let new = if self.queue.is_empty() {
            0
        } else {
            self.enabled()
        };
        // Checksum and length of words are MODE's.
        let of_mode = CRC_ANSI | 0x0300;
        self.registers[STATUS] & !of_mode | self.registers[MODE] & of_mode | new
    }

    /// Bytes of a word, MODE bits 9–8, and where in it 16 and 24 bits lie.
    fn word_bytes(&self) -> usize {
        match self.registers[MODE] >> 8 & 3 {
            0 => 2,
            1 => 3,
            _ => 4,
        }
    }

    fn crc(&self, bytes: &[u8]) -> u16 {
        let polynomial = if self.registers[MODE] & CRC_ANSI != 0 {
            0x8005
        } else {
            0x1021
        };
        let mut remainder = 0xFFFF_u16;
        for bit in bytes
            .iter()
            .flat_map(|byte| (0..8).rev().map(move |n| byte >> n & 1))
        {
            let carry = remainder >> 15 != u16::from(bit);
            remainder <<= 1;
            if carry {
                remainder ^= polynomial;
            }
        }
        remainder
    }

    /// A 16-bit value in a word: left-justified.
    fn put(&self, frame: &mut Vec<u8>, value: u16) {
        frame.extend(value.to_be_bytes());
        frame.resize(frame.len() + self.word_bytes() - 2, 0);
    }

    /// A code in a word of 16 bits (cut), 24, or 32 (zero-padded or sign-extended).
    fn put_code(&self, frame: &mut Vec<u8>, code: i32) {
        let [high, a, b, c] = code.to_be_bytes();
        match self.registers[MODE] >> 8 & 3 {
            0 => frame.extend([a, b]),
            1 => frame.extend([a, b, c]),
            2 => frame.extend([a, b, c, 0]),
            _ => frame.extend([high, a, b, c]),
        }
    }

    /// The whole frame that goes out.
    fn outgoing(&mut self) -> Vec<u8> {
        let mut frame = Vec::new();
        let status = self.status();
        match self.answer.clone() {
            Answer::Registers(head, values) => {
                self.put(&mut frame, head);
                values
                    .into_iter()
                    .for_each(|value| self.put(&mut frame, value));
            }
            answer => {
                let head = match answer {
                    Answer::Word(word) => word,
                    _ => {
                        // Read once.
                        self.registers[STATUS] &= !CRC_ERROR;
                        status
                    }
                };
                self.put(&mut frame, head);
                if let Some(codes) = self.queue.front() {
                    self.sent = *codes;
                }
                let codes = self.sent;
                codes
                    .into_iter()
                    .for_each(|code| self.put_code(&mut frame, code));
            }
        }
        let crc = self.crc(&frame);
        self.put(&mut frame, crc);
        frame
    }

    /// Carries out what was received.
    fn take(&mut self, frame: &[u8]) {
        let size = self.word_bytes();
        let word = |place: usize| {
            let bytes = frame.get(place * size..place * size + 2)?;
            Some(u16::from_be_bytes([bytes[0], bytes[1]]))
        };
        let Some(command) = word(0) else {
            return;
        };
        let count = usize::from(command & 0x7F) + 1;
        let address = usize::from(command >> 7 & 0x3F);
        let writes = command >> 13 == 0b011;
        let arguments = if writes { count } else { 0 };
        if self.registers[MODE] & RX_CRC != 0 {
            let end = (1 + arguments) * size;
            let wanted = frame.get(..end).map(|bytes| self.crc(bytes));
            if wanted.is_none() || word(1 + arguments) != wanted {
                self.registers[STATUS] |= CRC_ERROR;
                self.answer = Answer::Status;
                return;
            }
        }
        let locked = self.registers[STATUS] & LOCKED != 0;
        self.answer = match command {
            0x0000 => Answer::Status,
            // Table "RESET": only in a frame of all its words.
            0x0011 if !locked && frame.len() >= (2 + CHANNELS) * size => {
                self.power_on();
                Answer::Word(0xFF00 | self.registers[ID] >> 8)
            }
            0x0011 => Answer::Word(0x0011),
            0x0022 if !locked => {
                self.standby = true;
                Answer::Word(command)
            }
            0x0033 if !locked => {
                self.standby = false;
                Answer::Word(command)
            }
            0x0555 => {
                self.registers[STATUS] |= LOCKED;
                Answer::Word(command)
            }
            0x0655 => {
                self.registers[STATUS] &= !LOCKED;
                Answer::Word(command)
            }
            _ if command >> 13 == 0b101 => {
                let register = |place: usize| match place {
                    STATUS => self.status(),
                    place => self.registers.get(place).copied().unwrap_or(0),
                };
                if count == 1 {
                    Answer::Word(register(address))
                } else {
                    let values = (address..address + count).map(register).collect();
                    Answer::Registers(0xE000 | command & 0x1FFF, values)
                }
            }
            _ if writes && !locked => {
                let values: Vec<u16> = (0..count).map_while(|n| word(1 + n)).collect();
                for (place, value) in (address..).zip(&values) {
                    self.write(place, *value);
                }
                let written = values.len().saturating_sub(1) as u16;
                Answer::Word(0x4000 | (address as u16) << 7 | written)
            }
            _ => Answer::Status,
        };
    }

    fn write(&mut self, register: usize, value: u16) {
        if register <= STATUS || register >= REGISTERS {
            return;
        }
        self.registers[register] = value;
        if register == MODE && value & RESET_FLAG == 0 {
            self.registers[STATUS] &= !RESET_FLAG;
        }
    }
}

impl Chip for Ads131m04 {
    fn select(&mut self, bytes: &mut [u8]) {
        let received = bytes.to_vec();
        let size = self.word_bytes();
        let out = self.outgoing();
        for (at, place) in bytes.iter_mut().enumerate() {
            *place = out.get(at).copied().unwrap_or(UNDRIVEN);
        }
        // Codes count as read when they were clocked out whole.
        let codes = !matches!(self.answer, Answer::Registers(..));
        if codes && received.len() >= (1 + CHANNELS) * size {
            self.queue.pop_front();
        }
        self.take(&received);
    }

    fn power_on(&mut self) {
        self.registers = [0; REGISTERS];
        for (register, value) in RESET_VALUES {
            self.registers[register] = value;
        }
        self.registers[ID] = self.identity;
        self.answer = Answer::Word(0xFF00 | self.identity >> 8);
        self.queue.clear();
        self.sent = [0; CHANNELS];
        self.standby = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of 24-bit words, the checksum behind the first `checked` of them.
    fn exchange(chip: &mut Ads131m04, words: &[u16]) -> Vec<u16> {
        exchange_damaged(chip, words, 0)
    }

    fn exchange_damaged(chip: &mut Ads131m04, words: &[u16], damage: u16) -> Vec<u16> {
        let mut bytes: Vec<u8> = words
            .iter()
            .flat_map(|w| [w.to_be_bytes().as_slice(), &[0]].concat())
            .collect();
        let crc = chip.crc(&bytes) ^ damage;
        bytes.extend(crc.to_be_bytes());
        bytes.resize(18.max(bytes.len() + 1), 0);
        chip.select(&mut bytes);
        let (words, _) = bytes.as_chunks::<3>();
        words
            .iter()
            .map(|w| u16::from_be_bytes([w[0], w[1]]))
            .collect()
    }

    #[test]
    fn the_checksum_is_that_of_the_datasheet() {
        let mut chip = Ads131m04::default();
        assert_eq!(chip.crc(b"123456789"), 0x29B1, "CCITT, beginning with ones");
        chip.registers[MODE] |= CRC_ANSI;
        assert_eq!(chip.crc(b"123456789"), 0xAEE7, "ANSI, beginning with ones");
    }

    #[test]
    fn begins_with_its_reset_answer_and_keeps_what_is_written() {
        let mut chip = Ads131m04::default();
        assert_eq!(exchange(&mut chip, &[0xA000])[0], 0xFF24);
        assert_eq!(exchange(&mut chip, &[0])[0] >> 8, 0x24);
        assert_eq!(exchange(&mut chip, &[0])[0], 0x0500, "reset flag, 24 bits");
        // Two registers written at once and read back at once.
        exchange(&mut chip, &[0x6000 | 2 << 7 | 1, 0x0110, 0x0F0A]);
        assert_eq!(
            exchange(&mut chip, &[0xA000 | 2 << 7 | 1])[0],
            0x4000 | 2 << 7 | 1
        );
        assert_eq!(
            exchange(&mut chip, &[0])[..3],
            [0xE000 | 2 << 7 | 1, 0x0110, 0x0F0A]
        );
        assert_eq!(exchange(&mut chip, &[0x0011])[0], 0x0100, "flag cleared");
        assert_eq!(exchange(&mut chip, &[0])[0], 0xFF24);
        assert_eq!(chip.registers[CLOCK], 0x0F0E);
    }

    #[test]
    fn a_command_with_a_wrong_checksum_is_not_carried_out() {
        let mut chip = Ads131m04::default();
        // Not asked for after a reset.
        exchange_damaged(&mut chip, &[0x6000 | 2 << 7, 0x1110], 1);
        assert_eq!(chip.registers[MODE], 0x1110);
        exchange_damaged(&mut chip, &[0x6000 | 4 << 7, 0x0005], 1);
        assert_eq!(chip.registers[GAIN1], 0);
        assert_eq!(exchange(&mut chip, &[0])[0], 0x1100, "says so once");
        assert_eq!(exchange(&mut chip, &[0])[0], 0x0100);
        exchange(&mut chip, &[0x6000 | 4 << 7, 0x0005]);
        assert_eq!(chip.registers[GAIN1], 5);
    }

    #[test]
    fn two_conversions_wait_and_the_older_comes_first() {
        let mut chip = Ads131m04::default();
        exchange(&mut chip, &[0]);
        for n in 1..=3 {
            chip.convert([n * 128 * 256; 4]);
        }
        let frames: Vec<_> = (0..3).map(|_| exchange(&mut chip, &[0])).collect();
        assert_eq!((frames[0][0], frames[0][1]), (0x050F, 2));
        assert_eq!((frames[1][0], frames[1][4]), (0x050F, 3));
        assert_eq!(
            (frames[2][0], frames[2][1]),
            (0x0500, 3),
            "the last one again"
        );
    }

    #[test]
    fn gain_rails_and_oversampling_follow_the_registers() {
        let mut chip = Ads131m04::default();
        assert_eq!(chip.rate_hz(), 4000.0);
        exchange(&mut chip, &[0x6000 | 3 << 7 | 1, 0x0E02, 0x0070]);
        assert_eq!(chip.rate_hz(), 32_000.0);
        chip.convert([9, 9, i64::MAX, -(1 << 40)]);
        assert_eq!(chip.queue[0], [0, 9, (1 << 23) - 1, -(1 << 23)]);
        exchange(&mut chip, &[0x6000 | 3 << 7, 0x0D02]);
        chip.convert([128; 4]);
        assert_eq!(chip.queue[0], [1, 0, 1, 1], "a channel that is off");
        exchange(&mut chip, &[0x0022]);
        chip.convert([256; 4]);
        assert!(chip.queue.is_empty(), "in standby");
    }

    #[test]
    fn words_have_the_length_that_mode_says() {
        let mut chip = Ads131m04::default();
        for (mode, code) in [
            (0, vec![0xFF, 0xFF]),
            (2, vec![0xFF, 0xFF, 0xFE, 0]),
            (3, vec![0xFF, 0xFF, 0xFF, 0xFE]),
        ] {
            chip.registers[MODE] = 0x0010 | mode << 8;
            chip.convert([-256; 4]);
            let size = chip.word_bytes();
            let mut frame = vec![0; 6 * size];
            chip.select(&mut frame);
            assert_eq!(frame[size..2 * size], code);
            let crc = chip.crc(&frame[..5 * size]);
            assert_eq!(frame[5 * size..5 * size + 2], crc.to_be_bytes());
        }
    }
}
