//! A device on the bench: slots in memory, a line that keeps everything, chips that answer zeros.

use super::flash;
use super::signing::{CLASS, header, keys, signature};
use embedded_hal::spi::{ErrorType as SpiError, Operation, SpiDevice};
use heapless::spsc::{Consumer, Producer, Queue};
use jointwatch_firmware::app::{
    Evaluated, Evaluator, Frame, Lost, Room, Sampler, SerialPort, Server, Setup, Streamed, Watch,
    begin, evaluate,
};
use jointwatch_firmware::clock::Clock;
use jointwatch_firmware::sensor::acquire::{CHIPS, Sensors};
use jointwatch_firmware::sensor::presence::ChipState;
use jointwatch_firmware::store::{Key, Store, Trust};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::kernels::Portable;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::limits::{AxisLimits, Cusum, Limits, TwoSided};
use jointwatch_shared::selftest::chain::{self, SHORT_TAPS};
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block;
use jointwatch_shared::wire::slot::{
    ENTRY_LEN, Header, MARKED, RIG_OFFSET, SEAL_LEN, SEAL_OFFSET, SEALED_OFFSET, SLOT_LEN, Seal,
};
use jointwatch_shared::wire::telemetry::{
    Decoder, MAX_FRAME, Occasion, Report, Request, Restart, Signature, encode,
};
use std::convert::Infallible;

/// Samples per second of the rig.
pub(crate) const RATE_HZ: u64 = 32;
/// A slot of the bench's flash.
const SECTOR: usize = SLOT_LEN + 200 * ENTRY_LEN;

/// Flash in memory with one slot in each sector.
pub(crate) type Flash = flash::Flash<SECTOR>;

/// What a slot holds.
#[derive(Clone)]
pub(crate) enum Slot {
    Empty,
    Bytes(Vec<u8>),
}

impl Slot {
    pub(crate) fn signature(&self) -> Option<Signature> {
        let Self::Bytes(bytes) = self else {
            return None;
        };
        let seal = bytes[SEAL_OFFSET..][..SEAL_LEN].try_into().unwrap();
        Some(Signature::new(Seal::decode(seal).unwrap().signature?))
    }

    pub(crate) fn header(&self) -> Header {
        let Self::Bytes(bytes) = self else {
            panic!("an empty slot")
        };
        let seal = bytes[SEAL_OFFSET..][..SEAL_LEN].try_into().unwrap();
        Seal::decode(seal).unwrap().header
    }
}

/// Model and rig block of a slot.
pub(crate) fn content(slot: &Slot) -> Vec<u8> {
    let Slot::Bytes(bytes) = slot else {
        return Vec::new();
    };
    let seal = bytes[SEAL_OFFSET..][..SEAL_LEN].try_into().unwrap();
    let rig_len = Seal::decode(seal).unwrap().header.rig_len as usize;
    bytes[..RIG_OFFSET + rig_len].to_vec()
}

/// A signed slot with a model and the rig block, where there is one.
pub(crate) fn signed(model: &Model, rig: Option<&Rig>) -> Slot {
    let rig = rig.map(|rig| rig_block::encode(rig).expect("a sound rig block"));
    sealed(model, rig.as_ref().map_or(&[], |rig| rig))
}

/// A signed slot with these bytes for its rig block.
pub(crate) fn sealed(model: &Model, rig: &[u8]) -> Slot {
    sealed_as(1, model, rig)
}

/// The same with this number of its upload.
pub(crate) fn sealed_as(sequence: u32, model: &Model, rig: &[u8]) -> Slot {
    let content = [&blob::encode(model)[..], rig].concat();
    let header = header(&content, sequence);
    let seal = Seal {
        sequence,
        header,
        signature: Some(signature(&header).bytes()),
    };
    let mut bytes = vec![0xFF; SECTOR];
    bytes[..content.len()].copy_from_slice(&content);
    bytes[SEAL_OFFSET..][..SEAL_LEN].copy_from_slice(&seal.encode());
    bytes[SEALED_OFFSET..][..4].copy_from_slice(&MARKED);
    Slot::Bytes(bytes)
}

