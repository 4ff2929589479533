//! The device: drivers, firmware under QEMU, monitor and uploads, beside what the host expects of
//! them.

mod board;
mod chips;
mod emulate;
mod emulator;
mod image;
mod monitor;
mod monitor_changes;
mod replayed_frames;
mod rig_block;
mod upload;
