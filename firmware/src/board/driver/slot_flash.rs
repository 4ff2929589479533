//! The slots as flash that is read like memory: addresses, bounds, and why an operation fails.

use core::ops::Range;
use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

unsafe extern "C" {
    // An address from the board's memory map; there is nothing of Rust's behind it.
    static _slot_a: u8;
}

/// Bytes of a slot, which is erased as one; slot B follows slot A.
pub(in crate::board) const SECTOR: usize = 128 * 1024;

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

/// The address of a byte of the slots.
pub(in crate::board) fn address(offset: u32) -> usize {
    &raw const _slot_a as usize + offset as usize
}

fn unless_within(offset: u32, length: usize) -> Result<(), FlashFault> {
    let end = (offset as usize).checked_add(length);
    match end {
        Some(end) if end <= 2 * SECTOR => Ok(()),
        _ => Err(FlashFault::OutOfBounds),
    }
}

/// Reads bytes of the slots.
pub(in crate::board) fn read(offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
    unless_within(offset, bytes.len())?;
    for (place, at) in bytes.iter_mut().zip(address(offset)..) {
        // SAFETY: within the slots, which are always readable. Volatile, because the flash changes
        // behind the compiler's back.
        *place = unsafe { (at as *const u8).read_volatile() };
    }
    Ok(())
}

/// The numbers of the slots from one offset to another, to be erased.
pub(in crate::board) fn sectors(from: u32, to: u32) -> Result<Range<u32>, FlashFault> {
    let sector = SECTOR as u32;
    if !from.is_multiple_of(sector) || !to.is_multiple_of(sector) {
        return Err(FlashFault::NotAligned);
    }
    unless_within(from, to.saturating_sub(from) as usize)?;
    Ok(from / sector..to / sector)
}

/// The words to be programmed, each with the place for it: aligned, and within the slots.
pub(in crate::board) fn words(
    offset: u32,
    bytes: &[u8],
) -> Result<impl Iterator<Item = (*mut u32, u32)>, FlashFault> {
    let (words, rest) = bytes.as_chunks::<4>();
    if !offset.is_multiple_of(4) || !rest.is_empty() {
        return Err(FlashFault::NotAligned);
    }
    unless_within(offset, bytes.len())?;
    let places = (address(offset)..).step_by(4).map(|at| at as *mut u32);
    Ok(places.zip(words.iter().map(|word| u32::from_le_bytes(*word))))
}
