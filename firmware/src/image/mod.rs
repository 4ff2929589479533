//! The monitor on the board: hangs the steps of a sample to interrupts, each with its priority, and
//! starts them.
//!
//! Two images are made of it, which differ in the feature `semihosting-link` alone: with it, sensor
//! chips, serial line, sampling clock and slots are the host's.

mod log;

use jointwatch_firmware::app::{Shared, Watch};
use jointwatch_firmware::board::restart;
use rtic::Mutex;

/// The watch behind its lock.
struct Locked<T>(T);

impl<T: Mutex<T = &'static mut Watch>> Shared for Locked<T> {
    fn with<R>(&mut self, what: impl FnOnce(&mut Watch) -> R) -> R {
        self.0.lock(|watch| what(watch))
    }
}

#[rtic::app(device = jointwatch_firmware::board::stm32f405::chip, peripherals = false)]
mod app {
    use super::{Locked, log};
    use core::mem::MaybeUninit;
    use core::sync::atomic::{AtomicBool, Ordering};
    use heapless::spsc::{Consumer, Producer, Queue};
    use jointwatch_firmware::app::{
        Begun, Evaluated, Evaluator, Frame, Lost, Progress, Room, Sampler, Server, Setup, Streamed,
        Watch, begin, evaluate,
    };
    use jointwatch_firmware::board::Kernels;
    use jointwatch_firmware::board::stm32f405::chip::Interrupt;
    use jointwatch_firmware::board::stm32f405::parts::{
        self, Serial, SlotFlash, SpiChip, SpiChips, Ticker,
    };
    use jointwatch_firmware::board::stm32f405::watchdog;
    use jointwatch_firmware::board::{restart, stack, stm32f405 as board};
    use jointwatch_firmware::key::{IS_DEVELOPMENT_KEY, trust};
    use jointwatch_firmware::sensor::acquire::Sensors;
    use jointwatch_firmware::store::{Key, Store};
    use jointwatch_shared::wire::telemetry::Occasion;

    /// Frames between sampling and evaluation, and between that and the monitor: one less fits.
    const FRAMES: usize = 4;
    /// Samples that wait for the serial line.
    const STREAMED: usize = 8;
    /// Received bytes that wait to be looked at.
    const RECEIVED: usize = 512;

    /// The line was served since the watchdog was fed last.
    static SERVED: AtomicBool = AtomicBool::new(true);

    #[shared]
    struct Shared {
        watch: &'static mut Watch,
    }

    #[local]
    struct Local {
        ticker: Ticker,
        sampler: Sampler<SpiChip, SpiChip, SpiChip, SpiChip>,
        frames_in: Producer<'static, Frame>,
        frames: Consumer<'static, Frame>,
        evaluator: Option<&'static mut Evaluator>,
        evaluated_in: Producer<'static, Evaluated>,
        lost: Lost,
        progress: Progress,
        evaluated: Consumer<'static, Evaluated>,
        stream_in: Producer<'static, Streamed>,
        stream: Consumer<'static, Streamed>,
        server: &'static mut Server<SlotFlash, Key, Serial>,
        received_in: Producer<'static, u8>,
        received: Consumer<'static, u8>,
    }

