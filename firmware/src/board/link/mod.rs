//! Sensor chips, serial line and sampling clock behind two files of the host, for tests under QEMU.
//!
//! `docs/notebook/emulation.md`, “The link”, has the protocol. It takes the place of
//! `stm32f405/{spi,serial,ticker,flash}.rs` in the image that tests run; everything else of that
//! image is what is flashed.

mod chips;
mod files;
mod slots;

pub use chips::{SpiChip, SpiChips, devices};
pub use files::open;
pub use slots::{SlotFlash, slots};

use super::{stack, stm32f405};
use crate::app::SerialPort;
use crate::board::chunks::hand_out;
use crate::clock::{Clock, Rate};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use files::Files;
use jointwatch_shared::wire::capture::Chunk;

/// Kinds of requests beyond the chips'.
const WAIT: u8 = 0x10;
const SEND: u8 = 0x11;
const RECEIVE: u8 = 0x12;
const STAGES: u8 = 0x13;
const MEMORY: u8 = 0x14;
const STARTED: u8 = 0x15;

/// Answers to [`WAIT`]: the record has ended, or the device restarts. Any other byte counts the
/// instants since the last sample.
const ENDED: u8 = 0;
const RESTART: u8 = 0xFF;

/// Samples from one request for received bytes to the next.
const RECEIVE_EVERY: u32 = 8;
/// Received bytes that are asked for at once.
const ROOM: usize = 256;

/// The steps of a sample whose instructions are counted, in this order: sample, evaluate, monitor,
/// serve.
pub const STAGE_COUNT: usize = 4;
static COUNTS: [AtomicU32; STAGE_COUNT] = [const { AtomicU32::new(0) }; STAGE_COUNT];
static MISSED: AtomicU32 = AtomicU32::new(0);

/// Received bytes, how many there are, and how many were taken.
static BYTES: [AtomicU8; ROOM] = [const { AtomicU8::new(0) }; ROOM];
static FETCHED: AtomicU32 = AtomicU32::new(0);
static TAKEN: AtomicU32 = AtomicU32::new(0);

/// Counts what a stage has executed since `begun`.
pub fn stage(number: usize, begun: u32) {
    if let Some(count) = COUNTS.get(number) {
        // Stages run one after the other, so nothing comes between.
        let sum = count.load(Ordering::Relaxed);
        let now = stm32f405::count();
        count.store(sum.wrapping_add(now.wrapping_sub(begun)), Ordering::Relaxed);
    }
}

/// The sampling clock: the host.
#[derive(Debug)]
pub struct Ticker(());

/// The host says when to sample, whatever the rate.
pub fn start_ticker(_: Clock, _: Rate) -> Ticker {
    Ticker(())
}

impl Ticker {
    /// How many instants before this one went by without a sample, as the host wants it.
    pub fn tick(&mut self) -> u32 {
        MISSED.load(Ordering::Relaxed)
    }
}

/// The serial line: the host takes everything at once.
#[derive(Debug)]
pub struct Serial(());

/// The line is there from the beginning.
pub fn start_serial(_: Clock) -> Serial {
    Serial(())
}

impl SerialPort for Serial {
    const BAUD: Option<u32> = None;

    fn send(&mut self, frame: &[u8]) -> bool {
        Files.request(SEND, frame);
        true
    }
}

/// What is left of the memory, for the counts around an alarm.
pub fn counts_around_alarm() -> &'static mut [Chunk] {
    static mut ROOM: MaybeUninit<[Chunk; slots::CHUNKS]> = MaybeUninit::uninit();
    static TAKEN: AtomicBool = AtomicBool::new(false);
    // SAFETY: both are used here only.
    unsafe { hand_out(&raw mut ROOM, &TAKEN) }
}

/// Runs the device as the host wants it: `sample` and `receive` set the interrupts off that the
/// board's hardware would, which come to their end before they return. Ends the program with the
/// record.
pub fn run(sample: fn(), receive: fn()) -> ! {
    let files = Files;
    files.request(STARTED, &stm32f405::count().to_le_bytes());
    let mut until_receive = 0;
    loop {
        if until_receive == 0 {
            until_receive = RECEIVE_EVERY;
            fetch(files);
            receive();
        }
        until_receive -= 1;
        files.request(WAIT, &[]);
        let mut answer = [ENDED];
        files.answer(&mut answer);
        match answer {
            [ENDED] => finish(files),
            [RESTART] => super::restart::on_purpose(),
            [instants] => MISSED.store(u32::from(instants) - 1, Ordering::Relaxed),
        }
        sample();
        if files.counts() {
            let mut bytes = [[0; 4]; STAGE_COUNT];
            for (place, count) in bytes.iter_mut().zip(&COUNTS) {
                *place = count.load(Ordering::Relaxed).to_le_bytes();
                count.store(0, Ordering::Relaxed);
            }
            files.request(STAGES, bytes.as_flattened());
        }
    }
}

/// Fetches the bytes that the host sends over the serial line.
fn fetch(files: Files) {
    files.request(RECEIVE, &(ROOM as u16).to_le_bytes());
    let mut count = [0; 2];
    files.answer(&mut count);
    let count = usize::from(u16::from_le_bytes(count)).min(ROOM);
    let mut room = [0; ROOM];
    let bytes = room.get_mut(..count).unwrap_or_default();
    files.answer(bytes);
    for (place, &byte) in BYTES.iter().zip(&*bytes) {
        place.store(byte, Ordering::Relaxed);
    }
    TAKEN.store(0, Ordering::Relaxed);
    FETCHED.store(count as u32, Ordering::Relaxed);
}

/// The next byte that has come, if one has.
pub fn received() -> Option<u8> {
    let taken = TAKEN.load(Ordering::Relaxed);
    if taken >= FETCHED.load(Ordering::Relaxed) {
        return None;
    }
    TAKEN.store(taken + 1, Ordering::Relaxed);
    let place = BYTES.get(taken as usize)?;
    Some(place.load(Ordering::Relaxed))
}

/// Says what memory was used, and ends.
fn finish(files: Files) -> ! {
    if files.counts() {
        let variables = stack::variables().saturating_sub(slots::EMULATED);
        let figures = [stack::reserved(), stack::peak(), variables];
        let bytes = figures.map(|bytes| (bytes as u32).to_le_bytes());
        files.request(MEMORY, bytes.as_flattened());
    }
    super::semihosting::exit(true)
}
