//! Arm's MPS2+ board with the FPGA image AN500: a Cortex-M7 with Arm's own peripherals, another
//! family than the STM32F405.
//!
//! It exists here under QEMU only (`mps2-an500`), where it shows what belongs to a board and what
//! does not: nothing outside this folder but the memory map `an500.x` and the image
//! `bin/jointwatch-an500.rs` knows of it. Addresses are those of Arm's Application Note 500;
//! timer and serial line are those of the Cortex-M System Design Kit (CMSDK).

pub mod chips;
pub mod memory;
pub mod serial;
pub mod ticker;

use crate::clock::Clock;
use crate::suite::Counter;

/// The board's name in the self-test's text.
pub const NAME: &str = "mps2-an500";

/// What processor and peripherals are clocked by, in Hz.
const CLOCK_HZ: u32 = 25_000_000;

/// The clock runs when the processor starts; no timer counts instructions.
pub fn start() -> (Clock, Option<Counter>) {
    (Clock::crystal(CLOCK_HZ), None)
}

/// The bytes of model slots A and B.
pub fn slots() -> [&'static [u8]; 2] {
    super::slots::slots()
}

/// A register of a peripheral.
#[derive(Clone, Copy)]
struct Register(usize);

impl Register {
    fn read(self) -> u32 {
        // SAFETY: the constants of this folder are addresses of registers, whose reading changes
        // nothing in memory.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    fn write(self, value: u32) {
        // SAFETY: as above; none of them makes the peripheral write to memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}

/// Lets an interrupt through to the processor.
fn unmask(interrupt: u16) {
    /// A number of the interrupt controller.
    #[derive(Clone, Copy)]
    struct Number(u16);

    // SAFETY: the number is its own, and never changes.
    unsafe impl cortex_m::interrupt::InterruptNumber for Number {
        fn number(self) -> u16 {
            self.0
        }
    }

    // SAFETY: no critical section relies on a masked interrupt.
    unsafe { cortex_m::peripheral::NVIC::unmask(Number(interrupt)) }
}
