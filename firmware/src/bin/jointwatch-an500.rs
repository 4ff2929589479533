//! The monitor on the MPS2+ board AN500: the same four steps of a sample as on the STM32F405, one
//! after the other in a loop.
#![no_std]
#![no_main]

use cortex_m::peripheral::SCB;
use heapless::spsc::Queue;
use jointwatch_firmware::app::{
    Begun, Evaluated, Frame, Lost, Room, Sampler, Server, Setup, Streamed, begin, evaluate,
};
use jointwatch_firmware::board::Kernels;
use jointwatch_firmware::board::an500::chips::NoChip;
use jointwatch_firmware::board::an500::{self as board, memory, serial, ticker};
use jointwatch_firmware::key::{IS_DEVELOPMENT_KEY, trust};
use jointwatch_firmware::sensor::acquire::Sensors;
use jointwatch_firmware::store::Store;
use jointwatch_shared::wire::telemetry::{Occasion, Restart};

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut ROOM: Room = Room::EMPTY;
    static mut FRAMES: Queue<Frame, 4> = Queue::new();
    static mut EVALUATED: Queue<Evaluated, 4> = Queue::new();
    static mut STREAM: Queue<Streamed, 8> = Queue::new();
    let (clock, _) = board::start();
    let trust = trust();
    let mut store = Store::new(memory::slots(), trust);
    let setup = Setup {
        clock,
        why: Restart::Unknown,
        signed: !trust.unsigned,
        development_key: IS_DEVELOPMENT_KEY,
    };
    let Begun {
        mut evaluator,
        rate,
        wiring,
        mut watch,
        hello,
        ..
    } = begin(&mut store, setup, ROOM, |_| ());
    let sensors = Sensors::new(
        &wiring,
        NoChip,
        [NoChip, NoChip, NoChip, NoChip],
        NoChip,
        [NoChip, NoChip],
    );
    let mut sampler = Sampler::new(sensors, wiring);
    let mut server = Server::new(store, hello, serial::start());
    server.introduce(Occasion::Restart, &mut watch);
    let (mut frames_in, mut frames) = FRAMES.split();
    let (mut evaluated_in, mut evaluated) = EVALUATED.split();
    let (mut stream_in, mut stream) = STREAM.split();
    let mut lost = Lost::default();
    ticker::start(clock, rate);
    loop {
        server.hear(serial::received, &mut watch);
        let Some(missed) = ticker::due() else {
            continue;
        };
        sampler.sample(missed, &mut frames_in);
        let evaluator = evaluator.as_deref_mut();
        evaluate::<Kernels>(evaluator, &mut frames, &mut evaluated_in, &mut lost);
        while let Some(evaluated) = evaluated.dequeue() {
            if let Some(streamed) = watch.update(&evaluated)
                && stream_in.enqueue(streamed).is_err()
            {
                watch.dropped(1);
            }
        }
        server.turn(&mut stream, &mut watch);
        if watch.restart_now() {
            SCB::sys_reset();
        }
    }
}

/// The two interrupts that are on; any other one is a fault.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    match number {
        ticker::INTERRUPT => ticker::interrupt(),
        serial::INTERRUPT => serial::interrupt(),
        _ => SCB::sys_reset(),
    }
}

/// A fault has no better answer than a fresh start.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    cortex_m::asm::udf()
}
