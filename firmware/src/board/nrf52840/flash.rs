//! The two model slots in the chip's own flash, each 32 pages that are erased one after the other.
//!
//! The processor fetches its program from the same flash: a page stops it for about 85 ms, a word
//! for about 41 µs (“NVMC”).

use crate::app::Supplied;
use crate::board::driver::slot_flash::{self, FlashFault, SECTOR};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use nrf52840_pac::NVMC;

/// Bytes of a page.
const PAGE: usize = 4096;

/// How often the flag is looked at: 0.6 s at least, where a look takes 4 cycles of 64 MHz.
const LOOKS: u32 = 10_000_000;

/// Both slots; there is one of it.
#[derive(Debug)]
pub struct SlotFlash(());

/// The flash of the slots. To be called once.
pub fn slots() -> SlotFlash {
    SlotFlash(())
}

fn registers() -> &'static nrf52840_pac::nvmc::RegisterBlock {
    // SAFETY: the registers exist for as long as the program, and are used here only, by the one
    // driver.
    unsafe { &*NVMC::PTR }
}

/// Waits for the end of an operation.
fn finish() -> Result<(), FlashFault> {
    let ended = (0..LOOKS).any(|_| registers().ready.read().ready().is_ready());
    ended.then_some(()).ok_or(FlashFault::Refused)
}

/// Nothing is known of the supply.
impl Supplied for SlotFlash {}

impl ErrorType for SlotFlash {
    type Error = FlashFault;
}

impl ReadNorFlash for SlotFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        slot_flash::read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SlotFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        slot_flash::sectors(from, to)?;
        registers().config.write(|w| w.wen().een());
        let erased = (from..to).step_by(PAGE).try_for_each(|page| {
            let address = slot_flash::address(page) as u32;
            // SAFETY: a page of the slots, which hold nothing else (nrf52840.x).
            registers()
                .erasepage()
                .write(|w| unsafe { w.bits(address) });
            finish()
        });
        registers().config.write(|w| w.wen().ren());
        erased
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        let mut words = slot_flash::words(offset, bytes)?;
        registers().config.write(|w| w.wen().wen());
        let written = words.try_for_each(|(place, word)| {
            // SAFETY: an aligned word within the slots, and the flash is set to take it.
            unsafe { place.write_volatile(word) };
            finish()
        });
        registers().config.write(|w| w.wen().ren());
        written
    }
}
