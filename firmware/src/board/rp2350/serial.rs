//! UART0: telemetry out on GPIO 0, requests in on GPIO 1, at one million bits per second.

use super::pins::{PLAIN, PULLED_UP, UART, assign};
use crate::app::SerialPort;
use crate::board::driver::sending::send;
use crate::clock::Clock;
use jointwatch_shared::wire::telemetry::BAUD;
use rp235x_pac::UART0;

const TRANSMIT: usize = 0;
const RECEIVE: usize = 1;

// Section 12.1.8: UARTFR, UARTLCR_H, UARTCR and UARTIMSC.
const EMPTY: u32 = 1 << 4;
const FULL: u32 = 1 << 5;
/// Eight bits, with both queues.
const FORMAT: u32 = 3 << 5 | 1 << 4;
/// On, transmitter and receiver.
const ENABLED: u32 = 1 << 9 | 1 << 8 | 1;
/// Interrupts when the receiver's queue has some bytes, and when its last one has waited.
const RECEIVED: u32 = 1 << 6 | 1 << 4;

/// The transmitter of the serial line.
#[derive(Debug)]
pub struct Serial(());

fn uart() -> &'static rp235x_pac::uart0::RegisterBlock {
    // SAFETY: the registers exist for as long as the program. The transmitter belongs to one task,
    // the receiver to one interrupt.
    unsafe { &*UART0::PTR }
}

/// Sets pins and speed up. To be called once; interrupt `UART0_IRQ` says that bytes have come.
/// Without the crystal the clock is too slow for this line.
pub fn start(clock: Clock) -> Serial {
    assign(TRANSMIT, UART, PLAIN);
    assign(RECEIVE, UART, PULLED_UP);
    // Sixteenths of the clock per bit, in 1/64.
    let divider = 4 * clock.hz / BAUD;
    // SAFETY: whole registers; the divider is taken over when the format is written (section
    // 12.1.7.1).
    unsafe {
        uart().uartibrd().write(|w| w.bits(divider / 64));
        uart().uartfbrd().write(|w| w.bits(divider % 64));
        uart().uartlcr_h().write(|w| w.bits(FORMAT));
        uart().uartimsc().write(|w| w.bits(RECEIVED));
        uart().uartcr().write(|w| w.bits(ENABLED));
    }
    Serial(())
}

impl SerialPort for Serial {
    const BAUD: Option<u32> = Some(BAUD);

    fn send(&mut self, frame: &[u8]) -> bool {
        let has_room = || uart().uartfr().read().bits() & FULL == 0;
        send(frame, has_room, |byte| {
            // SAFETY: any byte may be sent.
            uart().uartdr().write(|w| unsafe { w.bits(byte.into()) });
        })
    }
}

/// The byte that has come, if one has.
pub fn received() -> Option<u8> {
    let has_come = uart().uartfr().read().bits() & EMPTY == 0;
    has_come.then(|| uart().uartdr().read().bits() as u8)
}
