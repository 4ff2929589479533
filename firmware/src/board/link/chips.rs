//! The chips behind the link, in the numbers of its protocol.

use super::files::Files;
use core::convert::Infallible;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};

/// Kinds of requests: counters 0 to 3, then these.
const CONVERTER: u8 = 4;
const ACCELEROMETER: u8 = 5;
const LATCH: u8 = 7;

/// One chip, or all counters at once.
#[derive(Debug)]
pub struct Device(u8);

/// Every device of the board.
pub struct Devices {
    /// All counters at once.
    pub latch: Device,
    /// The quadrature counters.
    pub counters: [Device; COUNTERS],
    /// The converter.
    pub converter: Device,
    /// The accelerometers.
    pub accelerometers: [Device; ACCELEROMETERS],
}

/// The chips of the host.
pub fn devices() -> Devices {
    Devices {
        latch: Device(LATCH),
        counters: [0, 1, 2, 3].map(Device),
        converter: Device(CONVERTER),
        accelerometers: [ACCELEROMETER, ACCELEROMETER + 1].map(Device),
    }
}

impl ErrorType for Device {
    type Error = Infallible;
}

impl SpiDevice for Device {
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
