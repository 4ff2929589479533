//! The firmware without a board: the image that is flashed, under QEMU, with chips that a record
//! feeds.
//!
//! The device's chip selects, sampling clock and serial line end in two pipes ([`link`]); behind
//! them are a [`board`] of chips ([`chips`]), moved row by row as the record says
//! ([`crate::device::wired`]), and a [`judge`] who compares every word of the device with the host'
//! s chain. [`mod@bench`] holds them together and makes go wrong what a [`bench::Scenario`] asks
//! for. [`serve`] lets the device run on and on instead, its line on a TCP port ([`loopback`]), its
//! [`joint`] changed when somebody says so.

pub mod bench;
pub mod board;
pub mod chips;
pub mod device;
pub mod joint;
pub mod judge;
pub mod line;
pub mod link;
pub mod loopback;
pub mod qemu;
pub mod selftest;
pub mod serve;
pub mod size;
