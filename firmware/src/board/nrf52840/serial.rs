//! UART0 at one million bits per second: telemetry out on P0.06, requests in on P0.08, byte by
//! byte.

use crate::app::SerialPort;
use jointwatch_shared::wire::telemetry::BAUD;
use nrf52840_pac::{P0, UART0};

const TRANSMIT: usize = 6;
const RECEIVE: usize = 8;
/// PIN_CNF (“GPIO”): an output; an input with a pull-up, as an idle line is high.
const OUTPUT: u32 = 0b11;
const PULLED_UP: u32 = 3 << 2;

const _: () = assert!(BAUD == 1_000_000, "the register below says so");

/// How often a flag is looked at: a byte takes 10 µs, a look at least 60 ns.
const LOOKS: u32 = 10_000;

/// The transmitter of the serial line.
#[derive(Debug)]
pub struct Serial(());

fn uart() -> &'static nrf52840_pac::uart0::RegisterBlock {
    // SAFETY: the registers exist for as long as the program. The transmitter belongs to one task,
    // the receiver to one interrupt.
    unsafe { &*UART0::PTR }
}

/// Sets pins and speed up. To be called once; interrupt `UARTE0_UART0` says that a byte has come.
pub fn start() -> Serial {
    // SAFETY: the start calls this once, before interrupts are on.
    let pins = unsafe { &*P0::PTR };
    // SAFETY: whole registers of pins that only this program uses; a pin is selected by its number,
    // a task triggered by a one (“UART”).
    unsafe {
        pins.outset.write(|w| w.bits(1 << TRANSMIT));
        pins.pin_cnf[TRANSMIT].write(|w| w.bits(OUTPUT));
        pins.pin_cnf[RECEIVE].write(|w| w.bits(PULLED_UP));
        uart().psel.txd.write(|w| w.bits(TRANSMIT as u32));
        uart().psel.rxd.write(|w| w.bits(RECEIVE as u32));
        uart().baudrate.write(|w| w.baudrate().baud1m());
        uart().enable.write(|w| w.enable().enabled());
        uart().intenset.write(|w| w.rxdrdy().set());
        uart().tasks_startrx.write(|w| w.bits(1));
        uart().tasks_starttx.write(|w| w.bits(1));
    }
    Serial(())
}

impl SerialPort for Serial {
    const BAUD: Option<u32> = Some(BAUD);

    fn send(&mut self, frame: &[u8]) -> bool {
        frame.iter().all(|&byte| {
            uart().events_txdrdy.reset();
            // SAFETY: any byte may be sent.
            uart().txd.write(|w| unsafe { w.bits(byte.into()) });
            (0..LOOKS).any(|_| uart().events_txdrdy.read().bits() != 0)
        })
    }
}

/// The byte that has come, if one has.
pub fn received() -> Option<u8> {
    let has_come = uart().events_rxdrdy.read().bits() != 0;
    has_come.then(|| {
        // First: reading the byte brings the next one, and its event (“UART”, reception).
        uart().events_rxdrdy.reset();
        uart().rxd.read().bits() as u8
    })
}
