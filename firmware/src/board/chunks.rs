//! Memory for the counts around an alarm.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};
use jointwatch_shared::wire::capture::Chunk;

/// Hands memory out, once; nothing when asked for again.
///
/// # Safety
/// `room` is used nowhere else, and lasts; `taken` is its own.
pub(super) unsafe fn hand_out<const N: usize>(
    room: *mut MaybeUninit<[Chunk; N]>,
    taken: &AtomicBool,
) -> &'static mut [Chunk] {
    if taken.swap(true, Ordering::Relaxed) {
        return &mut [];
    }
    // SAFETY: nobody else has it, as above; bytes that are all zero are chunks.
    unsafe {
        room.write_bytes(0, 1);
        (*room).assume_init_mut()
    }
}
