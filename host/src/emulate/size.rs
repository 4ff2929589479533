//! What an image takes of the microcontroller's memory, from its ELF file.

use crate::text::error::{Error, Result};
use object::{Object, ObjectSection};
use serde::Serialize;
use std::ops::Range;
use std::path::Path;

/// Program memory and RAM of the STM32F405 (RM0090, "Memory map").
const FLASH: Range<u64> = 0x0800_0000..0x0810_0000;
const RAM: Range<u64> = 0x2000_0000..0x2002_0000;

/// Bytes of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Program, constants, and the first values of variables.
    pub flash: u64,
    /// Variables; the stack is not among them.
    pub ram: u64,
}

/// The size of the image `elf`.
///
/// # Errors
/// When the file cannot be read, or is no ELF file.
pub fn of(elf: &Path) -> Result<Size> {
    let refuse = |why: String| Error::failed(format!("{}: {why}", elf.display()));
    let bytes = std::fs::read(elf).map_err(|e| refuse(e.to_string()))?;
    let file = object::File::parse(&*bytes).map_err(|e| refuse(e.to_string()))?;
    let mut size = Size::default();
    for section in file.sections() {
        let in_ram = RAM.contains(&section.address());
        // First values lie in flash too, and are copied at the start.
        let in_file = section.file_range().is_some();
        if FLASH.contains(&section.address()) || in_ram && in_file {
            size.flash += section.size();
        }
        if in_ram {
            size.ram += section.size();
        }
    }
    Ok(size)
}
