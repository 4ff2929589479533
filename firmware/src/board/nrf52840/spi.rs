//! SPI0 and the chip selects, on the pins of the kit's header.
//!
//! P1.15, P1.14 and P1.13 are SCK, MISO and MOSI; P1.01 to P1.04 select the counters, P1.05 the
//! converter, P1.06 and P1.07 the accelerometers.

use crate::board::chips::Chips;
use crate::board::driver::transaction::{Bytewise, transaction};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS};
use nrf52840_pac::spi0::frequency::FREQUENCY_A;
use nrf52840_pac::{P1, SPI0, p0, spi0};

const CLOCK: usize = 15;
const INPUT: usize = 14;
const OUTPUT: usize = 13;
const COUNTER_SELECTS: [u32; COUNTERS] = [1 << 1, 1 << 2, 1 << 3, 1 << 4];
const CONVERTER_SELECT: u32 = 1 << 5;
const ACCELEROMETER_SELECTS: [u32; ACCELEROMETERS] = [1 << 6, 1 << 7];

/// The number of a pin of port 1 where a peripheral selects one.
const fn selected(pin: usize) -> u32 {
    1 << 5 | pin as u32
}
/// PIN_CNF (“GPIO”): an output; an input that reads zeros where no chip drives it.
const DRIVEN: u32 = 0b11;
const PULLED_DOWN: u32 = 1 << 2;

/// How often a flag is looked at: a byte takes 4 µs at most, a look at least 60 ns.
const LOOKS: u32 = 1000;

/// One chip, or several behind one select.
#[derive(Debug)]
pub struct SpiChip {
    /// Pins of port 1 that are low while it is selected.
    select: u32,
    speed: FREQUENCY_A,
    /// Data are valid at the clock's second edge.
    trailing: bool,
}

/// Every device of the board.
pub type SpiChips = Chips<SpiChip>;

/// The bus and the pins, which belong to the one task that has the devices.
fn registers() -> (&'static spi0::RegisterBlock, &'static p0::RegisterBlock) {
    // SAFETY: the registers exist for as long as the program.
    unsafe { (&*SPI0::PTR, &*P1::PTR) }
}

/// Sets pins and bus up. To be called once, from the task that then owns the bus.
pub fn devices() -> SpiChips {
    let (bus, pins) = registers();
    let latch = COUNTER_SELECTS.into_iter().fold(0, |all, one| all | one);
    let selects = ACCELEROMETER_SELECTS
        .into_iter()
        .fold(latch | CONVERTER_SELECT, |all, one| all | one);
    // SAFETY: whole registers of pins that only this program uses.
    unsafe {
        pins.outset.write(|w| w.bits(selects));
        pins.dirset.write(|w| w.bits(selects));
        pins.pin_cnf[CLOCK].write(|w| w.bits(DRIVEN));
        pins.pin_cnf[OUTPUT].write(|w| w.bits(DRIVEN));
        pins.pin_cnf[INPUT].write(|w| w.bits(PULLED_DOWN));
        bus.psel.sck.write(|w| w.bits(selected(CLOCK)));
        bus.psel.mosi.write(|w| w.bits(selected(OUTPUT)));
        bus.psel.miso.write(|w| w.bits(selected(INPUT)));
    }
    // Counters take 4 MHz at 3.3 V, the converter 25 MHz, accelerometers 10 MHz (data sheets,
    // timing tables).
    let device = |speed, trailing| {
        move |select| SpiChip {
            select,
            speed,
            trailing,
        }
    };
    let counter = device(FREQUENCY_A::M2, false);
    SpiChips {
        latch: counter(latch),
        counters: COUNTER_SELECTS.map(counter),
        converter: device(FREQUENCY_A::M8, true)(CONVERTER_SELECT),
        accelerometers: ACCELEROMETER_SELECTS.map(device(FREQUENCY_A::M8, false)),
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

impl Bytewise for SpiChip {
    type Fault = ErrorKind;

    fn select(&mut self) {
        let (bus, pins) = registers();
        bus.enable.write(|w| w.enable().disabled());
        bus.frequency.write(|w| w.frequency().variant(self.speed));
        bus.config.write(|w| w.cpha().bit(self.trailing));
        bus.enable.write(|w| w.enable().enabled());
        // SAFETY: the chip's own pins.
        pins.outclr.write(|w| unsafe { w.bits(self.select) });
    }

    fn exchange(&mut self, byte: u8) -> Result<u8, ErrorKind> {
        let (bus, _) = registers();
        bus.events_ready.reset();
        // SAFETY: any byte may be sent.
        bus.txd.write(|w| unsafe { w.bits(byte.into()) });
        if (0..LOOKS).any(|_| bus.events_ready.read().bits() != 0) {
            Ok(bus.rxd.read().bits() as u8)
        } else {
            Err(ErrorKind::Other)
        }
    }

    /// A byte that has come has also gone.
    fn finish(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }

    fn release(&mut self, done: bool) {
        let (bus, pins) = registers();
        // SAFETY: the chip's own pins.
        pins.outset.write(|w| unsafe { w.bits(self.select) });
        if !done {
            bus.enable.write(|w| w.enable().disabled());
        }
    }
}
