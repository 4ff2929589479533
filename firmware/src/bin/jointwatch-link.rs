//! The image that is flashed, but for its chips, serial line, sampling clock and slots: those are
//! the host's, for tests under QEMU.
#![no_std]
#![no_main]

#[path = "../image/mod.rs"]
mod image;
