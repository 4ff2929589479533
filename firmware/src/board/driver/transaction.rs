//! Transactions on an SPI bus that exchanges a byte at a time: one chip at a time, or all four
//! counters at once to latch them.

use embedded_hal::spi::Operation;

/// Cycles between a chip select's edge and the next edge of anything: 0.2 µs at 168 MHz, above what
/// each chip asks for.
const SETTLE: u32 = 36;

/// One chip, or several behind one select, and the bus.
pub(in crate::board) trait Bytewise {
    /// What can go wrong on the bus.
    type Fault;

    /// Sets the bus up for the chip, and selects it.
    fn select(&mut self);

    /// One byte out, one byte in.
    fn exchange(&mut self, byte: u8) -> Result<u8, Self::Fault>;

    /// Waits until the last byte is through.
    fn finish(&mut self) -> Result<(), Self::Fault>;

    /// Ends the selection, after a transaction that was `done` or that failed.
    fn release(&mut self, done: bool);
}

/// Selects a chip, and goes through the operations.
pub(in crate::board) fn transaction<T: Bytewise>(
    chip: &mut T,
    operations: &mut [Operation<'_, u8>],
) -> Result<(), T::Fault> {
    chip.select();
    cortex_m::asm::delay(SETTLE);
    let done = operations
        .iter_mut()
        .try_for_each(|operation| operate(chip, operation));
    let done = done.and_then(|()| chip.finish());
    cortex_m::asm::delay(SETTLE);
    chip.release(done.is_ok());
    cortex_m::asm::delay(SETTLE);
    done
}

fn operate<T: Bytewise>(chip: &mut T, operation: &mut Operation<'_, u8>) -> Result<(), T::Fault> {
    match operation {
        Operation::TransferInPlace(bytes) => bytes
            .iter_mut()
            .try_for_each(|byte| chip.exchange(*byte).map(|seen| *byte = seen)),
        Operation::Read(bytes) => bytes
            .iter_mut()
            .try_for_each(|byte| chip.exchange(0).map(|seen| *byte = seen)),
        Operation::Write(bytes) => bytes
            .iter()
            .try_for_each(|&byte| chip.exchange(byte).map(drop)),
        Operation::Transfer(into, from) => {
            let length = into.len().max(from.len());
            for at in 0..length {
                let seen = chip.exchange(from.get(at).copied().unwrap_or(0))?;
                if let Some(place) = into.get_mut(at) {
                    *place = seen;
                }
            }
            Ok(())
        }
        Operation::DelayNs(ns) => {
            // One cycle is at least 1/168 µs; a little longer does no harm.
            cortex_m::asm::delay((*ns / 4).max(1));
            Ok(())
        }
    }
}
