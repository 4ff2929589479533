//! Jointwatch for firmware that is not written in Rust: a static library with a C interface.
//!
//! `include/jointwatch.h` is the interface and `README.md` shows its use. [`boundary`] holds the
//! functions that C calls and all that is `unsafe`; the other files are safe Rust. The caller gives
//! every buffer, nothing allocates, and nothing that runs per sample can panic.
#![cfg_attr(target_os = "none", no_std)]
#![deny(unsafe_code)]
#![allow(non_camel_case_types, reason = "the names are those of the C header")]

#[allow(unsafe_code, reason = "pointers of C have no safe form")]
pub mod boundary;
pub mod error;
#[cfg(dsp)]
#[path = "../../src/board/kernels.rs"]
#[allow(unsafe_code, reason = "assembly has no safe form")]
pub mod kernels;
mod objects;
pub mod types;

#[cfg(not(dsp))]
use jointwatch_shared::base::kernels::Portable as Kernels;
#[cfg(dsp)]
use kernels::Assembly as Kernels;

/// Nothing leads here, as a test of the linked library shows; were it otherwise, a watchdog would
/// end it.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
