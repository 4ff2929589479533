//! The self-test image: runs the suite on this processor and ends with exit code 0 when everything
//! passed, else 1.

use jointwatch_firmware::board::Kernels;
#[cfg(feature = "an500")]
use jointwatch_firmware::board::an500 as board;
#[cfg(feature = "microbit")]
use jointwatch_firmware::board::microbit as board;
#[cfg(feature = "nrf52840")]
use jointwatch_firmware::board::nrf52840 as board;
#[cfg(feature = "rp2350")]
use jointwatch_firmware::board::rp2350 as board;
use jointwatch_firmware::board::semihosting;
#[cfg(feature = "stm32")]
use jointwatch_firmware::board::stm32f405 as board;
use jointwatch_firmware::suite::{self, Board};

#[cortex_m_rt::entry]
fn main() -> ! {
    let (clock, counter) = board::start();
    let board = Board {
        name: board::NAME,
        clock,
        slots: &board::slots(),
        counter,
    };
    let mut room = [0; semihosting::MAX_COMMAND_LINE];
    let line = semihosting::command_line(&mut room);
    let passed = semihosting::text()
        .map(|mut text| suite::run::<Kernels>(&board, line, &mut text))
        .is_some_and(|outcome| outcome == Ok(true));
    semihosting::exit(passed)
}

/// A fault ends the run as a failure instead of hanging it.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    semihosting::exit(false)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    semihosting::exit(false)
}

/// Nothing here turns an interrupt on, so one that comes is a failure too.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    semihosting::exit(false)
}
