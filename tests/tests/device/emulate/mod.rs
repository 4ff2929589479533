//! The firmware itself under QEMU on emulated sensor chips: the host's bits on a healthy run, and a
//! device that goes on, says what is wrong and recovers when something fails.
//!
//! A missing QEMU fails these tests; nothing is skipped.

mod costs;
mod hum;
mod line;
mod sensor_faults;
mod served;
mod subject;
mod uploads;
