//! The STM32F405 board: clock set-up that cannot hang, the counter of the self-test, and the model
//! slots.
//!
//! The STM32F407 has the same registers, memory and pins (RM0090 is of both) and Ethernet besides.
//! It was compiled for, and never run.
//!
//! QEMU's `netduinoplus2` has the same processor and memory but neither a crystal nor a PLL; the
//! same program runs on it because every wait below ends.

#[cfg(not(feature = "semihosting-link"))]
mod flash;
#[cfg(not(feature = "semihosting-link"))]
mod serial;
#[cfg(not(feature = "semihosting-link"))]
mod spi;
#[cfg(not(feature = "semihosting-link"))]
mod supply;
#[cfg(not(feature = "semihosting-link"))]
mod ticker;
pub mod watchdog;
#[cfg(not(feature = "semihosting-link"))]
pub mod wired;

/// Chips, serial line, sampling clock and slots: those of the board, or the host's behind the
/// link.
#[cfg(feature = "semihosting-link")]
pub use super::link as parts;
#[cfg(not(feature = "semihosting-link"))]
pub use wired as parts;

use crate::clock::Clock;
use crate::suite::Counter;
use chip::{FLASH, PWR, Peripherals, RCC, TIM5};

/// The board's name in the self-test's text.
#[cfg(feature = "stm32f405")]
pub const NAME: &str = "stm32f405";
/// The board's name in the self-test's text.
#[cfg(feature = "stm32f407")]
pub const NAME: &str = "stm32f407";

/// The registers of the STM32F405.
#[cfg(feature = "stm32f405")]
pub use stm32f4::stm32f405 as chip;
/// The registers of the STM32F407.
#[cfg(feature = "stm32f407")]
pub use stm32f4::stm32f407 as chip;

/// The crystal soldered to the board, in Hz. Boards carry 8 or 12 MHz; the dividers below follow
/// from it.
pub const CRYSTAL_HZ: u32 = 8_000_000;

/// The processor's clock when crystal and PLL work, in Hz: the most the chip allows (datasheet
/// DS8626, “General operating conditions”).
pub const PROCESSOR_HZ: u32 = 168_000_000;

/// The oscillator inside the chip, in Hz, good to 1 % at 25 °C (DS8626, “HSI oscillator
/// characteristics”).
const INTERNAL_HZ: u32 = 16_000_000;

/// What goes into the PLL, in Hz: 2 MHz, which RM0090 (RCC_PLLCFGR, PLLM) recommends against
/// jitter.
const PLL_INPUT_HZ: u32 = 2_000_000;
const PLL_M: u32 = CRYSTAL_HZ / PLL_INPUT_HZ;
const PLL_P: u32 = 2;
const PLL_N: u32 = PROCESSOR_HZ * PLL_P / PLL_INPUT_HZ;
/// Gives the 48 MHz that USB would need; it must be at least 2 even where nothing uses it.
const PLL_Q: u32 = PROCESSOR_HZ * PLL_P / 48_000_000;

const _: () = {
    assert!(
        PLL_M * PLL_INPUT_HZ == CRYSTAL_HZ,
        "the crystal is no multiple of 2 MHz"
    );
    assert!(PLL_M >= 2 && PLL_M <= 63, "RM0090, RCC_PLLCFGR, PLLM");
    assert!(PLL_N >= 50 && PLL_N <= 432, "RM0090, RCC_PLLCFGR, PLLN");
    assert!(PLL_Q >= 2 && PLL_Q <= 15, "RM0090, RCC_PLLCFGR, PLLQ");
};

/// How often a flag is looked at before it is given up.
///
/// A look takes at least 4 cycles of the 16 MHz oscillator, so this is at least 50 ms. The crystal
/// needs about 2 ms and the PLL at most 0.3 ms (DS8626, “HSE oscillator characteristics”, “Main PLL
/// characteristics”).
const LOOKS: u32 = 200_000;

/// The bytes of model slots A and B, each a flash sector of its own.
pub fn slots() -> [&'static [u8]; 2] {
    super::slots::slots()
}

