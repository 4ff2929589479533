//! The two model slots in the chip's own flash, sectors 10 and 11, erased and programmed in place.
//!
//! The processor fetches its program from the same flash: an erasure stops it for about a second (2
//! s at most, DS8626, “Flash memory programming”), a word for about 16 µs.

use super::chip::FLASH;
use super::supply;
use crate::app::Supplied;
use crate::board::driver::slot_flash::{self, FlashFault, SECTOR};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use jointwatch_shared::wire::telemetry::Supply;

/// The number of slot A's sector; slot B's follows.
const FIRST_SECTOR: u32 = 10;

// FLASH_CR, RM0090, “Flash control register”.
const PROGRAM: u32 = 1 << 0;
const SECTOR_ERASE: u32 = 1 << 1;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Words of 32 bits, for a supply of 2.7 to 3.6 V.
const BY_WORDS: u32 = 2 << 8;
/// FLASH_KEYR, RM0090, “Unlocking the Flash control register”.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
// FLASH_SR, RM0090, “Flash status register”.
const BUSY: u32 = 1 << 16;
/// Programming sequence, parallelism, alignment, write protection, operation.
const ERRORS: u32 = 1 << 7 | 1 << 6 | 1 << 5 | 1 << 4 | 1 << 1;

/// How often the busy flag is looked at: 3 s at least, where a look takes 5 cycles of 168 MHz.
const LOOKS: u32 = 100_000_000;

/// Both sectors; there is one of it.
#[derive(Debug)]
pub struct SlotFlash(());

/// The flash of the slots, with the watch over the supply that it is written with. To be called
/// once.
pub fn slots() -> SlotFlash {
    supply::watch();
    SlotFlash(())
}

fn registers() -> &'static super::chip::flash::RegisterBlock {
    // SAFETY: the registers exist for as long as the program; control and status are used here
    // only, by the one driver.
    unsafe { &*FLASH::PTR }
}

/// Waits for the end of an operation.
fn finish() -> Result<(), FlashFault> {
    let ended = (0..LOOKS).any(|_| registers().sr().read().bits() & BUSY == 0);
    let errors = registers().sr().read().bits() & ERRORS;
    if ended && errors == 0 {
        Ok(())
    } else {
        // SAFETY: error flags are cleared by writing ones.
        unsafe { registers().sr().write(|w| w.bits(ERRORS)) };
        Err(FlashFault::Refused)
    }
}

/// Does something with the flash unlocked; what the data cache holds of it is thrown away
/// afterwards.
fn unlocked(what: impl FnOnce() -> Result<(), FlashFault>) -> Result<(), FlashFault> {
    if supply::is_low() {
        return Err(FlashFault::SupplyLow);
    }
    let flash = registers();
    // SAFETY: the sequences are those of RM0090; the bits are those of their registers.
    unsafe {
        if flash.cr().read().bits() & LOCK != 0 {
            for key in KEYS {
                flash.keyr().write(|w| w.bits(key));
            }
        }
        flash.sr().write(|w| w.bits(ERRORS));
    }
    let done = finish().and_then(|()| what());
    // SAFETY: as above.
    unsafe { flash.cr().write(|w| w.bits(LOCK)) };
    let cached = flash.acr().read().dcen().is_enabled();
    flash.acr().modify(|_, w| w.dcen().disabled());
    flash.acr().modify(|_, w| w.dcrst().reset());
    flash.acr().modify(|_, w| w.dcrst().no_reset());
    flash.acr().modify(|_, w| w.dcen().bit(cached));
    done
}

impl Supplied for SlotFlash {
    fn supply(&self) -> Supply {
        Supply {
            reset_below_mv: Some(supply::reset_below_mv()),
            is_low: supply::is_low(),
        }
    }
}

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
        let sectors = slot_flash::sectors(from, to)?;
        unlocked(|| {
            for number in sectors {
                let which = SECTOR_ERASE | BY_WORDS | (FIRST_SECTOR + number) << 3;
                // SAFETY: sectors 10 and 11 hold the slots and nothing else (memory.x).
                unsafe {
                    registers().cr().write(|w| w.bits(which));
                    registers().cr().write(|w| w.bits(which | START));
                }
                finish()?;
            }
            Ok(())
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        let words = slot_flash::words(offset, bytes)?;
        unlocked(|| {
            // SAFETY: as above.
            unsafe { registers().cr().write(|w| w.bits(PROGRAM | BY_WORDS)) };
            for (place, word) in words {
                // SAFETY: an aligned word within the slots, and the flash is set to take it.
                unsafe { place.write_volatile(word) };
                finish()?;
            }
            Ok(())
        })
    }
}
