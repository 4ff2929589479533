//! The sensor chips: what a driver does, what can go wrong with one, and what it gives.
//!
//! A driver knows its chip and nothing of the rig. It gives raw codes, also those that stand still
//! or at a rail: whether a code is believable is for the monitor to say.

pub mod acquire;
pub mod ads131m04;
pub mod adxl355;
pub mod ls7366r;
pub mod presence;
#[cfg(test)]
pub(crate) mod script;

/// Why a chip could not be set up or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChipFault<E> {
    /// A transfer on the bus failed.
    Bus(E),
    /// Another chip answers, or none: a line that nothing drives reads 0x00 or 0xFF.
    WrongIdentity {
        /// The identity that was read.
        seen: u32,
        /// What this chip says of itself.
        wanted: u32,
    },
    /// What arrived does not match its checksum.
    Crc {
        /// The checksum that arrived.
        seen: u16,
        /// The checksum of what arrived.
        wanted: u16,
    },
    /// The chip says that what it received did not match its checksum.
    NotUnderstood,
    /// A register does not hold what was written to it.
    ConfigNotKept {
        /// Its address; for the LS7366R the instruction that reads it.
        register: u8,
        /// The value that was read back.
        seen: u16,
        /// The value that was written.
        wanted: u16,
    },
    /// The chip lost its supply or was reset: its settings, and a counter's count, are gone.
    Restarted,
    /// The chip is not done starting.
    NotReady,
}

/// Whether a register holds what was written to it.
fn kept<E>(register: u8, seen: u16, wanted: u16) -> Result<(), ChipFault<E>> {
    if seen == wanted {
        Ok(())
    } else {
        Err(ChipFault::ConfigNotKept {
            register,
            seen,
            wanted,
        })
    }
}

/// What a chip gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading<T> {
    /// The code, or the codes.
    pub value: T,
    /// Bit i is set when code i stands at a rail of its converter.
    pub saturated: u8,
    /// False when the chip had nothing new since it was read before.
    pub fresh: bool,
}

/// How a chip was found when it was set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// It was set up anew; a counter begins at its start count.
    Fresh,
    /// It had kept its settings and its count.
    Kept,
}

/// What every driver does. Nothing in it waits: where a chip needs time after a reset, the caller
/// comes back later.
pub trait Sensor {
    /// The error of the bus.
    type Error;
    /// The code, or the codes, of one reading.
    type Value: Copy + Default;

    /// Brings the chip to a known state; [`Sensor::set_up`] follows when it had time to start.
    ///
    /// # Errors
    /// [`ChipFault::Bus`].
    fn restart(&mut self) -> Result<(), ChipFault<Self::Error>>;

    /// Checks that the chip is the right one, writes its settings and reads them back.
    ///
    /// # Errors
    /// [`ChipFault`], the first that is found.
    fn set_up(&mut self) -> Result<Found, ChipFault<Self::Error>>;

    /// Reads the chip.
    ///
    /// # Errors
    /// [`ChipFault`].
    fn read(&mut self) -> Result<Reading<Self::Value>, ChipFault<Self::Error>>;
}

/// A mask of the codes that stand at `least` or `most`, bit i for code i.
fn at_rails(codes: &[i32], least: i32, most: i32) -> u8 {
    codes.iter().rev().fold(0, |mask, &code| {
        mask << 1 | u8::from(code <= least || code >= most)
    })
}
