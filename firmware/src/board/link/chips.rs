//! The chips behind the link, in the numbers of its protocol.

use super::files::Files;
use crate::board::chips::Chips;
use core::convert::Infallible;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};

/// Kinds of requests: counters 0 to 3, then these.
const CONVERTER: u8 = 4;
const ACCELEROMETER: u8 = 5;
const LATCH: u8 = 7;

/// One chip, or all counters at once.
#[derive(Debug)]
pub struct SpiChip(u8);

/// Every device of the board.
pub type SpiChips = Chips<SpiChip>;

/// The chips of the host.
pub fn devices() -> SpiChips {
    SpiChips {
        latch: SpiChip(LATCH),
        counters: [0, 1, 2, 3].map(SpiChip),
        converter: SpiChip(CONVERTER),
        accelerometers: [ACCELEROMETER, ACCELEROMETER + 1].map(SpiChip),
    }
}

impl ErrorType for SpiChip {
    type Error = Infallible;
}

impl SpiDevice for SpiChip {
    /// Each operation is a request: the drivers make one per transaction.
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::TransferInPlace(bytes) = operation {
                Files.request(self.0, bytes);
                if self.0 != LATCH {
                    Files.answer(bytes);
                }
            }
        }
        Ok(())
    }
}
