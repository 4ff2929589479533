//! A chip on paper for the drivers' tests: what is to be sent, what comes back, and a bus that
//! fails at any transfer.

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use std::vec::Vec;

/// One exchange under one chip select: bytes sent, bytes that come back.
pub(crate) type Exchange = (Vec<u8>, Vec<u8>);

/// A bus that checks every byte against the script, and fails at one exchange when told to.
pub(crate) struct Scripted {
    mock: Mock<u8>,
    done: usize,
    fails_at: Option<usize>,
}

impl Scripted {
    /// The whole script, on a bus that does not fail.
    pub(crate) fn new(exchanges: &[Exchange]) -> Self {
        Self::failing(exchanges, None)
    }

    /// The script up to the exchange `fails_at`, from 0, which the bus refuses.
    pub(crate) fn failing(exchanges: &[Exchange], fails_at: Option<usize>) -> Self {
        let kept = &exchanges[..fails_at.unwrap_or(exchanges.len())];
        let transactions: Vec<_> = kept
            .iter()
            .flat_map(|(sent, back)| {
                [
                    Transaction::transaction_start(),
                    Transaction::transfer_in_place(sent.clone(), back.clone()),
                    Transaction::transaction_end(),
                ]
            })
            .collect();
        Self {
            mock: Mock::new(&transactions),
            done: 0,
            fails_at,
        }
    }

    /// Panics unless the script was played to its end.
    pub(crate) fn done(mut self) {
        self.mock.done();
    }
}

impl ErrorType for Scripted {
    type Error = ErrorKind;
}

impl SpiDevice for Scripted {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let now = self.done;
        self.done += 1;
        if self.fails_at == Some(now) {
            return Err(ErrorKind::ModeFault);
        }
        self.mock.transaction(operations)
    }
}

/// Plays `run` with the bus failing at each exchange in turn; every run has to end with what
/// `is_bus_fault` accepts, and must not touch the bus after the failure.
pub(crate) fn with_every_bus_failure<T: std::fmt::Debug>(
    exchanges: &[Exchange],
    mut run: impl FnMut(&mut Scripted) -> Result<T, super::ChipFault<ErrorKind>>,
) {
    for at in 0..exchanges.len() {
        let mut bus = Scripted::failing(exchanges, Some(at));
        match run(&mut bus) {
            Err(super::ChipFault::Bus(ErrorKind::ModeFault)) => {}
            other => panic!("the bus failed at exchange {at}, and the driver said {other:?}"),
        }
        assert_eq!(bus.done, at + 1, "exchange {at} was not the last");
        bus.done();
    }
}
