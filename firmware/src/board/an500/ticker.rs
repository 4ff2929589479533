//! Timer 0 tells when to sample: one that counts down, starts anew, and interrupts.

use super::{Register, unmask};
use crate::clock::{Clock, Rate};
use core::sync::atomic::{AtomicU32, Ordering};

/// The number of timer 0's interrupt.
pub const INTERRUPT: i16 = 8;

const CONTROL: Register = Register(0x4000_0000);
const VALUE: Register = Register(0x4000_0004);
const RELOAD: Register = Register(0x4000_0008);
const CLEAR: Register = Register(0x4000_000C);
/// CONTROL: running, with its interrupt.
const RUNNING: u32 = 1 << 3 | 1;

/// Instants since somebody asked.
static INSTANTS: AtomicU32 = AtomicU32::new(0);

/// Starts to sample. To be called once.
pub fn start(clock: Clock, rate: Rate) {
    // From 1 Hz to 10 kHz, as the start has checked: at least 2500 counts.
    let last = rate.counts(clock.hz).saturating_sub(1);
    RELOAD.write(last);
    VALUE.write(last);
    CONTROL.write(RUNNING);
    unmask(INTERRUPT.cast_unsigned());
}

/// What the timer's interrupt does.
pub fn interrupt() {
    CLEAR.write(1);
    INSTANTS.fetch_add(1, Ordering::Relaxed);
}

/// Whether a sample is due, and how many instants before it went by without one.
pub fn due() -> Option<u32> {
    INSTANTS.swap(0, Ordering::Relaxed).checked_sub(1)
}
