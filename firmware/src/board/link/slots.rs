//! The model slots of the emulated board: QEMU's flash is read-only memory, so the slots are copied
//! into RAM at the first start.
//!
//! The copy has sectors of 16 KiB, which hold all of a slot that means anything, and behaves as
//! flash does: programming only clears bits, erasing sets them. A restart leaves it as it is, so
//! that an upload that a restart breaks off is found as it was.

use core::cell::UnsafeCell;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use jointwatch_shared::wire::capture::Chunk;

unsafe extern "C" {
    // Addresses from the board's memory map; there is nothing of Rust's behind them.
    static _slot_a: u8;
    static _slot_b: u8;
}

/// Bytes of a sector of the copy.
const SECTOR: usize = 16 * 1024;
/// Bytes of RAM that only this emulation takes.
pub(super) const EMULATED: usize = size_of::<Copied>() + size_of::<[Chunk; CHUNKS]>();
/// Chunks of counts around an alarm: QEMU's board has no core-coupled memory, and so many fit into
/// what is left of the other.
pub(super) const CHUNKS: usize = 9;

/// The copy, and a word that says that it was made.
#[repr(C)]
struct Content {
    made: u32,
    sectors: [[u8; SECTOR]; 2],
}

struct Copied(UnsafeCell<Content>);

// SAFETY: only the one `SlotFlash` is at it.
unsafe impl Sync for Copied {}

#[unsafe(link_section = ".uninit.slots")]
static COPY: Copied = Copied(UnsafeCell::new(Content {
    made: 0,
    sectors: [[0; SECTOR]; 2],
}));

/// Not what RAM begins with.
const MADE: u32 = 0xC0B1_ED51;

/// Both sectors; there is one of it.
#[derive(Debug)]
pub struct SlotFlash(());

/// The copy, made anew unless a restart has left it. To be called once.
pub fn slots() -> SlotFlash {
    let content = content();
    if content.made != MADE {
        let starts = [&raw const _slot_a, &raw const _slot_b];
        for (sector, start) in content.sectors.iter_mut().zip(starts) {
            for (at, place) in sector.iter_mut().enumerate() {
                // SAFETY: within the slot's sector, which is larger and always readable.
                *place = unsafe { start.add(at).read_volatile() };
            }
        }
        content.made = MADE;
    }
    SlotFlash(())
}

fn content() -> &'static mut Content {
    // SAFETY: all bit patterns are valid, and the one `SlotFlash` borrows it for single calls.
    unsafe { &mut *COPY.0.get() }
}

/// An address outside the slots.
#[derive(Clone, Copy, Debug)]
pub struct OutOfBounds;

impl NorFlashError for OutOfBounds {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

fn part(from: u32, length: usize) -> Result<&'static mut [u8], OutOfBounds> {
    let bytes = content().sectors.as_flattened_mut();
    let rest = bytes.get_mut(from as usize..).ok_or(OutOfBounds)?;
    rest.get_mut(..length).ok_or(OutOfBounds)
}

impl ErrorType for SlotFlash {
    type Error = OutOfBounds;
}

impl ReadNorFlash for SlotFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), OutOfBounds> {
        let from = part(offset, bytes.len())?;
        bytes
            .iter_mut()
            .zip(from)
            .for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SlotFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), OutOfBounds> {
        part(from, to.saturating_sub(from) as usize)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), OutOfBounds> {
        let to = part(offset, bytes.len())?;
        to.iter_mut().zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}

/// Emulated: nothing is known of a supply.
impl crate::app::Supplied for SlotFlash {}
