//! The board's own chips, serial line, sampling clock and slots.

pub use super::flash::{SlotFlash, slots};
pub use super::serial::{Serial, received, start as start_serial};
pub use super::spi::{SpiChip, SpiChips, devices};
pub use super::ticker::{Ticker, start as start_ticker};

/// Nothing has to be opened.
pub fn open() {}

/// Instructions are counted in the image for tests only.
#[inline]
pub fn stage(_: usize, _: u32) {}

/// Waits for interrupts, which do all the work; timer and serial line set them off.
pub fn run(_: fn(), _: fn()) -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
