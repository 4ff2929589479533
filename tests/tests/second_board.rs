//! The monitor on a board of another family, under QEMU: sampling by its timer, telemetry and an upload over its serial line. It has no
//! sensor chips, and says so.

use jointwatch::device::signing::{PrivateKey, SignedModel};
use jointwatch::device::upload::{Patience, upload};
use jointwatch::emulate::selftest::{self, Board};
use jointwatch_shared::selftest::chain::usual_rig;
use jointwatch_shared::selftest::reference_model;
use jointwatch_shared::wire::telemetry::{
    Answered, Decoder, Event, Hello, Occasion, Report, Request, Slot, encode,
};
use jointwatch_shared::wire::{blob, rig_block};
use jointwatch_tests::elf::Image;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Result, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

/// A read of the line that brings nothing ends after so long.
const SILENCE: Duration = Duration::from_millis(100);
/// What is waited for comes within so long, on a busy computer too.
const LONGEST: Duration = Duration::from_secs(120);

/// The emulated board behind its serial line.
struct Device {
    process: Child,
    to: ChildStdin,
    from: Receiver<Vec<u8>>,
    /// Bytes that have come and were not taken yet.
    waiting: VecDeque<u8>,
    decoder: Decoder<Report>,
}

impl Device {
    fn start() -> Self {
        let image = selftest::build(Board::An500, "jointwatch-an500");
        let image = image.unwrap_or_else(|why| panic!("{why}"));
        let qemu = selftest::require_qemu().unwrap_or_else(|why| panic!("{why}"));
        let mut process = Command::new(qemu)
            .args(["-M", Board::An500.machine(), "-display", "none"])
            .args(["-monitor", "none", "-serial", "stdio", "-kernel"])
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("QEMU starts");
        let to = process.stdin.take().expect("it is a pipe");
        let mut line = process.stdout.take().expect("it is a pipe");
        let (sender, from) = channel();
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = line.read(&mut bytes) {
                if sender.send(bytes[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self {
            process,
            to,
            from,
            waiting: VecDeque::new(),
            decoder: Decoder::default(),
        }
    }

    /// Sends one request.
    fn ask(&mut self, request: &Request) {
        let mut room = [0; 300];
        let frame = encode(request, 1, &mut room).expect("it fits");
        self.to.write_all(frame).expect("the line takes it");
        self.to.flush().expect("the line takes it");
    }

    /// Waits for bytes, not for long.
    fn fetch(&mut self) {
        if self.waiting.is_empty()
            && let Ok(bytes) = self.from.recv_timeout(SILENCE)
        {
            self.waiting.extend(bytes);
        }
    }

    /// The first of the next reports that `wanted` takes; those before it are dropped.
    fn wait<T>(&mut self, what: &str, wanted: impl Fn(&Report) -> Option<T>) -> T {
        let begun = Instant::now();
        while begun.elapsed() < LONGEST {
            self.fetch();
            while let Some(byte) = self.waiting.pop_front() {
                if let Some(Ok(frame)) = self.decoder.push(byte)
                    && let Some(found) = wanted(&frame.message)
                {
                    return found;
                }
            }
        }
        panic!("{what} did not come");
    }

    fn hello(&mut self, what: &str, model: bool) -> Hello {
        self.wait(what, |report| match report {
            Report::Hello(hello) if hello.model.is_some() == model => Some(hello.clone()),
            _ => None,
        })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // It can only fail when it has ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Write for Device {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.to.flush()
    }
}

impl Read for Device {
    fn read(&mut self, place: &mut [u8]) -> Result<usize> {
        self.fetch();
        if self.waiting.is_empty() {
            return Err(ErrorKind::TimedOut.into());
        }
        self.waiting.read(place)
    }
}

#[test]
fn it_samples_tells_answers_and_takes_a_model() {
    let mut device = Device::start();
    device.ask(&Request::Hello);
    let hello = device.hello("who it is", false);
    assert!(hello.rig.is_none());
    device.wait("a missing sensor", |report| {
        matches!(report, Report::Event(Event::SensorMissing { .. })).then_some(())
    });
    // The timer makes the samples: a status report after every 100 of 1000 per second.
    let status = |report: &Report| match report {
        Report::Status(status) => Some(status.sample),
        _ => None,
    };
    let [first, second] = [0; 2].map(|_| device.wait("a status", status));
    assert_eq!((second - first) % 100, 0, "{first} {second}");
    assert!(second > first);

    device.ask(&Request::Ping);
    let answered = |report: &Report| match report {
        Report::Answer(answer) => Some(answer.answered),
        _ => None,
    };
    assert_eq!(device.wait("an answer", answered), Answered::Done);

    let model = blob::encode(reference_model());
    let mut rig = usual_rig(reference_model(), false).expect("a sound rig");
    rig.model_checksum = blob::checksum(&model);
    if let Some(limits) = &mut rig.limits {
        limits.model_checksum = rig.model_checksum;
    }
    let rig = rig_block::encode(&rig).expect("a sound rig");
    let signed = SignedModel::sign(&model, &rig, &PrivateKey::development());
    let patience = Patience {
        silent_reads: 50,
        silent_reads_at_work: 300,
        longest: LONGEST,
        tries: 5,
        beginnings: 2,
    };
    let uploaded = upload(
        &mut device,
        &signed.expect("a sound model"),
        patience,
        |_| (),
    );
    let uploaded = uploaded.unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(uploaded.bytes, 2 * 4096);
    // It restarts by itself, and runs the model at the rig's rate.
    let hello = device.hello("the model", true);
    assert_eq!(hello.occasion, Occasion::Restart);
    let running = hello.model.expect("it was waited for");
    assert_eq!(running.crc, blob::checksum(&model));
    assert!(running.signed && running.slot == Slot::A);
    assert_eq!(hello.rig.map(|rig| rig.sample_rate_hz), Some(32.0));
    let axes = device.wait("a status with a monitor", |report| match report {
        Report::Status(status) if status.sample > 0 => Some(status.axes.len()),
        _ => None,
    });
    assert_eq!(axes, 2);
}

#[test]
fn its_slots_lie_where_the_host_puts_a_blob() {
    for name in ["jointwatch-an500", "selftest-an500"] {
        let image = selftest::build(Board::An500, name).unwrap_or_else(|why| panic!("{why}"));
        let image = Image::read(&image);
        let slot_a = Board::An500.slot_a().expect("it has slots");
        assert_eq!(image.symbols["_slot_a"], u64::from(slot_a), "{name}");
        assert_eq!(
            image.symbols["_slot_b"] - image.symbols["_slot_a"],
            128 * 1024,
            "{name}"
        );
    }
}
