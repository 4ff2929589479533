//! The log's way out: a ring of bytes in RAM that a debug probe reads while the processor runs
//! (SEGGER's RTT).
//!
//! Written here rather than taken from `defmt-rtt` because that panics when it is entered twice,
//! and the image has to have no panic path. The control block has the same layout, so `probe-rs`
//! and other RTT readers find it by its name and first bytes. When nobody reads, the oldest bytes
//! are overwritten: the log never holds up the program.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering, compiler_fence};

/// Bytes in the ring. A boot log takes about a hundred.
const ROOM: usize = 1024;

/// The control block, as SEGGER's "J-Link / J-Trace User Guide" (UM08001), section RTT, lays it
/// out.
#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    name: *const u8,
    ring: *const UnsafeCell<[u8; ROOM]>,
    ring_length: usize,
    /// Where the next byte goes.
    write: AtomicUsize,
    /// Where the reader takes the next byte; only the probe writes it.
    read: AtomicUsize,
    /// The reader's choice of what happens when the ring is full; it is not followed, see above.
    mode: AtomicU32,
}

// SAFETY: the pointers are to statics; the ring is written only inside a critical section, see
// `Log`.
unsafe impl Sync for ControlBlock {}

struct Ring(UnsafeCell<[u8; ROOM]>);

// SAFETY: as above.
unsafe impl Sync for Ring {}

static RING: Ring = Ring(UnsafeCell::new([0; ROOM]));

// SAFETY: readers look for this name; nothing else in the program has it.
#[unsafe(no_mangle)]
static _SEGGER_RTT: ControlBlock = ControlBlock {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    up_channels: 1,
    down_channels: 0,
    name: c"defmt".as_ptr().cast(),
    ring: &raw const RING.0,
    ring_length: ROOM,
    write: AtomicUsize::new(0),
    read: AtomicUsize::new(0),
    mode: AtomicU32::new(0),
};

/// Appends to the ring.
fn write(bytes: &[u8]) {
    let mut at = _SEGGER_RTT.write.load(Ordering::Relaxed);
    for &byte in bytes {
        // SAFETY: `at` is below ROOM, always, and only the one critical section of a log frame
        // writes here.
        unsafe { RING.0.get().cast::<u8>().add(at).write_volatile(byte) };
        at = (at + 1) % ROOM;
    }
    // The probe must not see the new position before the bytes.
    compiler_fence(Ordering::Release);
    _SEGGER_RTT.write.store(at, Ordering::Relaxed);
}

/// The logger's state while a frame is written.
struct State {
    /// Whether interrupts were on before the frame began.
    interrupts: bool,
    encoder: defmt::Encoder,
}

struct Cell(UnsafeCell<State>);

// SAFETY: touched only between `acquire` and `release`, with interrupts off, on a chip with one
// core.
unsafe impl Sync for Cell {}

static STATE: Cell = Cell(UnsafeCell::new(State {
    interrupts: false,
    encoder: defmt::Encoder::new(),
}));

#[defmt::global_logger]
struct Log;

// SAFETY: interrupts are off from `acquire` to `release`, so frames of different contexts do not
// mix. A frame inside a frame, which would take the encoder twice, needs a `Format` that logs while
// it is being formatted; there is none.
unsafe impl defmt::Logger for Log {
    fn acquire() {
        let interrupts = cortex_m::register::primask::read().is_active();
        cortex_m::interrupt::disable();
        // SAFETY: interrupts are off.
        let state = unsafe { &mut *STATE.0.get() };
        state.interrupts = interrupts;
        state.encoder.start_frame(write);
    }

    unsafe fn flush() {}

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: defmt calls this between `acquire` and `release` only.
        let state = unsafe { &mut *STATE.0.get() };
        state.encoder.write(bytes, write);
    }

    unsafe fn release() {
        // SAFETY: as in `write`.
        let state = unsafe { &mut *STATE.0.get() };
        state.encoder.end_frame(write);
        if state.interrupts {
            // SAFETY: they were on when this frame began.
            unsafe { cortex_m::interrupt::enable() };
        }
    }
}