    #[init(local = [
        room: Room = Room::EMPTY,
        server_room: MaybeUninit<Server<SlotFlash, Key, Serial>> = MaybeUninit::uninit(),
        frame_queue: Queue<Frame, FRAMES> = Queue::new(),
        evaluated_queue: Queue<Evaluated, FRAMES> = Queue::new(),
        stream_queue: Queue<Streamed, STREAMED> = Queue::new(),
        received_queue: Queue<u8, RECEIVED> = Queue::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        stack::paint();
        let why = restart::why();
        let (clock, _) = board::start();
        watchdog::start();
        parts::open();
        log::start(clock, why);
        let trust = trust();
        let mut store = Store::new(parts::slots(), trust);
        let setup = Setup {
            clock,
            why,
            signed: !trust.unsigned,
            development_key: IS_DEVELOPMENT_KEY,
        };
        let begun = begin(&mut store, setup, cx.local.room, log::slots);
        log::begun(&begun);
        begun.watch.keep_counts(parts::counts_around_alarm());
        let Begun {
            evaluator,
            rate,
            wiring,
            mut watch,
            hello,
            ..
        } = begun;
        let SpiChips {
            latch,
            counters,
            converter,
            accelerometers,
        } = parts::devices();
        let sensors = Sensors::new(&wiring, latch, counters, converter, accelerometers);
        let serial = parts::start_serial(clock);
        let server = cx
            .local
            .server_room
            .write(Server::new(store, hello, serial));
        server.introduce(Occasion::Restart, &mut watch);
        let (frames_in, frames) = cx.local.frame_queue.split();
        let (evaluated_in, evaluated) = cx.local.evaluated_queue.split();
        let (stream_in, stream) = cx.local.stream_queue.split();
        let (received_in, received) = cx.local.received_queue.split();
        let local = Local {
            ticker: parts::start_ticker(clock, rate),
            sampler: Sampler::new(sensors, wiring),
            frames_in,
            frames,
            evaluator,
            evaluated_in,
            lost: Lost::default(),
            progress: Progress::default(),
            evaluated,
            stream_in,
            stream,
            server,
            received_in,
            received,
        };
        watchdog::feed();
        defmt::info!("ready");
        (Shared { watch }, local)
    }

    /// Bytes from the serial line have to be fetched within 10 µs of each other; it takes a
    /// fraction of one.
    #[task(binds = USART2, priority = 5, local = [received_in])]
    fn receive(cx: receive::Context) {
        while let Some(byte) = parts::received() {
            // What finds no room is missed by its frame's checksum.
            let _ = cx.local.received_in.enqueue(byte);
        }
        rtic::pend(Interrupt::UART5);
    }

    #[task(binds = TIM2, priority = 4, local = [ticker, sampler, frames_in])]
    fn sample(cx: sample::Context) {
        let begun = board::count();
        let missed = cx.local.ticker.tick();
        cx.local.sampler.sample(missed, cx.local.frames_in);
        rtic::pend(Interrupt::UART4);
        parts::stage(0, begun);
    }

    /// Borrows the vector of a peripheral that is not used, as the steps after it do.
    #[task(binds = UART4, priority = 3, local = [evaluator, frames, evaluated_in, lost, progress])]
    fn evaluate_frames(cx: evaluate_frames::Context) {
        let begun = board::count();
        let newest = evaluate::<Kernels>(
            cx.local.evaluator.as_deref_mut(),
            cx.local.frames,
            cx.local.evaluated_in,
            cx.local.lost,
        );
        if cx.local.progress.made(newest, &SERVED) {
            watchdog::feed();
        }
        rtic::pend(Interrupt::USART6);
        parts::stage(1, begun);
    }

    #[task(binds = USART6, priority = 2, shared = [watch], local = [evaluated, stream_in])]
    fn monitor(mut cx: monitor::Context) {
        let begun = board::count();
        while let Some(evaluated) = cx.local.evaluated.peek() {
            cx.shared.watch.lock(|watch| {
                if let Some(streamed) = watch.update(evaluated)
                    && cx.local.stream_in.enqueue(streamed).is_err()
                {
                    watch.dropped(1);
                }
            });
            let _ = cx.local.evaluated.dequeue();
        }
        rtic::pend(Interrupt::UART5);
        parts::stage(2, begun);
    }

    #[task(binds = UART5, priority = 1, shared = [watch], local = [server, stream, received])]
    fn serve(cx: serve::Context) {
        let begun = board::count();
        let mut watch = Locked(cx.shared.watch);
        let received = cx.local.received;
        cx.local.server.hear(|| received.dequeue(), &mut watch);
        if received.ready() {
            rtic::pend(Interrupt::UART5);
        }
        cx.local.server.turn(cx.local.stream, &mut watch);
        if watch.0.lock(|watch| watch.restart_now()) {
            restart::on_purpose();
        }
        SERVED.store(true, Ordering::Relaxed);
        parts::stage(3, begun);
    }

    /// Everything is done by interrupts; the image for tests sets them off here, as the host wants
    /// it.
    #[idle]
    fn idle(_: idle::Context) -> ! {
        let sample = || rtic::pend(Interrupt::TIM2);
        let receive = || rtic::pend(Interrupt::USART2);
        parts::run(sample, receive)
    }
}

/// A fault has no better answer than a fresh start, which says that there was one.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    restart::after_fault()
}

/// Nothing that runs per sample leads here: a test finds what does in the release image.
///
/// The undefined instruction leads to the fault above; were the two functions alike, the linker
/// would make them one and the test could not tell them apart.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    cortex_m::asm::udf()
}