/// Sets the clock, and starts the counter of the self-test. To be called once.
///
/// The counter is TIM5. Under QEMU with `-icount shift=0 -global
/// stm32f2xx-timer.clock-frequency=1000000000` it counts executed instructions. On silicon it
/// counts cycles of the timer clock, half as fast as the processor's.
pub fn start() -> (Clock, Option<Counter>) {
    let Some(chip) = Peripherals::take() else {
        // Somebody has them already, so the clock has been set; which way cannot be told from here.
        return (Clock::internal(INTERNAL_HZ), None);
    };
    let clock = set_clock(&chip.RCC, &chip.PWR, &chip.FLASH);
    start_counter(&chip.RCC, &chip.TIM5);
    (clock, Some(count))
}

/// 168 MHz from the crystal when it and the PLL start in time, else the internal oscillator.
fn set_clock(rcc: &RCC, pwr: &PWR, flash: &FLASH) -> Clock {
    if crystal_and_pll(rcc, pwr, flash).is_some() {
        return Clock::crystal(PROCESSOR_HZ);
    }
    // What the chip does after reset, whichever step failed. The flash may keep its wait states:
    // they only cost time.
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    wait(|| rcc.cfgr().read().sws().is_hsi());
    rcc.cr().modify(|_, w| w.pllon().off().hseon().off());
    Clock::internal(INTERNAL_HZ)
}

/// The steps of RM0090, chapter “Reset and clock control”; `None` as soon as one of them does not
/// happen in time.
fn crystal_and_pll(rcc: &RCC, pwr: &PWR, flash: &FLASH) -> Option<()> {
    rcc.cr().modify(|_, w| w.hseon().on());
    wait(|| rcc.cr().read().hserdy().is_ready())?;

    // Above 144 MHz the core needs the higher of its two voltages (RM0090, PWR_CR, VOS).
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    pwr.cr().modify(|_, w| w.vos().scale1());

    rcc.pllcfgr().modify(|_, w| {
        // SAFETY: the assertions above hold each value within its field and its documented range.
        unsafe {
            w.pllm().bits(PLL_M as u8);
            w.plln().bits(PLL_N as u16);
            w.pllq().bits(PLL_Q as u8);
        }
        w.pllp().div2().pllsrc().hse()
    });
    rcc.cr().modify(|_, w| w.pllon().on());
    wait(|| rcc.cr().read().pllrdy().is_ready())?;

    // Five wait states from 2.7 to 3.6 V above 150 MHz (RM0090, “Relation between CPU clock
    // frequency and Flash memory read time”); the caches make up for them.
    flash.acr().modify(|_, w| {
        w.latency().ws5();
        w.prften().enabled().icen().enabled().dcen().enabled()
    });
    wait(|| flash.acr().read().latency().is_ws5())?;

    // The peripheral buses may run at 42 and 84 MHz (DS8626, “General operating conditions”).
    rcc.cfgr()
        .modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    wait(|| rcc.cfgr().read().sws().is_pll())
}

/// `None` when `ready` has not come true within [`LOOKS`] looks.
fn wait(ready: impl Fn() -> bool) -> Option<()> {
    (0..LOOKS).any(|_| ready()).then_some(())
}

/// TIM5 over its whole 32 bits, without prescaler.
fn start_counter(rcc: &RCC, timer: &TIM5) {
    rcc.apb1enr().modify(|_, w| w.tim5en().enabled());
    // Reading back waits for the clock to arrive (RM0090 asks for two cycles between enabling a
    // peripheral and using it).
    rcc.apb1enr().read();
    timer.arr().write(|w| w.set(u32::MAX));
    timer.egr().write(|w| w.ug().update());
    timer.cr1().modify(|_, w| w.cen().enabled());
}

/// The count of TIM5; under QEMU, instructions since its start.
pub fn count() -> u32 {
    // SAFETY: reading the count of a timer that nothing writes to once `start_counter` has started
    // it.
    unsafe { (*TIM5::PTR).cnt().read().cnt().bits() }
}
