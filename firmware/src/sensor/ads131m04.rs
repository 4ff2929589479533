//! ADS131M04: four 24-bit converters that sample at one instant, for the strain bridges; every
//! frame carries a checksum.
//!
//! Texas Instruments, SBAS890, "ADS131M04 4-Channel, Simultaneously-Sampling, 24-Bit, Delta-Sigma
//! ADC". SPI mode 1. A frame is six words of 24 bits in both directions: the command and its
//! checksum go out while the answer to the *previous* command, the four codes and their checksum
//! come in (section "SPI Communication Frames").

use super::{ChipFault, Found, Reading, Sensor, at_rails, kept};
use embedded_hal::spi::SpiDevice;
use jointwatch_shared::wire::wiring::{CHANNELS, Converter};

// Commands, section "Commands", table "Command Definitions".
const NULL: u16 = 0x0000;
const RESET: u16 = 0x0011;
/// 101a aaaa annn nnnn: read n + 1 registers from address a.
const READ_REGISTER: u16 = 0xA000;
/// 011a aaaa annn nnnn: write n + 1 registers from address a.
const WRITE_REGISTER: u16 = 0x6000;

// Registers, section "ADS131M04 Registers", table "Register Map".
const ID: u8 = 0x00;
const MODE: u8 = 0x02;
const CLOCK: u8 = 0x03;
const GAIN1: u8 = 0x04;
const CFG: u8 = 0x06;

/// High byte of the identity: 0x20 plus the number of channels; the low byte is reserved.
const ID_FOUR_CHANNELS: u16 = 0x24;
/// Checksum on what the chip receives (bit 12), CCITT (bit 11 = 0), reset flag cleared (bit 10 =
/// 0), words of 24 bits (bits 9–8 = 01), frames time out (bit 4).
const MODE_SETTING: u16 = 0x1110;
/// All four channels on (bits 11–8), high-resolution power mode (bits 1–0 = 10); the oversampling
/// stands in bits 4–2.
const CLOCK_SETTING: u16 = 0x0F02;
/// The reset value: no chopping, no current detection.
const CFG_SETTING: u16 = 0x0600;

// Status word, which answers NULL: section "STATUS Register".
const STATUS_CRC_ERROR: u16 = 1 << 12;
const STATUS_RESET: u16 = 1 << 10;
/// One bit per channel that has a code which was not read before.
const STATUS_NEW: u16 = 0x000F;

/// Bytes of a word and of a frame.
const WORD: usize = 3;
const FRAME: usize = 6 * WORD;
/// The checksum of some bytes, section "Cyclic Redundancy Check (CRC)": CRC-16 with the polynomial
/// x¹⁶ + x¹² + x⁵ + 1, beginning with all ones. A byte at a time without a table: what is shifted
/// out comes back at bits 12, 5 and 0, its upper half once more.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc: u16, &byte| {
        let out = crc >> 8 ^ u16::from(byte);
        let out = out ^ out >> 4;
        crc << 8 ^ out << 12 ^ out << 5 ^ out
    })
}

/// The lowest and the highest of 24 bits.
const RAILS: [i32; 2] = [-(1 << 23), (1 << 23) - 1];

/// The converter on its chip select.
pub struct Ads131m04<S> {
    bus: S,
    settings: Converter,
}

/// What a frame brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Answer {
    /// The answer to the command of the frame before.
    word: u16,
    codes: [i32; CHANNELS],
}

/// Puts a 16-bit word at the front of its 24 bits.
fn put(frame: &mut [u8; FRAME], word: usize, value: u16) {
    for (place, byte) in frame.iter_mut().skip(word * WORD).zip(value.to_be_bytes()) {
        *place = byte;
    }
}

/// The checksum of the first `words` words.
fn checksum(frame: &[u8; FRAME], words: usize) -> u16 {
    crc(frame.get(..words * WORD).unwrap_or_default())
}

/// The frame of a command without data, or of one register's value.
fn frame(command: u16, value: Option<u16>) -> [u8; FRAME] {
    let mut frame = [0; FRAME];
    put(&mut frame, 0, command);
    let words = match value {
        Some(value) => {
            put(&mut frame, 1, value);
            2
        }
        None => 1,
    };
    let crc = checksum(&frame, words);
    put(&mut frame, words, crc);
    frame
}

