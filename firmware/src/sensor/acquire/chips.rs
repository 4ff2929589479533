//! The chips of a board for tests: registers as the real ones have them, behind chip selects that
//! can break.

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

/// What every chip on the board has in common: it answers one chip select.
pub(super) trait Chip {
    fn select(&mut self, bytes: &mut [u8]);
}

/// A chip select line: the chips behind it, whether its bus works, and how often it was used.
pub(super) struct SelectLine<T> {
    pub(super) chips: Vec<Rc<RefCell<T>>>,
    pub(super) broken: Rc<RefCell<bool>>,
    pub(super) used: Rc<RefCell<u32>>,
}

impl<T> SelectLine<T> {
    pub(super) fn to(chips: Vec<Rc<RefCell<T>>>) -> Self {
        Self {
            chips,
            broken: Rc::default(),
            used: Rc::default(),
        }
    }
}

impl<T> Clone for SelectLine<T> {
    fn clone(&self) -> Self {
        Self {
            chips: self.chips.clone(),
            broken: self.broken.clone(),
            used: self.used.clone(),
        }
    }
}

impl<T> ErrorType for SelectLine<T> {
    type Error = ErrorKind;
}

impl<T: Chip> SpiDevice for SelectLine<T> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        *self.used.borrow_mut() += 1;
        if *self.broken.borrow() {
            return Err(ErrorKind::ModeFault);
        }
        for operation in operations {
            let Operation::TransferInPlace(bytes) = operation else {
                panic!("the drivers transfer in place only");
            };
            let sent = bytes.to_vec();
            for chip in &self.chips {
                bytes.copy_from_slice(&sent);
                chip.borrow_mut().select(bytes);
            }
        }
        Ok(())
    }
}

/// The registers of an LS7366R.
#[derive(Default)]
pub(super) struct CounterChip {
    pub(super) absent: bool,
    mdr: [u8; 2],
    power_lost: bool,
    dtr: i32,
    pub(super) count: i32,
    latch: i32,
}

impl CounterChip {
    pub(super) fn lose_power(&mut self) {
        *self = Self {
            power_lost: true,
            ..Self::default()
        };
    }
}

impl Chip for CounterChip {
    fn select(&mut self, bytes: &mut [u8]) {
        if self.absent {
            return bytes.fill(0);
        }
        let enabled = u8::from(self.mdr[1] & 0x04 == 0) << 3;
        let status = enabled | u8::from(self.power_lost) << 2;
        match bytes {
            [0x48, value] => *value = self.mdr[0],
            [0x50, value] => *value = self.mdr[1],
            [0x70, value] => *value = status,
            [0x88, value] => self.mdr[0] = *value,
            [0x90, value] => self.mdr[1] = *value,
            [0x30] => self.power_lost = false,
            [0xE0] => self.count = self.dtr,
            [0xE8] => self.latch = self.count,
            [0x98, count @ ..] => self.dtr = i32::from_be_bytes((&*count).try_into().unwrap()),
            [0x68, count @ ..] => count.copy_from_slice(&self.latch.to_be_bytes()),
            other => panic!("no instruction of a counter: {other:02x?}"),
        }
    }
}

/// The registers of an ADS131M04.
pub(super) struct ConverterChip {
    registers: [u16; 16],
    answer: u16,
    pub(super) codes: [i32; 4],
    pub(super) converts: bool,
    pub(super) damages_frames: bool,
}

impl Default for ConverterChip {
    fn default() -> Self {
        let mut registers = [0; 16];
        registers[..7].copy_from_slice(&[0x2403, 0x0500, 0x0510, 0x0F0E, 0, 0, 0x0600]);
        Self {
            registers,
            answer: 0xFF24,
            codes: [0; 4],
            converts: true,
            damages_frames: false,
        }
    }
}

fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
            if crc >> 15 == 1 {
                crc << 1 ^ 0x1021
            } else {
                crc << 1
            }
        })
    })
}

impl Chip for ConverterChip {
    fn select(&mut self, bytes: &mut [u8]) {
        assert_eq!(bytes.len(), 18, "a frame has six words");
        let command = u16::from_be_bytes([bytes[0], bytes[1]]);
        let value = u16::from_be_bytes([bytes[3], bytes[4]]);
        let address = usize::from(command >> 7 & 0x3F);
        let checked = if command & 0xE000 == 0x6000 { 6 } else { 3 };
        let sent = u16::from_be_bytes([bytes[checked], bytes[checked + 1]]);
        assert_eq!(sent, crc(&bytes[..checked]), "the driver's checksum");
        bytes.fill(0);
        bytes[..2].copy_from_slice(&self.answer.to_be_bytes());
        for (word, code) in bytes[3..15]
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(self.codes)
        {
            word.copy_from_slice(&code.to_be_bytes()[1..]);
        }
        let sum = crc(&bytes[..15]) ^ u16::from(self.damages_frames);
        bytes[15..17].copy_from_slice(&sum.to_be_bytes());
        let new = if self.converts { 0x000F } else { 0 };
        let reset = self.registers[2] & 1 << 10;
        match command {
            0x0000 => self.answer = 0x0100 | reset | new,
            0x0011 => {
                *self = Self {
                    converts: self.converts,
                    damages_frames: self.damages_frames,
                    codes: self.codes,
                    ..Self::default()
                }
            }
            c if c & 0xE000 == 0xA000 => self.answer = self.registers[address],
            c if c & 0xE000 == 0x6000 => {
                self.registers[address] = value;
                self.answer = 0x4000 | command & 0x1FFF;
            }
            other => panic!("no command of the converter: {other:04x}"),
        }
    }
}

/// The registers of an ADXL355.
pub(super) struct AccelerometerChip {
    registers: [u8; 0x30],
    pub(super) part: u8,
    pub(super) codes: [i32; 3],
}

impl Default for AccelerometerChip {
    fn default() -> Self {
        let mut registers = [0; 0x30];
        registers[0x2C] = 0x81;
        registers[0x2D] = 0x01;
        Self {
            registers,
            part: 0xED,
            codes: [0; 3],
        }
    }
}

impl Chip for AccelerometerChip {
    fn select(&mut self, bytes: &mut [u8]) {
        let (address, reads) = (usize::from(bytes[0] >> 1), bytes[0] & 1 == 1);
        self.registers[..3].copy_from_slice(&[0xAD, 0x1D, self.part]);
        self.registers[4] = u8::from(self.registers[0x2D] & 1 == 0);
        for (place, code) in self.registers[8..17]
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(self.codes)
        {
            place.copy_from_slice(&(code << 4).to_be_bytes()[1..]);
        }
        if reads {
            let wanted = &self.registers[address..address + bytes.len() - 1];
            bytes[1..].copy_from_slice(wanted);
        } else if address == 0x2F && bytes[1] == 0x52 {
            (self.registers[0x2C], self.registers[0x2D]) = (0x81, 0x01);
        } else {
            self.registers[address] = bytes[1];
        }
    }
}
