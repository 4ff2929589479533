//! Where the two model slots lie in flash, as the linker placed them.

use core::slice;
use jointwatch_shared::wire::blob::BLOB_LEN;

unsafe extern "C" {
    // Addresses from the board's memory map; there is nothing of Rust's behind them.
    static _slot_a: u8;
    static _slot_b: u8;
}

/// The first [`BLOB_LEN`] bytes of slot A and of slot B.
pub(super) fn slots() -> [&'static [u8]; 2] {
    // SAFETY: both addresses are the starts of flash regions of at least BLOB_LEN bytes (memory.x),
    // flash is always readable, and nothing in this program writes to it.
    unsafe {
        [
            slice::from_raw_parts(&raw const _slot_a, BLOB_LEN),
            slice::from_raw_parts(&raw const _slot_b, BLOB_LEN),
        ]
    }
}