impl<S: SpiDevice> Ads131m04<S> {
    /// The converter behind `bus`; nothing is sent yet.
    pub fn new(bus: S, settings: Converter) -> Self {
        Self { bus, settings }
    }

    /// One frame, its checksum verified.
    fn exchange(
        &mut self,
        command: u16,
        value: Option<u16>,
    ) -> Result<Answer, ChipFault<S::Error>> {
        let mut bytes = frame(command, value);
        self.bus
            .transfer_in_place(&mut bytes)
            .map_err(ChipFault::Bus)?;
        let wanted = checksum(&bytes, 5);
        let (words, _) = bytes.as_chunks::<WORD>();
        let mut answer = Answer {
            word: 0,
            codes: [0; CHANNELS],
        };
        let mut seen = 0;
        for (place, &[high, middle, low]) in words.iter().enumerate() {
            let top = u16::from_be_bytes([high, middle]);
            match place {
                0 => answer.word = top,
                5 => seen = top,
                _ => {
                    if let Some(code) = answer.codes.get_mut(place - 1) {
                        // Sign-extended from the top of 32 bits.
                        *code = i32::from_be_bytes([high, middle, low, 0]) >> 8;
                    }
                }
            }
        }
        if seen == wanted {
            Ok(answer)
        } else {
            Err(ChipFault::Crc { seen, wanted })
        }
    }

    fn register(&mut self, address: u8) -> Result<u16, ChipFault<S::Error>> {
        self.exchange(READ_REGISTER | u16::from(address) << 7, None)?;
        Ok(self.exchange(NULL, None)?.word)
    }

    /// The registers that are written, with their values.
    fn registers(&self) -> [(u8, u16); 4] {
        let gains = self.settings.gain_log2.iter().rev();
        let gains = gains.fold(0, |word, &gain| word << 4 | u16::from(gain & 7));
        [
            (MODE, MODE_SETTING),
            (
                CLOCK,
                CLOCK_SETTING | u16::from(self.settings.oversampling & 7) << 2,
            ),
            (GAIN1, gains),
            (CFG, CFG_SETTING),
        ]
    }
}

impl<S: SpiDevice> Sensor for Ads131m04<S> {
    type Error = S::Error;
    type Value = [i32; CHANNELS];

    /// Sends the reset command in a whole frame, as it has to be. The chip is ready 5 µs later
    /// ("t_REGACQ").
    fn restart(&mut self) -> Result<(), ChipFault<S::Error>> {
        // What comes back belongs to the time before and may be anything.
        let mut bytes = frame(RESET, None);
        self.bus
            .transfer_in_place(&mut bytes)
            .map_err(ChipFault::Bus)
    }

    fn set_up(&mut self) -> Result<Found, ChipFault<S::Error>> {
        let id = self.register(ID)?;
        if id >> 8 != ID_FOUR_CHANNELS {
            return Err(ChipFault::WrongIdentity {
                seen: u32::from(id >> 8),
                wanted: u32::from(ID_FOUR_CHANNELS),
            });
        }
        for (address, value) in self.registers() {
            self.exchange(WRITE_REGISTER | u16::from(address) << 7, Some(value))?;
        }
        for (register, wanted) in self.registers() {
            let seen = self.register(register)?;
            kept(register, seen, wanted)?;
        }
        Ok(Found::Fresh)
    }

