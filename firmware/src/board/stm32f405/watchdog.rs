//! The independent watchdog: restarts the chip when nothing feeds it, whatever the program does.
//!
//! Once started it cannot be stopped. It runs on the chip's slow oscillator: 17 to 47 kHz (DS8626,
//! “LSI oscillator characteristics”). The longest time for which the program stands still is one
//! erasure of a slot's sector: 2 s at most (DS8626, “Flash memory programming”, 128 KiB by words),
//! here twice that. Not emulated by QEMU, where these registers take everything and do nothing.

use super::chip::{DBGMCU, IWDG};

/// Counts of a 256th of the slow oscillator: 6.5 s where that is fastest, 9.6 s in the mean, 18 s
/// where it is slowest.
const RELOAD: u16 = 1200;

/// The slow oscillator's fastest, Hz, and twice the longest erasure, s.
const FASTEST_HZ: u32 = 47_000;
const ERASURE_S: u32 = 4;

const _: () = assert!(
    RELOAD as u32 * 256 > ERASURE_S * FASTEST_HZ,
    "an upload would set the watchdog off"
);
const _: () = assert!(RELOAD < 1 << 12, "RM0090, IWDG_RLR");

/// Starts it. To be called once, before the slots are looked at.
pub fn start() {
    // SAFETY: the start calls this once, before interrupts are on; from then on only `feed` writes
    // to IWDG.
    let (watchdog, debug) = unsafe { (&*IWDG::PTR, &*DBGMCU::PTR) };
    // A debugger that halts the program is no reason to restart (RM0090, DBGMCU_APB1_FZ).
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    watchdog.kr().write(|w| w.key().start());
    watchdog.kr().write(|w| w.key().unlock());
    watchdog.pr().write(|w| w.pr().divide_by256());
    // SAFETY: within the field, as asserted above.
    watchdog.rlr().write(|w| unsafe { w.rl().bits(RELOAD) });
    // Both values take five cycles of the slow oscillator to arrive; until then it runs on its
    // first, which is half a second.
    feed();
}

/// Puts the restart off by its whole time.
pub fn feed() {
    // SAFETY: a write of the key, which nobody but the evaluation's task does once the start is
    // over.
    unsafe { (*IWDG::PTR).kr().write(|w| w.key().feed()) };
}
