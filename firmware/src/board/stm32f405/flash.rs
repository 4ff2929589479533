//! The two model slots in the chip's own flash, sectors 10 and 11, erased and programmed in place.
//!
//! The processor fetches its program from the same flash: an erasure stops it for about a second (2 s at most, DS8626, “Flash
//! memory characteristics”), a word for about 16 µs.

use super::chip::FLASH;
use super::supply;
use crate::app::Supplied;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use jointwatch_shared::wire::telemetry::Supply;

unsafe extern "C" {
    // An address from the board's memory map; there is nothing of Rust's behind it.
    static _slot_a: u8;
}

/// Bytes of a sector.
const SECTOR: usize = 128 * 1024;
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

/// Why an operation on the flash failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashFault {
    /// An address outside the two sectors.
    OutOfBounds,
    /// An address or a length that is no multiple of a word or a sector.
    NotAligned,
    /// The flash refused, or did not come to an end.
    Refused,
    /// The supply is too low for it to be programmed: nothing was done.
    SupplyLow,
}

impl NorFlashError for FlashFault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::Refused | Self::SupplyLow => NorFlashErrorKind::Other,
        }
    }
}

/// Both sectors; there is one of it.
#[derive(Debug)]
pub struct SlotFlash(());

/// The flash of the slots, with the watch over the supply that it is written with. To be called once.
pub fn slots() -> SlotFlash {
    supply::watch();
    SlotFlash(())
}

fn registers() -> &'static super::chip::flash::RegisterBlock {
    // SAFETY: the registers exist for as long as the program; control and status are used here only, by the one driver.
    unsafe { &*FLASH::PTR }
}

/// The address of a byte of the slots.
fn address(offset: u32) -> usize {
    &raw const _slot_a as usize + offset as usize
}

fn unless_within(offset: u32, length: usize) -> Result<(), FlashFault> {
    let end = (offset as usize).checked_add(length);
    match end {
        Some(end) if end <= 2 * SECTOR => Ok(()),
        _ => Err(FlashFault::OutOfBounds),
    }
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

/// Does something with the flash unlocked; what the data cache holds of it is thrown away afterwards.
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
        unless_within(offset, bytes.len())?;
        for (place, at) in bytes.iter_mut().zip(address(offset)..) {
            // SAFETY: within the slots, which are always readable. Volatile, because the flash changes behind the
            // compiler's back.
            *place = unsafe { (at as *const u8).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SlotFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        let sector = SECTOR as u32;
        if !from.is_multiple_of(sector) || !to.is_multiple_of(sector) {
            return Err(FlashFault::NotAligned);
        }
        unless_within(from, to.saturating_sub(from) as usize)?;
        unlocked(|| {
            for number in from / sector..to / sector {
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
        let (words, rest) = bytes.as_chunks::<4>();
        if !offset.is_multiple_of(4) || !rest.is_empty() {
            return Err(FlashFault::NotAligned);
        }
        unless_within(offset, bytes.len())?;
        unlocked(|| {
            // SAFETY: as above.
            unsafe { registers().cr().write(|w| w.bits(PROGRAM | BY_WORDS)) };
            for (word, at) in words.iter().zip((address(offset)..).step_by(4)) {
                // SAFETY: an aligned word within the slots, and the flash is set to take it.
                unsafe { (at as *mut u32).write_volatile(u32::from_le_bytes(*word)) };
                finish()?;
            }
            Ok(())
        })
    }
}
