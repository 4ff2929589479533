//! Text, arguments and exit codes through QEMU or a debugger: the self-test's way to its reader.
//!
//! On a board without a debugger these calls stop the processor, so only the self-test image makes
//! them.

use cortex_m_semihosting::{debug, hio, nr, syscall1};

/// Room for the command line. QEMU refuses to hand over a longer one.
pub const MAX_COMMAND_LINE: usize = 256;

/// Where the self-test's text goes: QEMU's standard output, or the debugger's console. `None` when
/// neither gives it out.
pub fn text() -> Option<hio::HostStream> {
    hio::hstdout().ok()
}

/// The words that QEMU was given as `-semihosting-config …,arg=…`, separated by spaces.
///
/// Empty when there are none, when they do not fit into `room`, or when they are not text.
pub fn command_line(room: &mut [u8; MAX_COMMAND_LINE]) -> &str {
    // Address and length, as "Semihosting for AArch32 and AArch64", SYS_GET_CMDLINE, wants them;
    // the length comes back without the terminating zero.
    let mut block = [room.as_mut_ptr() as usize, room.len()];
    // SAFETY: the block names memory that belongs to `room`, for as long as this call lasts, and is
    // itself writable.
    let failed = unsafe { syscall1(nr::GET_CMDLINE, &raw mut block as usize) };
    if failed != 0 {
        return "";
    }
    room.get(..block[1])
        .and_then(|bytes| core::str::from_utf8(bytes).ok())
        .unwrap_or("")
}

/// Ends the run: exit code 0 when `passed`, else 1.
pub fn exit(passed: bool) -> ! {
    loop {
        debug::exit(if passed {
            debug::EXIT_SUCCESS
        } else {
            debug::EXIT_FAILURE
        });
    }
}
