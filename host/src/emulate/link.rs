//! The link's host side: requests of the device come in over one pipe, answers go out over the other.
//!
//! `docs/notebook/emulation.md`, "The link", has the protocol byte by byte.

use super::ahead::{Ahead, LATCH, transfer};
use super::board::Place;
use crate::text::error::{Error, Result};
use std::io::{ErrorKind, Read, Write};

// Kinds of requests beyond the transfers with chips, whose are up to [`LATCH`].
const TAKE_BACK: u8 = 8;
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
    /// Restart.
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
    fn select(&mut self, place: Place, bytes: &mut [u8]);
    /// A transfer with all counters at once.
    fn select_counters(&mut self, bytes: &[u8]);
    /// Keeps the chips as they are now.
    fn keep(&mut self);
    /// Puts the chips back to how they were kept: what was transferred since was not asked for.
    fn take_back(&mut self);
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
    let mut room = Vec::new();
    let mut ahead = Ahead::default();
    loop {
        let mut head = [0; 3];
        if !whole(requests, &mut head)? {
            return Ok(ended);
        }
        let [kind, low, high] = head;
        room.resize(usize::from(u16::from_le_bytes([low, high])), 0);
        if !whole(requests, &mut room)? && !room.is_empty() {
            return Err(Error::failed(
                "the emulated device broke off in the middle of a request",
            ));
        }
        let answer: &[u8] = match kind {
            0..=LATCH => {
                ahead.remember(kind, &room);
                transfer(host, kind, &mut room);
                if kind == LATCH { &[] } else { &room }
            }
            TAKE_BACK if room.len() == 1 => {
                ahead.take_back(host, usize::from(room[0]));
                &[]
            }
            WAIT if room.len() == 1 => {
                ahead.take_back(host, usize::from(room[0]));
                let next = host.next();
                ended |= next == Next::End;
                room.clear();
                room.push(match next {
                    Next::End => ENDED,
                    Next::Sample => SAMPLE,
                    Next::Late(instants) => SAMPLE.saturating_add(instants).min(RESTART - 1),
                    Next::Restart => RESTART,
                });
                if matches!(next, Next::Sample | Next::Late(_)) {
                    ahead.make(host, &mut room);
                }
                &room
            }
            SENT => {
                host.sent(&room);
                &[]
            }
            RECEIVE if room.len() == 2 => {
                let most = u16::from_le_bytes([room[0], room[1]]);
                let bytes = host.received(usize::from(most));
                room.clear();
                room.extend((bytes.len() as u16).to_le_bytes());
                room.extend(bytes);
                &room
            }
            STAGES => {
                host.stages(&words(&room));
                &[]
            }
            STARTED if room.len() == 4 => {
                ahead = Ahead::default();
                host.started(words(&room)[0]);
                &[]
            }
            MEMORY if room.len() == 12 => {
                let words = words(&room);
                host.memory(Memory {
                    stack_reserved: words[0],
                    stack_peak: words[1],
                    variables: words[2],
                });
                &[]
            }
            _ => {
                return Err(Error::failed(format!(
                    "the emulated device made a request {kind:#04x} of {} bytes, which this program does not know: build both \
                     from the same source",
                    room.len()
                )));
            }
        };
        // A device that is gone reads no answer; the next request then does not come either.
        match answers.write_all(answer) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => return Err(broken(e)),
            _ => {}
        }
    }
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
            Ok(0) => {
                return Err(Error::failed(
                    "the emulated device broke off in the middle of a request",
                ));
            }
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
