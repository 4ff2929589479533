//! The RP2350 with a Pico 2's crystal, by one of its Cortex-M33. Compiled for, and never run.
//!
//! Sections are those of the RP2350 datasheet. The slots lie in the flash beside the chip; nothing
//! here writes to it.

mod pins;
mod serial;
mod spi;
mod ticker;

pub use serial::{Serial, received, start as start_serial};
pub use spi::{SpiChip, SpiChips, devices};
pub use ticker::{Ticker, start as start_ticker};

use crate::clock::Clock;
use crate::suite::Counter;
use rp235x_pac::{CLOCKS, PLL_SYS, RESETS, XOSC};

/// The board's name in the self-test's text.
pub const NAME: &str = "rp2350";

/// The crystal of a Pico 2, in Hz.
const CRYSTAL_HZ: u32 = 12_000_000;
/// The processor's clock, in Hz: the most the chip allows (chapter 1).
const PROCESSOR_HZ: u32 = 150_000_000;
/// The oscillator inside the chip, in Hz, which varies from chip to chip (section 8.3).
const INTERNAL_HZ: u32 = 11_000_000;

/// What the crystal's frequency is multiplied by, and what the product is divided by, in two steps
/// (section 8.6).
const FEEDBACK: u32 = 125;
const DIVIDERS: [u32; 2] = [5, 2];

const _: () = {
    let fast = CRYSTAL_HZ * FEEDBACK;
    assert!(
        fast >= 750_000_000 && fast <= 1_600_000_000,
        "section 8.6.3"
    );
    assert!(fast / DIVIDERS[0] / DIVIDERS[1] == PROCESSOR_HZ);
};

/// XOSC_STARTUP in 256 cycles: 1 ms (section 8.2.4).
const CRYSTAL_DELAY: u32 = (CRYSTAL_HZ / 1000).div_ceil(256);

/// How often a flag is looked at before it is given up: 5 ms at least, where a look takes 4 cycles
/// of 150 MHz.
const LOOKS: u32 = 200_000;

/// Tells the boot ROM that this is a program for an Arm core (section 5.9.5.1, “Minimum Arm
/// IMAGE_DEF”).
#[unsafe(link_section = ".start_block")]
#[used]
static START_BLOCK: [u32; 5] = [0xFFFF_DED3, 0x1021_0142, 0x0000_01FF, 0, 0xAB12_3579];

/// Sets the clock. To be called once; no timer counts instructions.
pub fn start() -> (Clock, Option<Counter>) {
    // SAFETY: the start calls this once, before interrupts are on; nothing else uses these
    // peripherals but `enabled`.
    let (clocks, resets) = unsafe { (&*CLOCKS::PTR, &*RESETS::PTR) };
    let clock = match crystal_and_pll(clocks) {
        Some(()) => Clock::crystal(PROCESSOR_HZ),
        None => {
            clocks.clk_sys_ctrl().modify(|_, w| w.src().clk_ref());
            Clock::internal(INTERNAL_HZ)
        }
    };
    clocks
        .clk_peri_ctrl()
        .write(|w| w.auxsrc().clk_sys().enable().set_bit());
    resets.reset().modify(|_, w| {
        w.io_bank0().clear_bit().pads_bank0().clear_bit();
        w.uart0()
            .clear_bit()
            .spi0()
            .clear_bit()
            .timer0()
            .clear_bit()
    });
    wait(|| {
        let done = resets.reset_done().read();
        let pins = done.io_bank0().bit() && done.pads_bank0().bit();
        pins && done.uart0().bit() && done.spi0().bit() && done.timer0().bit()
    });
    (clock, None)
}

/// The steps of sections 8.1, 8.2 and 8.6; `None` as soon as one of them does not happen in time.
fn crystal_and_pll(clocks: &rp235x_pac::clocks::RegisterBlock) -> Option<()> {
    // SAFETY: as in `start`.
    let (crystal, pll, resets) = unsafe { (&*XOSC::PTR, &*PLL_SYS::PTR, &*RESETS::PTR) };
    // SAFETY: within its field.
    crystal
        .startup()
        .write(|w| unsafe { w.delay().bits(CRYSTAL_DELAY as u16) });
    crystal
        .ctrl()
        .write(|w| w.freq_range()._1_15mhz().enable().enable());
    wait(|| crystal.status().read().stable().bit())?;
    clocks.clk_ref_ctrl().modify(|_, w| w.src().xosc_clksrc());
    wait(|| clocks.clk_ref_selected().read().bits() == 1 << 2)?;
    // Away from the PLL, should it run, before it is set.
    clocks.clk_sys_ctrl().modify(|_, w| w.src().clk_ref());
    wait(|| clocks.clk_sys_selected().read().bits() == 1)?;

    resets.reset().modify(|_, w| w.pll_sys().set_bit());
    resets.reset().modify(|_, w| w.pll_sys().clear_bit());
    wait(|| resets.reset_done().read().pll_sys().bit())?;
    // SAFETY: the assertions above hold the values within their documented ranges.
    unsafe {
        pll.cs().write(|w| w.refdiv().bits(1));
        pll.fbdiv_int()
            .write(|w| w.fbdiv_int().bits(FEEDBACK as u16));
        pll.pwr()
            .modify(|_, w| w.pd().clear_bit().vcopd().clear_bit());
        wait(|| pll.cs().read().lock().bit())?;
        pll.prim().write(|w| {
            w.postdiv1().bits(DIVIDERS[0] as u8);
            w.postdiv2().bits(DIVIDERS[1] as u8)
        });
    }
    pll.pwr().modify(|_, w| w.postdivpd().clear_bit());
    clocks
        .clk_sys_ctrl()
        .modify(|_, w| w.auxsrc().clksrc_pll_sys());
    clocks
        .clk_sys_ctrl()
        .modify(|_, w| w.src().clksrc_clk_sys_aux());
    wait(|| clocks.clk_sys_selected().read().bits() == 1 << 1)
}

/// `None` when `ready` has not come true within [`LOOKS`] looks.
fn wait(ready: impl Fn() -> bool) -> Option<()> {
    (0..LOOKS).any(|_| ready()).then_some(())
}

/// The bytes of model slots A and B.
pub fn slots() -> [&'static [u8]; 2] {
    super::slots::slots()
}
