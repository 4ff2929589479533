//! The model slots: static RAM that behaves as flash does, where programming only clears bits and
//! erasing sets them.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

unsafe extern "C" {
    // An address from the board's memory map, where slot A begins and slot B follows; there is
    // nothing of Rust's behind it.
    static mut _slot_a: u8;
}

/// Bytes of a slot.
const SECTOR: usize = 128 * 1024;

/// Both slots; there is one of it.
#[derive(Debug)]
pub struct SlotMemory(());

/// The slots. To be called once.
pub fn slots() -> SlotMemory {
    SlotMemory(())
}

/// An address outside the slots.
#[derive(Clone, Copy, Debug)]
pub struct OutOfBounds;

impl NorFlashError for OutOfBounds {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl SlotMemory {
    /// The places from `from` on.
    fn places(
        &self,
        from: u32,
        length: usize,
    ) -> Result<impl Iterator<Item = *mut u8>, OutOfBounds> {
        let from = from as usize;
        let inside = from
            .checked_add(length)
            .is_some_and(|end| end <= 2 * SECTOR);
        let start = &raw mut _slot_a;
        let places = (from..from.wrapping_add(length)).map(move |at| start.wrapping_add(at));
        inside.then_some(places).ok_or(OutOfBounds)
    }
}

impl ErrorType for SlotMemory {
    type Error = OutOfBounds;
}

impl ReadNorFlash for SlotMemory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), OutOfBounds> {
        let places = self.places(offset, bytes.len())?;
        for (byte, place) in bytes.iter_mut().zip(places) {
            // SAFETY: within the slots, which are memory of the board's map that only this driver
            // touches while the program runs.
            *byte = unsafe { place.read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SlotMemory {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), OutOfBounds> {
        for place in self.places(from, to.saturating_sub(from) as usize)? {
            // SAFETY: as in `read`.
            unsafe { place.write_volatile(0xFF) };
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), OutOfBounds> {
        for (byte, place) in bytes.iter().zip(self.places(offset, bytes.len())?) {
            // SAFETY: as in `read`.
            unsafe { place.write_volatile(place.read_volatile() & byte) };
        }
        Ok(())
    }
}

/// Emulated: nothing is known of a supply.
impl crate::app::Supplied for SlotMemory {}
