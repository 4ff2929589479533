//! The nRF52840 with the pins of Nordic's development kit: a Cortex-M4F. Compiled for, and never
//! run.
//!
//! Chapters are those of the nRF52840 Product Specification. The kit's serial line goes to its
//! debugger.

mod flash;
mod serial;
mod spi;
mod ticker;

pub use flash::{SlotFlash, slots as slot_flash};
pub use serial::{Serial, received, start as start_serial};
pub use spi::{SpiChip, SpiChips, devices};
pub use ticker::{Ticker, start as start_ticker};

use crate::clock::Clock;
use crate::suite::Counter;
use nrf52840_pac::CLOCK;

/// The board's name in the self-test's text.
pub const NAME: &str = "nrf52840";

/// The processor's clock, in Hz; from which oscillator it comes makes no difference to it.
const PROCESSOR_HZ: u32 = 64_000_000;

/// How often a flag is looked at before it is given up: the crystal needs under 1 ms (“CLOCK”), a
/// look at least 60 ns.
const LOOKS: u32 = 200_000;

/// Starts the crystal. To be called once; no timer counts instructions.
pub fn start() -> (Clock, Option<Counter>) {
    // SAFETY: the start calls this once, before interrupts are on; nothing else uses this
    // peripheral.
    let clock = unsafe { &*CLOCK::PTR };
    clock.events_hfclkstarted.reset();
    // SAFETY: a task is triggered by writing a one.
    clock.tasks_hfclkstart.write(|w| unsafe { w.bits(1) });
    let runs = (0..LOOKS).any(|_| clock.events_hfclkstarted.read().bits() != 0);
    let clock = if runs {
        Clock::crystal(PROCESSOR_HZ)
    } else {
        Clock::internal(PROCESSOR_HZ)
    };
    (clock, None)
}

/// The bytes of model slots A and B.
pub fn slots() -> [&'static [u8]; 2] {
    super::slots::slots()
}
