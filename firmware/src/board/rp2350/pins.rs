//! What a pin is for, and how it is driven.

use rp235x_pac::{IO_BANK0, PADS_BANK0};

/// Functions of a pin (section 9.4).
pub(super) const SPI: u8 = 1;
pub(super) const UART: u8 = 2;
pub(super) const SOFTWARE: u8 = 5;

/// PADS_BANK0 (section 9.11.3): 4 mA and an input with a Schmitt trigger; the same pulled up. The
/// other pull would not hold an open line low (erratum RP2350-E9).
pub(super) const PLAIN: u32 = 1 << 6 | 1 << 4 | 1 << 1;
pub(super) const PULLED_UP: u32 = PLAIN | 1 << 3;

/// Gives a pin a function, and ends its isolation. For the start, before interrupts are on.
pub(super) fn assign(pin: usize, function: u8, pad: u32) {
    // SAFETY: the start alone uses these registers; pins that are not assigned stay as they are.
    let (functions, pads) = unsafe { (&*IO_BANK0::PTR, &*PADS_BANK0::PTR) };
    // SAFETY: a function and a pad's bits of those above.
    unsafe {
        let control = functions.gpio(pin).gpio_ctrl();
        control.write(|w| w.funcsel().bits(function));
        pads.gpio(pin).write(|w| w.bits(pad));
    }
}
