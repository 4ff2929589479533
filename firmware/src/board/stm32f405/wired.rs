//! The board's own chips, serial line, sampling clock and slots.

pub use super::flash::{SlotFlash, slots};
pub use super::serial::{Serial, received, start as start_serial};
pub use super::spi::{SpiChip, SpiChips, devices};
pub use super::ticker::{Ticker, start as start_ticker};

use super::chip::RCC;
use crate::board::chunks::hand_out;
use core::mem::MaybeUninit;
use core::sync::atomic::AtomicBool;
use jointwatch_shared::wire::capture::{CHUNK, Chunk};

/// Chunks that the core-coupled memory holds.
const CHUNKS: usize = (64 << 10) / CHUNK;

/// The core-coupled memory, for the counts around an alarm; none where its clock, which runs after
/// every reset (RM0090, RCC_AHB1ENR), does not run: QEMU has neither.
pub fn counts_around_alarm() -> &'static mut [Chunk] {
    #[unsafe(link_section = ".ccm")]
    static mut ROOM: MaybeUninit<[Chunk; CHUNKS]> = MaybeUninit::uninit();
    static TAKEN: AtomicBool = AtomicBool::new(false);
    // SAFETY: the register is read alone, which has no side effect.
    let clocks = unsafe { &*RCC::PTR }.ahb1enr().read();
    if clocks.ccmdataramen().is_disabled() {
        return &mut [];
    }
    // SAFETY: both are used here only.
    unsafe { hand_out(&raw mut ROOM, &TAKEN) }
}

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