/// A rig with one of the reference models on it, with limits for the model of this checksum.
pub(crate) fn reference_rig(model: &Model, limits_for: Option<u32>) -> Rig {
    let rig = chain::reference_rig(SHORT_TAPS).expect("a sound rig");
    let side = Cusum {
        drift: 1 << 20,
        threshold: 1 << 24,
    };
    let sides = TwoSided {
        more: side,
        less: side,
    };
    let axis = || AxisLimits {
        reversed: false,
        force_shift: 12,
        // No force at rest is large beside it.
        force_power: 1 << 46,
        state_power: [1, 1],
        per_octave: [0; 3],
        error: side,
        stiffness: sides,
        friction: sides,
        gross: [0; 2],
        moving_counts: [20, 20, 20, 20, 20, 0],
    };
    let limits = limits_for.map(|model_checksum| Limits {
        model_checksum,
        block: 64,
        outside_permille: 1000,
        false_alarm_hours: 720,
        axes: [axis(), axis()].into_iter().collect(),
    });
    Rig {
        model_checksum: blob::checksum_of(model),
        limits,
        ..rig
    }
}

/// A line that keeps what is sent.
#[derive(Default)]
struct Kept(Vec<u8>);

impl SerialPort for Kept {
    const BAUD: Option<u32> = None;

    fn send(&mut self, frame: &[u8]) -> bool {
        self.0.extend_from_slice(frame);
        true
    }
}

/// A bus on which nobody answers.
struct Silent;

impl SpiError for Silent {
    type Error = Infallible;
}

impl SpiDevice for Silent {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::TransferInPlace(bytes) = operation {
                bytes.fill(0);
            }
        }
        Ok(())
    }
}

/// The firmware's tasks in one process, with the queues between them.
pub(crate) struct Bench {
    pub(crate) watch: &'static mut Watch,
    evaluator: Option<&'static mut Evaluator>,
    server: Server<Flash, Key, Kept>,
    sampler: Sampler<Silent, Silent, Silent, Silent>,
    frames_in: Producer<'static, Frame>,
    frames: Consumer<'static, Frame>,
    evaluated_in: Producer<'static, Evaluated>,
    evaluated: Consumer<'static, Evaluated>,
    stream_in: Producer<'static, Streamed>,
    stream: Consumer<'static, Streamed>,
    lost: Lost,
    number: u64,
    asked: u16,
    decoder: Decoder<Report>,
    sequence: u16,
}

impl Bench {
    pub(crate) fn start(slots: [Slot; 2]) -> Self {
        let mut bytes = vec![0xFF; 2 * SECTOR];
        for (sector, slot) in bytes.chunks_mut(SECTOR).zip(slots) {
            if let Slot::Bytes(slot) = slot {
                sector[..slot.len()].copy_from_slice(&slot);
            }
        }
        Self::power(Flash::new(bytes))
    }

    fn power(flash: Flash) -> Self {
        let trust = Trust {
            keys: [0, 1].map(|number| Some(Key::new(*keys(number).pk))),
            class: CLASS,
            unsigned: false,
        };
        let mut store = Store::new(flash, trust);
        let setup = Setup {
            clock: Clock::crystal(168_000_000),
            why: Restart::Pin,
            signed: true,
            development_key: true,
        };
        let room = Box::leak(Box::new(Room::EMPTY));
        let begun = begin(&mut store, setup, room, |_| ());
        let mut watch = begun.watch;
        let mut server = Server::new(store, begun.hello, Kept::default());
        server.introduce(Occasion::Restart, &mut watch);
        let counters = [Silent, Silent, Silent, Silent];
        let sensors = Sensors::new(&begun.wiring, Silent, counters, Silent, [Silent, Silent]);
        let (frames_in, frames) = Box::leak(Box::new(Queue::<_, 4>::new())).split();
        let (evaluated_in, evaluated) = Box::leak(Box::new(Queue::<_, 4>::new())).split();
        let (stream_in, stream) = Box::leak(Box::new(Queue::<_, 8>::new())).split();
        Self {
            watch,
            evaluator: begun.evaluator,
            server,
            sampler: Sampler::new(sensors, begun.wiring),
            frames_in,
            frames,
            evaluated_in,
            evaluated,
            stream_in,
            stream,
            lost: Lost::default(),
            number: 0,
            asked: 0,
            decoder: Decoder::default(),
            sequence: 0,
        }
    }

