//! Why the device restarted: kept in a word of RAM that a restart does not touch, and in the chip's
//! own flags.

use crate::board::stm32f405::chip::RCC;
use core::cell::UnsafeCell;
use jointwatch_shared::wire::telemetry::Restart;

/// A word that start-up code leaves alone.
#[repr(transparent)]
struct Kept(UnsafeCell<u32>);

// SAFETY: read once at the start and written last thing before a restart, on a chip with one core.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".uninit.restart")]
static NOTE: Kept = Kept(UnsafeCell::new(0));

/// Unlikely in a word that was never written.
const FAULT: u32 = 0xFA17_ED01;
const SOFTWARE: u32 = 0x50F7_0A2E;

fn note(why: u32) {
    // SAFETY: the word is there, and nobody else is at it, see above.
    unsafe { NOTE.0.get().write_volatile(why) };
}

/// Restarts because of a processor fault or a panic; the next start says so.
pub fn after_fault() -> ! {
    note(FAULT);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Restarts because the program wants to.
pub fn on_purpose() -> ! {
    note(SOFTWARE);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Why the device restarted last. To be called once: it clears what it reads.
pub fn why() -> Restart {
    // SAFETY: see `note`.
    let noted = unsafe { NOTE.0.get().read_volatile() };
    note(0);
    // SAFETY: the start calls this once, before interrupts are on.
    let flags = unsafe { &*RCC::PTR }.csr().read();
    // SAFETY: as above; setting RMVF clears the flags (RM0090, RCC_CSR).
    unsafe { &*RCC::PTR }.csr().modify(|_, w| w.rmvf().clear());
    match noted {
        FAULT => Restart::Fault,
        SOFTWARE => Restart::Software,
        // Power-on sets the brown-out and the pin flag as well, every other reset the pin flag.
        _ if flags.porrstf().bit() => Restart::PowerOn,
        _ if flags.borrstf().bit() => Restart::BrownOut,
        _ if flags.wdgrstf().bit() || flags.wwdgrstf().bit() => Restart::Watchdog,
        _ if flags.sftrstf().bit() => Restart::Software,
        _ if flags.padrstf().bit() => Restart::Pin,
        _ => Restart::Unknown,
    }
}
