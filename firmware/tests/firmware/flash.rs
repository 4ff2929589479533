//! Flash in memory that fails only when it is told to, and takes no byte that was not erased.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use jointwatch_firmware::app::Supplied;
use jointwatch_shared::wire::telemetry::Supply;
use std::ops::Range;

/// Flash in memory, in sectors of this length.
pub(crate) struct Flash<const SECTOR: usize> {
    pub(crate) bytes: Vec<u8>,
    /// The supply is too low to write it.
    pub(crate) is_low: bool,
    /// Writes that begin here are taken and leave no trace, as of cells that are worn out.
    pub(crate) deaf: Range<usize>,
}

impl<const SECTOR: usize> Flash<SECTOR> {
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            is_low: false,
            deaf: 0..0,
        }
    }
}

impl<const SECTOR: usize> Supplied for Flash<SECTOR> {
    fn supply(&self) -> Supply {
        Supply {
            reset_below_mv: Some(2500),
            is_low: self.is_low,
        }
    }
}

impl<const SECTOR: usize> ErrorType for Flash<SECTOR> {
    type Error = NorFlashErrorKind;
}

impl<const SECTOR: usize> ReadNorFlash for Flash<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, into: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        into.copy_from_slice(&self.bytes[offset as usize..][..into.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const SECTOR: usize> NorFlash for Flash<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        if self.is_low {
            return Err(NorFlashErrorKind::Other);
        }
        self.bytes[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        if self.is_low {
            return Err(NorFlashErrorKind::Other);
        }
        if self.deaf.contains(&(offset as usize)) {
            return Ok(());
        }
        for (place, byte) in self.bytes[offset as usize..].iter_mut().zip(bytes) {
            assert_eq!(*place, 0xFF, "programmed twice");
            *place = *byte;
        }
        Ok(())
    }
}
