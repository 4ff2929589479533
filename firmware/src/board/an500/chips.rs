//! The sensor chips: none is fitted to this board, so that nothing answers and the monitor says so.

use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};

/// A place on the bus where no chip is.
#[derive(Debug)]
pub struct NoChip;

/// The error of every transfer: no chip answers.
#[derive(Clone, Copy, Debug)]
pub struct NoAnswer;

impl Error for NoAnswer {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for NoChip {
    type Error = NoAnswer;
}

impl SpiDevice for NoChip {
    fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), NoAnswer> {
        Err(NoAnswer)
    }
}
