//! The nRF51822 of QEMU's `microbit`: a Cortex-M0, here only to show that it computes the same
//! bits.

use crate::clock::Clock;
use crate::suite::Counter;

/// The board's name in the self-test's text.
pub const NAME: &str = "microbit";

/// An nRF51 runs from its internal 16 MHz oscillator until told otherwise (nRF51 Series Reference
/// Manual, chapter CLOCK).
pub fn start() -> (Clock, Option<Counter>) {
    // None of its timers is fine enough to count single instructions.
    (Clock::internal(16_000_000), None)
}

/// None: taking a model out of a blob needs more stack than the chip has RAM.
pub fn slots() -> [&'static [u8]; 0] {
    []
}
