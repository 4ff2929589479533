//! USART2: telemetry out, requests in, at one million bits per second.

use super::chip::{GPIOA, RCC, USART2};
use crate::app::SerialPort;
use crate::board::driver::sending::send;
use crate::clock::{Clock, Source};
use jointwatch_shared::wire::telemetry::BAUD;

// USART_SR, RM0090, “Status register”.
const OVERRUN: u32 = 1 << 3;
const RECEIVED: u32 = 1 << 5;
const ROOM: u32 = 1 << 7;
/// USART_CR1: on, interrupt when a byte has come, transmitter and receiver on.
const ENABLED: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

/// The transmitter of the serial line: USART and its DMA.
#[derive(Debug)]
pub struct Serial(());

/// Sets pins and speed up. To be called once.
pub fn start(clock: Clock) -> Serial {
    // SAFETY: the start calls this once, before interrupts are on. Later on the transmitter belongs
    // to one task, the receiver to one interrupt.
    let (rcc, a, usart) = unsafe { (&*RCC::PTR, &*GPIOA::PTR, &*USART2::PTR) };
    rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
    rcc.apb1enr().modify(|_, w| w.usart2en().enabled());
    rcc.apb1enr().read();
    // With the crystal the bus runs at a quarter of the processor's clock.
    let bus = match clock.source {
        Source::Crystal => clock.hz / 4,
        Source::Internal => clock.hz,
    };
    // SAFETY: whole registers; PA2 and PA3 have alternate function 7 (DS8626, “Alternate function
    // mapping”). The divider is in sixteenths, and so is the register (RM0090, “Fractional baud
    // rate generation”).
    unsafe {
        for pin in 2..4 {
            a.moder()
                .modify(|r, w| w.bits(r.bits() & !(3 << (2 * pin)) | 2 << (2 * pin)));
            a.afrl()
                .modify(|r, w| w.bits(r.bits() & !(15 << (4 * pin)) | 7 << (4 * pin)));
        }
        // An idle line is high; without a pull-up an open one would look like a byte.
        a.pupdr()
            .modify(|r, w| w.bits(r.bits() & !(3 << 6) | 1 << 6));
        usart.brr().write(|w| w.bits((bus / BAUD) as _));
        usart.cr1().write(|w| w.bits(ENABLED as _));
    }
    Serial(())
}

impl SerialPort for Serial {
    const BAUD: Option<u32> = Some(BAUD);

    /// Waits for the line, in the task that has nothing before it: whatever else is due interrupts
    /// it.
    fn send(&mut self, frame: &[u8]) -> bool {
        // SAFETY: see `start`.
        let usart = unsafe { &*USART2::PTR };
        let has_room = || u32::from(usart.sr().read().bits()) & ROOM != 0;
        send(frame, has_room, |byte| {
            // SAFETY: any byte may be sent.
            unsafe { usart.dr().write(|w| w.bits(byte.into())) };
        })
    }
}

/// The byte that has come, if one has. A byte that was not fetched before the next came is lost;
/// its frame then fails its checksum.
pub fn received() -> Option<u8> {
    // SAFETY: see `start`.
    let usart = unsafe { &*USART2::PTR };
    let flags = u32::from(usart.sr().read().bits());
    // Reading the byte clears both flags.
    (flags & (RECEIVED | OVERRUN) != 0).then(|| usart.dr().read().bits() as u8)
}
