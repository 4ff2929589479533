//! The supply: below which voltage the chip holds itself in reset, and whether there is enough to
//! write the flash.
//!
//! Words of 32 bits may be programmed from 2.7 V on (DS8626, “Flash memory programming”). The
//! voltage detector is set above that, so that nothing is begun with a supply that is falling.

use super::chip::{FLASH, PWR, RCC};

// PWR_CR, RM0090, “PWR power control register”.
const DETECTOR: u32 = 1 << 4;
const LEVELS: u32 = 7 << 5;
/// Falls at 2.85 to 2.99 V (DS8626, “Embedded reset and power control block characteristics”, PLS =
/// 110).
const LEVEL: u32 = 6 << 5;
/// PWR_CSR: the supply is below that level.
const BELOW: u32 = 1 << 2;
/// Where FLASH_OPTCR has the brown-out level, which the option bytes set.
const BROWN_OUT: u32 = 2;
/// Its thresholds on the falling edge in mV, typical (DS8626, as above): levels 3, 2 and 1, and
/// none but that of the power-down reset.
const THRESHOLDS_MV: [u16; 4] = [2830, 2500, 2190, 1680];

/// Sets the voltage detector.
pub(super) fn watch() {
    // SAFETY: the start calls this once, before interrupts are on.
    let (rcc, pwr) = unsafe { (&*RCC::PTR, &*PWR::PTR) };
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    // Reading back waits for the clock to arrive.
    rcc.apb1enr().read();
    // SAFETY: the bits are those of the register, the others stay as they are.
    pwr.cr()
        .modify(|r, w| unsafe { w.bits(r.bits() & !LEVELS | LEVEL | DETECTOR) });
}

/// Whether the supply is too low for the flash to be written.
pub(super) fn is_low() -> bool {
    // SAFETY: the register is read alone, which has no side effect.
    unsafe { &*PWR::PTR }.csr().read().bits() & BELOW != 0
}

/// Below this voltage in mV the chip holds itself in reset.
pub(super) fn reset_below_mv() -> u16 {
    // SAFETY: as above.
    let level = unsafe { &*FLASH::PTR }.optcr().read().bits() >> BROWN_OUT & 3;
    let [third, second, first, off] = THRESHOLDS_MV;
    match level {
        0 => third,
        1 => second,
        2 => first,
        _ => off,
    }
}