    /// The same flash after a restart.
    pub(crate) fn restart(self) -> Self {
        Self::power(self.server.into_store().into_flash())
    }

    /// Both slots, byte by byte.
    pub(crate) fn into_flash(self) -> Vec<u8> {
        self.server.into_store().into_flash().bytes
    }

    /// Does something to the flash while the device runs.
    pub(crate) fn flash(&mut self, what: impl FnOnce(&mut Flash)) {
        what(self.server.flash_mut());
    }

    /// Does something to the flash, and restarts.
    pub(crate) fn restart_after(self, what: impl FnOnce(&mut Flash)) -> Self {
        let mut flash = self.server.into_store().into_flash();
        what(&mut flash);
        Self::power(flash)
    }

    pub(crate) fn evaluates(&self) -> bool {
        self.evaluator.is_some()
    }

    /// One sample with these counts, through everything.
    pub(crate) fn sample(&mut self, raw: RawSample) {
        self.sample_after(0, raw);
    }

    pub(crate) fn sample_after(&mut self, missed: u32, sample: RawSample) {
        self.enqueue(Frame {
            missed,
            sample,
            health: [ChipState::Ok; CHIPS],
            ..Frame::default()
        });
    }

    pub(crate) fn sample_with(&mut self, health: [ChipState; CHIPS]) {
        self.enqueue(Frame {
            health,
            ..Frame::default()
        });
    }

    fn enqueue(&mut self, frame: Frame) {
        let number = self.number;
        self.number += 1;
        let frame = Frame { number, ..frame };
        self.frames_in.enqueue(frame).expect("room");
        self.work();
    }

    /// One sample of the silent chips, that nobody evaluates yet.
    pub(crate) fn acquire(&mut self) {
        self.sampler.sample(0, &mut self.frames_in);
    }

    /// Everything behind the sampling.
    pub(crate) fn work(&mut self) {
        let evaluator = self.evaluator.as_deref_mut();
        evaluate::<Portable>(
            evaluator,
            &mut self.frames,
            &mut self.evaluated_in,
            &mut self.lost,
        );
        while let Some(evaluated) = self.evaluated.dequeue() {
            if let Some(streamed) = self.watch.update(&evaluated) {
                self.stream_in.enqueue(streamed).expect("room");
            }
        }
        self.server.turn(&mut self.stream, &mut self.watch);
    }

    pub(crate) fn receive(&mut self, byte: u8) {
        self.server.receive(byte, &mut self.watch);
    }

    /// A line on which bytes come without a pause, and how many of them are taken.
    pub(crate) fn flood(&mut self) -> usize {
        let mut taken = 0;
        let next = || {
            taken += 1;
            (taken < 100_000).then_some(0)
        };
        self.server.hear(next, &mut self.watch);
        taken
    }

    pub(crate) fn ask(&mut self, request: &Request) {
        let mut place = [0; MAX_FRAME];
        let frame = encode(request, self.asked, &mut place).expect("it fits");
        self.asked += 1;
        for &byte in frame {
            self.receive(byte);
        }
        self.server.turn(&mut self.stream, &mut self.watch);
    }

    /// What was sent since the last time; every frame whole, and none missing.
    pub(crate) fn reports(&mut self) -> Vec<Report> {
        let bytes = std::mem::take(&mut self.server.line_mut().0);
        let mut reports = Vec::new();
        for byte in bytes {
            if let Some(received) = self.decoder.push(byte) {
                let received = received.expect("an undamaged frame");
                assert_eq!(received.sequence, self.sequence);
                self.sequence = self.sequence.wrapping_add(1);
                reports.push(received.message);
            }
        }
        reports
    }
}