    /// The newest code of every channel.
    ///
    /// The chip keeps two samples and gives the older one first (section "Collecting Data for the
    /// First Time or After a Pause"). Whoever samples more slowly than it converts always finds
    /// both: two frames are read, and the second is kept where it is new. That also makes the
    /// time on the bus the same whatever the chip has.
    fn read(&mut self) -> Result<Reading<[i32; CHANNELS]>, ChipFault<S::Error>> {
        let first = self.exchange(NULL, None)?;
        let second = self.exchange(NULL, None)?;
        let status = first.word | second.word;
        if status & STATUS_RESET != 0 {
            return Err(ChipFault::Restarted);
        }
        if status & STATUS_CRC_ERROR != 0 {
            return Err(ChipFault::NotUnderstood);
        }
        let new = |answer: &Answer| answer.word & STATUS_NEW == STATUS_NEW;
        let latest = if new(&second) || !new(&first) {
            second
        } else {
            first
        };
        let [least, most] = RAILS;
        Ok(Reading {
            value: latest.codes,
            saturated: at_rails(&latest.codes, least, most),
            fresh: new(&latest),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::script::{Exchange, Scripted, with_every_bus_failure};
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const SETTINGS: Converter = Converter {
        gain_log2: [5, 6, 0, 7],
        oversampling: 3,
    };

    /// Long division of the message, bit by bit, as the datasheet draws it.
    fn crc_by_hand(bytes: &[u8]) -> u16 {
        let bits = bytes
            .iter()
            .flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1));
        bits.fold(0xFFFF, |crc: u16, bit| {
            let shifted = crc << 1;
            if (crc >> 15) as u8 ^ bit == 1 {
                shifted ^ 0x1021
            } else {
                shifted
            }
        })
    }

    fn words(words: &[u32]) -> Vec<u8> {
        words
            .iter()
            .flat_map(|word| word.to_be_bytes()[1..].to_vec())
            .collect()
    }

    fn sent(head: &[u16]) -> Vec<u8> {
        let mut bytes = words(&head.iter().map(|w| u32::from(*w) << 8).collect::<Vec<_>>());
        bytes.extend(words(&[u32::from(crc_by_hand(&bytes)) << 8]));
        bytes.resize(18, 0);
        bytes
    }

    fn back(word: u16, codes: [u32; 4]) -> Vec<u8> {
        let mut bytes = words(&[u32::from(word) << 8, codes[0], codes[1], codes[2], codes[3]]);
        bytes.extend(words(&[u32::from(crc_by_hand(&bytes)) << 8]));
        bytes
    }

    fn asked(head: &[u16], answer: u16) -> Exchange {
        (sent(head), back(answer, [1, 2, 3, 4]))
    }

    const WRITTEN: [(u16, u16); 4] = [(2, 0x1110), (3, 0x0F0E), (4, 0x7065), (6, 0x0600)];

    /// After a reset: identity, four registers written, the same four read.
    fn after_reset() -> Vec<Exchange> {
        let mut script = vec![asked(&[0xA000], 0xFF24), asked(&[0], 0x2403)];
        for (address, value) in WRITTEN {
            script.push(asked(&[0x6000 | address << 7, value], 0x0500));
        }
        for (address, value) in WRITTEN {
            script.push(asked(&[0xA000 | address << 7], 0x4300));
            script.push(asked(&[0], value));
        }
        script
    }

    fn set_up(exchanges: &[Exchange]) -> Result<Found, ChipFault<embedded_hal::spi::ErrorKind>> {
        let mut chip = Ads131m04::new(Scripted::new(exchanges), SETTINGS);
        let found = chip.set_up();
        chip.bus.done();
        found
    }

    fn read(
        frames: [Vec<u8>; 2],
    ) -> Result<Reading<[i32; 4]>, ChipFault<embedded_hal::spi::ErrorKind>> {
        let script = frames.map(|frame| (sent(&[0]), frame));
        let mut chip = Ads131m04::new(Scripted::new(&script), SETTINGS);
        let reading = chip.read();
        chip.bus.done();
        reading
    }

    #[test]
    fn the_checksum_is_that_of_the_datasheet() {
        for bytes in [&b"123456789"[..], &[0; 15], &[0x00, 0x11, 0x00]] {
            assert_eq!(crc(bytes), crc_by_hand(bytes));
        }
        assert_eq!(crc_by_hand(b"123456789"), 0x29B1);
    }

    #[test]
    fn is_reset_and_set_up_as_the_datasheet_says() {
        let script = [(sent(&[0x0011]), vec![0xFF; 18])];
        let mut chip = Ads131m04::new(Scripted::new(&script), SETTINGS);
        assert_eq!(chip.restart(), Ok(()));
        chip.bus.done();
        assert_eq!(set_up(&after_reset()), Ok(Found::Fresh));
    }

    #[test]
    fn the_newest_codes_are_taken_with_their_signs() {
        let codes = [0x00_0001, 0xFF_FFFF, 0x12_3456, 0xED_CBAA];
        let wanted = [1, -1, 0x12_3456, -0x12_3456];
        let old = [9; 4];
        // Both samples waiting, one waiting, none waiting.
        for (first, second, fresh) in [
            (back(0x050F & 0xFBFF, old), back(0x010F, codes), true),
            (back(0x010F, codes), back(0x0100, old), true),
            (back(0x0100, old), back(0x0100, codes), false),
            // A channel alone is not a sample.
            (back(0x0100, old), back(0x0107, codes), false),
        ] {
            let reading = read([first, second]).unwrap();
            assert_eq!(
                reading,
                Reading {
                    value: wanted,
                    saturated: 0,
                    fresh
                }
            );
        }
    }

    #[test]
    fn a_code_at_a_rail_is_passed_on_and_marked() {
        let codes = [0x7F_FFFF, 0x80_0001, 0x80_0000, 0x7F_FFFE];
        let reading = read([back(0x010F, codes), back(0x010F, codes)]).unwrap();
        assert_eq!(reading.saturated, 0b0101);
        assert_eq!(reading.value[2], -(1 << 23));
    }

    #[test]
    fn codes_that_stand_still_are_passed_on() {
        let frame = || back(0x010F, [5; 4]);
        for _ in 0..3 {
            let reading = read([frame(), frame()]).unwrap();
            assert_eq!((reading.value, reading.fresh), ([5; 4], true));
        }
    }

    #[test]
    fn the_bus_may_fail_at_every_exchange() {
        with_every_bus_failure(&after_reset(), |bus| {
            Ads131m04::new(&mut *bus, SETTINGS).set_up()
        });
        let reading = [asked(&[0], 0x010F), asked(&[0], 0x010F)];
        with_every_bus_failure(&reading, |bus| Ads131m04::new(&mut *bus, SETTINGS).read());
        with_every_bus_failure(&[asked(&[0x0011], 0)], |bus| {
            Ads131m04::new(&mut *bus, SETTINGS).restart()
        });
    }

    #[test]
    fn every_flipped_bit_of_a_frame_is_noticed() {
        let good = || back(0x010F, [0x12_3456, 0, 0xFF_FFFF, 7]);
        for bit in 0..8 * 18 {
            let mut bad = good();
            bad[bit / 8] ^= 0x80 >> (bit % 8);
            let fault = read([good(), bad]);
            // The last eight bits only fill up the word of the checksum.
            let noticed = matches!(fault, Err(ChipFault::Crc { .. }));
            assert_eq!(noticed, bit < 8 * 17, "bit {bit}: {fault:?}");
        }
    }

    #[test]
    fn a_damaged_frame_is_noticed_at_every_step_of_the_set_up() {
        for at in 0..after_reset().len() {
            let mut script = after_reset();
            script[at].1[7] ^= 1;
            script.truncate(at + 1);
            assert!(
                matches!(set_up(&script), Err(ChipFault::Crc { .. })),
                "step {at}"
            );
        }
    }

    #[test]
    fn another_chip_and_no_chip_are_told() {
        let mut script = after_reset();
        script.truncate(2);
        script[1] = asked(&[0], 0x2203);
        let wanted = 0x24;
        assert_eq!(
            set_up(&script),
            Err(ChipFault::WrongIdentity { seen: 0x22, wanted })
        );
        for line in [0x00, 0xFF] {
            let script = [(sent(&[0xA000]), vec![line; 18])];
            assert!(
                matches!(set_up(&script), Err(ChipFault::Crc { .. })),
                "{line}"
            );
        }
    }

    #[test]
    fn every_register_that_is_not_kept_is_named() {
        for (place, (register, wanted)) in WRITTEN.into_iter().enumerate() {
            let mut script = after_reset();
            let at = 7 + 2 * place;
            script[at] = asked(&[0], wanted ^ 0x0020);
            script.truncate(at + 1);
            let fault = ChipFault::ConfigNotKept {
                register: register as u8,
                seen: wanted ^ 0x0020,
                wanted,
            };
            assert_eq!(set_up(&script), Err(fault));
        }
    }

    #[test]
    fn a_chip_that_restarted_or_did_not_understand_is_told() {
        let good = || back(0x010F, [0; 4]);
        assert_eq!(
            read([good(), back(0x050F, [0; 4])]),
            Err(ChipFault::Restarted)
        );
        assert_eq!(
            read([back(0x110F, [0; 4]), good()]),
            Err(ChipFault::NotUnderstood)
        );
    }
}
