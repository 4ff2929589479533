//! The serial line between the emulated device and the host: noise both ways, and who sits at the
//! host's end.

use crate::device::signing::SignedModel;
use crate::device::upload::{Patience, READ_TIMEOUT, Uploaded, upload};
use crate::text::error::Result;
use jointwatch_shared::wire::telemetry::{
    Answered, Decoder, MAX_FRAME, Occasion, Report, Request, encode,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};

/// Requests for the stream that are not answered are repeated after so many looks.
const LOOKS_UNTIL_REPEATED: u32 = 32;

/// A line on which every bit is wrong with some probability, both ways alike.
pub struct SerialLine {
    bit_error_rate: f64,
    chance: ChaCha8Rng,
    to_device: VecDeque<u8>,
}

impl SerialLine {
    /// The same seed gives the same noise.
    pub fn new(bit_error_rate: f64, seed: u64) -> Self {
        Self {
            bit_error_rate,
            chance: ChaCha8Rng::seed_from_u64(seed),
            to_device: VecDeque::new(),
        }
    }

    /// What arrives of these bytes.
    pub fn arriving(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if self.bit_error_rate > 0.0 {
            for byte in &mut bytes {
                for bit in 0..8 {
                    *byte ^= u8::from(self.chance.random_bool(self.bit_error_rate)) << bit;
                }
            }
        }
        bytes
    }

    /// Sends bytes to the device.
    pub fn send(&mut self, bytes: &[u8]) {
        let bytes = self.arriving(bytes);
        self.to_device.extend(bytes);
    }

    /// The bytes that the device fetches.
    pub fn fetched(&mut self, room: usize) -> Vec<u8> {
        let count = room.min(self.to_device.len());
        self.to_device.drain(..count).collect()
    }
}

/// Asks the device to stream every sample, and asks again after a restart and when no answer comes.
#[derive(Default)]
pub struct Streamer {
    decoder: Decoder<Report>,
    granted: bool,
    looks: u32,
    sequence: u16,
}

impl Streamer {
    /// Hears what arrived from the device.
    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let Some(Ok(frame)) = self.decoder.push(byte) else {
                continue;
            };
            match frame.message {
                Report::Hello(hello) if hello.occasion == Occasion::Restart => {
                    (self.granted, self.looks) = (false, 0);
                }
                Report::Answer(answer) => self.granted |= answer.answered == Answered::Done,
                _ => {}
            }
        }
    }

    /// What to send now.
    pub fn request(&mut self) -> Vec<u8> {
        let now = !self.granted && self.looks == 0;
        self.looks = (self.looks + 1) % LOOKS_UNTIL_REPEATED;
        if !now {
            return Vec::new();
        }
        let mut place = [0; MAX_FRAME];
        let request = Request::Stream { every: 1 };
        let frame = encode(&request, self.sequence, &mut place);
        self.sequence = self.sequence.wrapping_add(1);
        // A request fits a frame; a test shows it.
        frame.map(<[u8]>::to_vec).unwrap_or_default()
    }
}

/// An upload at the host's end of the line, on a thread of its own: it waits for answers, and the
/// device for samples.
pub struct Uploading {
    to_device: Receiver<Vec<u8>>,
    from_device: Option<Sender<Vec<u8>>>,
    uploader: JoinHandle<Result<Uploaded>>,
}

/// Whoever talks to the device over the line, in place of [`upload`].
pub type Talk = Box<dyn FnOnce(&mut Wire) -> Result<Uploaded> + Send>;

impl Uploading {
    /// Starts the talk on a thread of its own.
    pub fn begin(talk: Talk) -> Self {
        let (out, to_device) = channel();
        let (from_device, heard) = channel();
        let mut wire = Wire {
            out,
            heard,
            rest: VecDeque::new(),
        };
        Self {
            to_device,
            from_device: Some(from_device),
            uploader: thread::spawn(move || talk(&mut wire)),
        }
    }

    /// An upload as `jointwatch upload` does it.
    pub fn of(model: SignedModel, patience: Patience) -> Talk {
        Box::new(move |wire| upload(wire, &model, patience, |_| ()))
    }

    /// Passes on what arrived from the device.
    pub fn hear(&mut self, bytes: &[u8]) {
        if let Some(to) = &self.from_device {
            // An upload that has ended hears nothing more.
            let _ = to.send(bytes.to_vec());
        }
    }

    /// What it sends now.
    pub fn requests(&mut self) -> Vec<u8> {
        self.to_device.try_iter().flatten().collect()
    }

    /// Whether it goes on.
    pub fn goes_on(&self) -> bool {
        !self.uploader.is_finished()
    }

    /// How it went; an upload that still goes on is cut off from the device first.
    ///
    /// # Errors
    /// The upload's.
    pub fn end(mut self) -> Result<Uploaded> {
        self.from_device = None;
        drop(self.to_device);
        self.uploader.join().unwrap_or_else(|_| {
            Err(crate::text::error::Error::failed(
                "the upload to the emulated device panicked",
            ))
        })
    }
}

/// The host's end of the line as a port that can be read and written.
pub struct Wire {
    out: Sender<Vec<u8>>,
    heard: Receiver<Vec<u8>>,
    rest: VecDeque<u8>,
}

impl Read for Wire {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            match self.heard.recv_timeout(READ_TIMEOUT) {
                Ok(bytes) => self.rest.extend(bytes),
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(gone()),
            }
        }
        self.rest.read(into)
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.send(bytes.to_vec()).map_err(|_| gone())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn gone() -> io::Error {
    io::Error::new(
        io::ErrorKind::NotConnected,
        "the emulated device is switched off",
    )
}
