//! The link's host side: requests of the device come in over one pipe, answers go out over the
//! other.
//!
//! `docs/notebook/emulation.md`, "The link", has the protocol byte by byte.

use super::board::BoardChip;
use crate::text::error::{Error, Result};
use std::io::{ErrorKind, Read, Write};

// Kinds of requests: transfers with counters from 0, with the other chips, with all counters at
// once; then those beyond chips.
const CONVERTER: u8 = 4;
const ACCELEROMETER: u8 = 5;
const LAST_CHIP: u8 = 6;
const LATCH: u8 = 7;
const WAIT: u8 = 0x10;
const SENT: u8 = 0x11;
const RECEIVE: u8 = 0x12;
const STAGES: u8 = 0x13;
const MEMORY: u8 = 0x14;
const STARTED: u8 = 0x15;

/// Answers to [`WAIT`]: no more samples, a sample, a restart.
const ENDED: u8 = 0;
const SAMPLE: u8 = 1;
const RESTART: u8 = 0xFF;

/// What the host wants of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Take the next sample.
    Sample,
    /// Take a sample so many instants late.
    Late(u8),
    /// Restart now, as after a reset.
    Restart,
    /// Come to the end.
    End,
}

/// What memory the device says that it used, bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Memory {
    /// Reserved for the stack.
    pub stack_reserved: u32,
    /// The most of it that was in use.
    pub stack_peak: u32,
    /// Variables besides the stack.
    pub variables: u32,
}

/// What lies behind the link.
pub trait Host {
    /// A transfer with one chip.
    fn select(&mut self, place: BoardChip, bytes: &mut [u8]);
    /// A transfer with all counters at once.
    fn select_counters(&mut self, bytes: &[u8]);
    /// The device waits for the next sample instant.
    fn next(&mut self) -> Next;
    /// The device has sent these bytes over its serial line.
    fn sent(&mut self, bytes: &[u8]);
    /// The bytes that have reached the device over its serial line, at most `room`.
    fn received(&mut self, room: usize) -> Vec<u8>;
    /// Instructions from the clock's start to the first instant.
    fn started(&mut self, count: u32);
    /// Instructions of each stage of the sample that was just taken.
    fn stages(&mut self, counts: &[u32]);
    /// What memory was used.
    fn memory(&mut self, memory: Memory);
}

/// Serves the device until it is gone; true when it was told before that there is no more to come.
///
/// # Errors
/// When a pipe breaks in the middle of a request, and when a request is not one of the protocol.
pub fn serve(
    requests: &mut impl Read,
    answers: &mut impl Write,
    host: &mut impl Host,
) -> Result<bool> {
    let mut ended = false;
    let mut bytes = Vec::new();
    while let Some(kind) = request(requests, &mut bytes)? {
        ended |= answer(kind, &mut bytes, host)?;
        // A device that is gone reads no answer; the next request then does not come either.
        match answers.write_all(&bytes) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => return Err(broken(e)),
            _ => {}
        }
    }
    Ok(ended)
}

/// The kind of the next request, its bytes in `bytes`; `None` when the device is gone.
fn request(requests: &mut impl Read, bytes: &mut Vec<u8>) -> Result<Option<u8>> {
    let mut head = [0; 3];
    if !whole(requests, &mut head)? {
        return Ok(None);
    }
    let [kind, low, high] = head;
    bytes.resize(usize::from(u16::from_le_bytes([low, high])), 0);
    if !whole(requests, bytes)? && !bytes.is_empty() {
        return Err(broken_off());
    }
    Ok(Some(kind))
}

/// Does what a request asks for, and puts the answer in place of its bytes; true when that says
/// that there is no more to come.
fn answer(kind: u8, bytes: &mut Vec<u8>, host: &mut impl Host) -> Result<bool> {
    match kind {
        0..=LAST_CHIP => {
            host.select(place(kind), bytes);
            return Ok(false);
        }
        LATCH => host.select_counters(bytes),
        WAIT if bytes.is_empty() => {
            let next = host.next();
            bytes.push(match next {
                Next::End => ENDED,
                Next::Sample => SAMPLE,
                Next::Late(instants) => SAMPLE.saturating_add(instants).min(RESTART - 1),
                Next::Restart => RESTART,
            });
            return Ok(next == Next::End);
        }
        SENT => host.sent(bytes),
        RECEIVE if bytes.len() == 2 => {
            let most = u16::from_le_bytes([bytes[0], bytes[1]]);
            let received = host.received(usize::from(most));
            bytes.clear();
            bytes.extend((received.len() as u16).to_le_bytes());
            bytes.extend(received);
            return Ok(false);
        }
        STAGES => host.stages(&words(bytes)),
        STARTED if bytes.len() == 4 => host.started(words(bytes)[0]),
        MEMORY if bytes.len() == 12 => {
            let words = words(bytes);
            host.memory(Memory {
                stack_reserved: words[0],
                stack_peak: words[1],
                variables: words[2],
            });
        }
        _ => {
            return Err(Error::failed(format!(
                "the emulated device made a request {kind:#04x} of {} bytes, which this program does not know: build both \
                 from the same source",
                bytes.len()
            )));
        }
    }
    bytes.clear();
    Ok(false)
}

/// The chip that a transfer of this kind is with.
fn place(kind: u8) -> BoardChip {
    match kind {
        CONVERTER => BoardChip::Converter,
        ACCELEROMETER.. => BoardChip::Accelerometer(usize::from(kind - ACCELEROMETER)),
        counter => BoardChip::Counter(usize::from(counter)),
    }
}

fn broken_off() -> Error {
    Error::failed("the emulated device broke off in the middle of a request")
}

fn words(bytes: &[u8]) -> Vec<u32> {
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// Fills `place`; false when the device was gone before its first byte.
fn whole(requests: &mut impl Read, place: &mut [u8]) -> Result<bool> {
    let mut filled = 0;
    while filled < place.len() {
        match requests.read(&mut place[filled..]) {
            Ok(0) if filled == 0 => return Ok(false),
            Ok(0) => return Err(broken_off()),
            Ok(count) => filled += count,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(broken(e)),
        }
    }
    Ok(true)
}

fn broken(why: std::io::Error) -> Error {
    Error::failed(format!("the link to the emulated device broke ({why})"))
}
