//! SPI1 and the chip selects: one bus, one chip at a time, or all four counters at once to latch
//! them.
//!
//! `docs/howto/wiring.md` has the pins. Every wait is bounded: a bus that does not answer is an
//! error, and never holds up a sample.

use super::chip::{GPIOA, GPIOB, RCC, SPI1};
use crate::board::chips::Chips;
use crate::board::driver::transaction::{Bytewise, transaction};
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};

/// Chip selects on port B, in the order of the board's chips.
const COUNTER_SELECTS: [u16; COUNTERS] = [1 << 12, 1 << 13, 1 << 14, 1 << 15];
const CONVERTER_SELECT: u16 = 1 << 0;
const ACCELEROMETER_SELECTS: [u16; ACCELEROMETERS] = [1 << 1, 1 << 10];

// SPI_CR1, RM0090, “SPI control register 1”.
const CPHA: u32 = 1 << 0;
const MASTER: u32 = 1 << 2;
const ENABLED: u32 = 1 << 6;
/// The chip select is software's business.
const SOFTWARE_SELECT: u32 = 1 << 9 | 1 << 8;
/// SPI_CR1.BR: the bus clock of 84 MHz divided by 2^(n + 1).
const fn divided(n: u32) -> u32 {
    n << 3
}

// SPI_SR, RM0090, “SPI status register”.
const RECEIVED: u32 = 1 << 0;
const ROOM: u32 = 1 << 1;
const MODE_FAULT: u32 = 1 << 5;
const OVERRUN: u32 = 1 << 6;
const BUSY: u32 = 1 << 7;

/// How often a flag is looked at: a byte takes 3 µs at most at 168 MHz, a look at least 20 ns.
const LOOKS: u32 = 1000;

/// What went wrong on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusFault {
    /// A byte did not come in time.
    TimedOut,
    /// The peripheral lost its place as the bus's master.
    ModeFault,
    /// A byte was not fetched in time.
    Overrun,
}

impl Error for BusFault {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TimedOut => ErrorKind::Other,
            Self::ModeFault => ErrorKind::ModeFault,
            Self::Overrun => ErrorKind::Overrun,
        }
    }
}

/// One chip, or several behind one select.
#[derive(Debug)]
pub struct SpiChip {
    /// Pins of port B that are low while it is selected.
    select: u16,
    /// SPI_CR1 while it is selected: mode, bits per second, enabled.
    cr1: u32,
}

/// Every device of the board.
pub type SpiChips = Chips<SpiChip>;

/// Sets pins and bus up. To be called once, from the task that then owns the bus.
pub fn devices() -> SpiChips {
    // SAFETY: the start calls this once, before interrupts are on, and nothing else uses these
    // registers later on but the devices below, which belong to one task.
    let (rcc, a, b) = unsafe { (&*RCC::PTR, &*GPIOA::PTR, &*GPIOB::PTR) };
    rcc.ahb1enr()
        .modify(|_, w| w.gpioaen().enabled().gpioben().enabled());
    rcc.apb2enr().modify(|_, w| w.spi1en().enabled());
    rcc.apb2enr().read();
    let selects = COUNTER_SELECTS
        .into_iter()
        .chain([CONVERTER_SELECT])
        .chain(ACCELEROMETER_SELECTS)
        .fold(0, |all, one| all | one);
    // SAFETY: whole registers of pins that only this program uses; other pins keep what they have.
    unsafe {
        b.bsrr().write(|w| w.bits(u32::from(selects)));
        // Outputs, push-pull, of medium speed.
        for pin in 0..16 {
            if selects & (1 << pin) != 0 {
                b.moder()
                    .modify(|r, w| w.bits(r.bits() & !(3 << (2 * pin)) | 1 << (2 * pin)));
                b.ospeedr().modify(|r, w| w.bits(r.bits() | 1 << (2 * pin)));
            }
        }
        // PA5, PA6, PA7: alternate function 5 (DS8626, “Alternate function mapping”), high speed.
        for pin in 5..8 {
            a.moder()
                .modify(|r, w| w.bits(r.bits() & !(3 << (2 * pin)) | 2 << (2 * pin)));
            a.afrl()
                .modify(|r, w| w.bits(r.bits() & !(15 << (4 * pin)) | 5 << (4 * pin)));
            a.ospeedr().modify(|r, w| w.bits(r.bits() | 2 << (2 * pin)));
        }
        // A line that no chip drives reads zeros.
        a.pupdr()
            .modify(|r, w| w.bits(r.bits() & !(3 << 12) | 2 << 12));
    }
    // Counters take 4 MHz at 3.3 V, the converter 25 MHz, accelerometers 10 MHz (data sheets,
    // timing tables).
    let counter = |select| device(select, divided(4));
    SpiChips {
        latch: counter(COUNTER_SELECTS.into_iter().fold(0, |all, one| all | one)),
        counters: COUNTER_SELECTS.map(counter),
        converter: device(CONVERTER_SELECT, divided(2) | CPHA),
        accelerometers: ACCELEROMETER_SELECTS.map(|select| device(select, divided(3))),
    }
}

fn device(select: u16, speed_and_mode: u32) -> SpiChip {
    SpiChip {
        select,
        cr1: speed_and_mode | MASTER | SOFTWARE_SELECT | ENABLED,
    }
}

impl ErrorType for SpiChip {
    type Error = BusFault;
}

impl SpiDevice for SpiChip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusFault> {
        transaction(self, operations)
    }
}

impl Bytewise for SpiChip {
    type Fault = BusFault;

    fn select(&mut self) {
        // SAFETY: whole registers of a peripheral that only the devices use; they belong to one
        // task, so that no two transactions overlap.
        unsafe {
            bus().cr1().write(|w| w.bits((self.cr1 & !ENABLED) as _));
            bus().cr1().write(|w| w.bits(self.cr1 as _));
            // A byte of a transaction that timed out may have come since.
            bus().dr().read();
            bus().sr().read();
            (*GPIOB::PTR)
                .bsrr()
                .write(|w| w.bits(u32::from(self.select) << 16));
        }
    }

    fn exchange(&mut self, byte: u8) -> Result<u8, BusFault> {
        wait(|flags| flags & ROOM != 0)?;
        // SAFETY: any byte may be sent.
        unsafe { bus().dr().write(|w| w.bits(byte.into())) };
        wait(|flags| flags & RECEIVED != 0)?;
        Ok(bus().dr().read().bits() as u8)
    }

    fn finish(&mut self) -> Result<(), BusFault> {
        wait(|flags| flags & BUSY == 0)
    }

    fn release(&mut self, done: bool) {
        // SAFETY: as in `select`.
        unsafe {
            (*GPIOB::PTR)
                .bsrr()
                .write(|w| w.bits(u32::from(self.select)));
            if !done {
                bus().cr1().write(|w| w.bits((self.cr1 & !ENABLED) as _));
            }
        }
    }
}

fn bus() -> &'static super::chip::spi1::RegisterBlock {
    // SAFETY: the registers exist for as long as the program.
    unsafe { &*SPI1::PTR }
}

fn wait(ready: impl Fn(u32) -> bool) -> Result<(), BusFault> {
    for _ in 0..LOOKS {
        let flags = u32::from(bus().sr().read().bits());
        if flags & MODE_FAULT != 0 {
            return Err(BusFault::ModeFault);
        }
        if flags & OVERRUN != 0 {
            // Reading both registers clears the flag (RM0090, “Overrun flag”).
            bus().dr().read();
            bus().sr().read();
            return Err(BusFault::Overrun);
        }
        if ready(flags) {
            return Ok(());
        }
    }
    Err(BusFault::TimedOut)
}
