//! UART 0: telemetry out, requests in.

use super::{CLOCK_HZ, Register, unmask};
use crate::app::SerialPort;
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use heapless::Deque;
use jointwatch_shared::wire::telemetry::BAUD;

/// The interrupt of a received byte.
pub const INTERRUPT: i16 = 0;

const DATA: Register = Register(0x4000_4000);
const STATE: Register = Register(0x4000_4004);
const CONTROL: Register = Register(0x4000_4008);
const CLEAR: Register = Register(0x4000_400C);
const DIVIDER: Register = Register(0x4000_4010);
/// STATE: the transmitter has no room, and the receiver has a byte.
const FULL: u32 = 1;
const WAITING: u32 = 1 << 1;
/// CONTROL: transmitter and receiver on, with the receiver's interrupt.
const ENABLED: u32 = 1 << 3 | 1 << 1 | 1;
/// CLEAR: the receiver's interrupt.
const RECEIVED: u32 = 1 << 1;

/// How often a flag is looked at: a byte takes 10 µs, a look at least 40 ns.
const LOOKS: u32 = 10_000;

/// Received bytes that wait to be looked at.
static BYTES: Mutex<RefCell<Deque<u8, 512>>> = Mutex::new(RefCell::new(Deque::new()));

/// The transmitter of the serial line.
#[derive(Debug)]
pub struct Serial(());

/// Starts the line. To be called once.
pub fn start() -> Serial {
    DIVIDER.write(CLOCK_HZ / BAUD);
    CONTROL.write(ENABLED);
    unmask(INTERRUPT.cast_unsigned());
    Serial(())
}

impl SerialPort for Serial {
    const BAUD: Option<u32> = Some(BAUD);

    fn send(&mut self, frame: &[u8]) -> bool {
        frame.iter().all(|&byte| {
            let room = (0..LOOKS).any(|_| STATE.read() & FULL == 0);
            if room {
                DATA.write(byte.into());
            }
            room
        })
    }
}

/// What the interrupt of a received byte does. What finds no room is missed by its frame's
/// checksum.
pub fn interrupt() {
    // First: a byte that comes later than the last look below then interrupts again.
    CLEAR.write(RECEIVED);
    while STATE.read() & WAITING != 0 {
        let byte = DATA.read() as u8;
        let _ = free(|section| BYTES.borrow(section).borrow_mut().push_back(byte));
    }
}

/// The next byte that has come, if one has.
pub fn received() -> Option<u8> {
    free(|section| BYTES.borrow(section).borrow_mut().pop_front())
}
