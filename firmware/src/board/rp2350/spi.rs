//! SPI0 and the chip selects, on a Pico 2's usual pins.
//!
//! GPIO 16, 18 and 19 are MISO, SCK and MOSI; GPIO 2 to 5 select the counters, 6 the converter, 7
//! and 8 the accelerometers.

use super::PROCESSOR_HZ;
use super::pins::{PLAIN, PULLED_UP, SOFTWARE, SPI, assign};
use crate::board::chips::Chips;
use crate::board::driver::transaction::{Bytewise, transaction};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};
use rp235x_pac::{SIO, SPI0, sio, spi0};

const INPUT: usize = 16;
const CLOCK: usize = 18;
const OUTPUT: usize = 19;
const COUNTER_SELECTS: [usize; COUNTERS] = [2, 3, 4, 5];
const CONVERTER_SELECT: usize = 6;
const ACCELEROMETER_SELECTS: [usize; ACCELEROMETERS] = [7, 8];

// Section 12.3.5: SSPCR0, SSPCR1 and SSPSR.
const EIGHT_BITS: u32 = 7;
/// Data are valid at the clock's second edge.
const TRAILING: u32 = 1 << 7;
const ENABLED: u32 = 1 << 1;
const ROOM: u32 = 1 << 1;
const RECEIVED: u32 = 1 << 2;
const BUSY: u32 = 1 << 4;
/// SSPCPSR: the smallest divider.
const PRESCALED: u32 = 2;
/// Bytes that the receiver's queue holds.
const QUEUE: u32 = 8;

/// SSPCR0: bits per second, as many as `most` or the next fewer.
const fn at_most(most: u32) -> u32 {
    (PROCESSOR_HZ.div_ceil(PRESCALED * most) - 1) << 8
}

/// How often a flag is looked at: a byte takes 3 µs at most at 150 MHz, a look at least 20 ns.
const LOOKS: u32 = 1000;

/// One chip, or several behind one select.
#[derive(Debug)]
pub struct SpiChip {
    /// Pins that are low while it is selected.
    select: u32,
    /// SSPCR0 while it is selected: mode, word length, bits per second.
    control: u32,
}

/// Every device of the board.
pub type SpiChips = Chips<SpiChip>;

/// The bus and the pins, which belong to the one task that has the devices.
fn registers() -> (&'static spi0::RegisterBlock, &'static sio::RegisterBlock) {
    // SAFETY: the registers exist for as long as the program.
    unsafe { (&*SPI0::PTR, &*SIO::PTR) }
}

/// Sets pins and bus up. To be called once, from the task that then owns the bus.
pub fn devices() -> SpiChips {
    let (bus, outputs) = registers();
    for pin in [CLOCK, OUTPUT] {
        assign(pin, SPI, PLAIN);
    }
    // A line that no chip drives reads ones.
    assign(INPUT, SPI, PULLED_UP);
    let selects = COUNTER_SELECTS.into_iter().chain([CONVERTER_SELECT]);
    for pin in selects.chain(ACCELEROMETER_SELECTS) {
        // SAFETY: a pin that only this program uses.
        unsafe {
            outputs.gpio_out_set().write(|w| w.bits(1 << pin));
            outputs.gpio_oe_set().write(|w| w.bits(1 << pin));
        }
        assign(pin, SOFTWARE, PLAIN);
    }
    // SAFETY: whole registers of a peripheral that only the devices use.
    bus.sspcpsr().write(|w| unsafe { w.bits(PRESCALED) });
    let device = |select, speed_and_mode| SpiChip {
        select,
        control: speed_and_mode | EIGHT_BITS,
    };
    // What the chips take at 3.3 V (data sheets, timing tables).
    let counter = |select| device(select, at_most(4_000_000));
    SpiChips {
        latch: counter(
            COUNTER_SELECTS
                .into_iter()
                .fold(0, |all, pin| all | 1 << pin),
        ),
        counters: COUNTER_SELECTS.map(|pin| counter(1 << pin)),
        converter: device(1 << CONVERTER_SELECT, at_most(25_000_000) | TRAILING),
        accelerometers: ACCELEROMETER_SELECTS.map(|pin| device(1 << pin, at_most(10_000_000))),
    }
}

impl ErrorType for SpiChip {
    type Error = ErrorKind;
}

impl SpiDevice for SpiChip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        transaction(self, operations)
    }
}

fn wait(ready: impl Fn(u32) -> bool) -> Result<(), ErrorKind> {
    let (bus, _) = registers();
    let done = (0..LOOKS).any(|_| ready(bus.sspsr().read().bits()));
    done.then_some(()).ok_or(ErrorKind::Other)
}

impl Bytewise for SpiChip {
    type Fault = ErrorKind;

    fn select(&mut self) {
        let (bus, outputs) = registers();
        // SAFETY: whole registers, and the chip's own pins.
        unsafe {
            bus.sspcr1().write(|w| w.bits(0));
            bus.sspcr0().write(|w| w.bits(self.control));
            bus.sspcr1().write(|w| w.bits(ENABLED));
            outputs.gpio_out_clr().write(|w| w.bits(self.select));
        }
        // What a transaction that failed has left.
        for _ in 0..QUEUE {
            bus.sspdr().read();
        }
    }

    fn exchange(&mut self, byte: u8) -> Result<u8, ErrorKind> {
        let (bus, _) = registers();
        wait(|flags| flags & ROOM != 0)?;
        // SAFETY: any byte may be sent.
        bus.sspdr().write(|w| unsafe { w.bits(byte.into()) });
        wait(|flags| flags & RECEIVED != 0)?;
        Ok(bus.sspdr().read().bits() as u8)
    }

    fn finish(&mut self) -> Result<(), ErrorKind> {
        wait(|flags| flags & BUSY == 0)
    }

    fn release(&mut self, _: bool) {
        let (_, outputs) = registers();
        // SAFETY: the chip's own pins.
        outputs
            .gpio_out_set()
            .write(|w| unsafe { w.bits(self.select) });
    }
}
