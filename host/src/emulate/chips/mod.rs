//! The sensor chips as their datasheets describe them, register by register, for a device that has
//! none.
//!
//! They are written from the datasheets and share nothing with the firmware's drivers: a constant
//! that a driver has wrong shows here. A chip knows one chip select, what it measures, and nothing
//! of the rig.

pub mod ads131m04;
pub mod adxl355;
pub mod ls7366r;

/// What a line reads that no chip drives: the board pulls it up.
pub const UNDRIVEN: u8 = 0xFF;

/// A chip behind its chip select.
pub trait Chip {
    /// One chip select from its falling to its rising edge: `bytes` are what the device sends, and
    /// become what it reads.
    fn select(&mut self, bytes: &mut [u8]);

    /// The supply comes on: every register at its reset value.
    fn power_on(&mut self);
}
