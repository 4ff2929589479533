//! The raw counts around an alarm: always recorded, packed without loss, kept when an alarm comes,
//! and sent piece by piece on request.
//!
//! Motion sampled fast is smooth, so a count lies near the straight line through the two before it.
//! What is left is written in Rice's code (R. F. Rice, "Some practical universal noiseless coding
//! techniques", JPL Publication 79-22), whose one parameter follows the mean of what was left
//! lately. Two axes so take 11 to 16 bytes a sample, by their noise, where their counts take 48.
//!
//! The record is a ring of chunks, each of which can be read without the others.

use crate::chain::{RawAxis, RawSample};
use crate::monitor::limits::CHANNELS;
use crate::wire::telemetry::{CAPTURE_PIECE, CapturePiece};
use heapless::Vec;

/// Bytes of a chunk, a whole number of pieces.
pub const CHUNK: usize = 10 * CAPTURE_PIECE;
/// The part of a record that can be read by itself; `docs/reference/telemetry.md` has its bytes.
pub type Chunk = [u8; CHUNK];

/// Counts of an axis: displacement far and near, body, acceleration, force, input.
type Counts = [i32; CHANNELS];

/// Bytes before the axes' states.
const HEAD: usize = 12;
/// Bytes that one sample of one axis takes at most: an escape of 44 bits per channel, and bits that
/// were no byte yet.
const MOST: usize = (44 * CHANNELS).div_ceil(8) + 1;
/// This many ones in place of a quotient say that all 32 bits follow.
const ESCAPE: u32 = 12;
/// Bits that are written at once: with up to 7 that are no byte yet, a word of 32 has room for
/// them.
const PUT: u32 = 24;
/// The largest parameter of the code.
const LARGEST: u32 = 20;
/// The mean is kept this many binary places finer, and follows with the same time constant in
/// values.
const MEAN_LOG2: u32 = 4;

/// What is known of one channel when its next count comes.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    value: i32,
    slope: i32,
    mean: u32,
}

impl Channel {
    /// The parameter of the code for the next count.
    fn parameter(&self) -> u32 {
        let mean = self.mean >> MEAN_LOG2;
        (31 - (mean | 1).leading_zeros()).min(LARGEST)
    }

    /// By how much the next count misses the straight line, signs folded: 0, −1, 1, −2, …
    fn missed(&self, value: i32) -> u32 {
        let missed = value.wrapping_sub(self.value).wrapping_sub(self.slope);
        ((missed << 1) ^ (missed >> 31)) as u32
    }

    /// Takes the next count, which missed by so much.
    fn take(&mut self, value: i32, missed: u32) {
        self.slope = value.wrapping_sub(self.value);
        self.value = value;
        let missed = missed.min(1 << (LARGEST + MEAN_LOG2));
        self.mean = self.mean - (self.mean >> MEAN_LOG2) + missed;
    }
}

/// What becomes of new samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// They go round and round.
    Recording,
    /// An alarm was raised at this sample; so many chunks are still to be filled.
    Ending { alarm: u64, left: u16 },
    /// What was recorded around this sample is kept.
    Kept { alarm: u64 },
}

/// Why there is no piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPiece {
    /// No alarm was raised, or the record has fewer pieces.
    Nothing,
    /// What follows the alarm is still being recorded.
    Unfinished,
}

/// Records counts into memory that the board sets apart for it; without any it does nothing.
#[derive(Debug)]
pub struct Capture {
    chunks: &'static mut [Chunk],
    /// The chunk that is written, or was written last, and how many before it are whole, itself
    /// included once it is.
    at: usize,
    whole: usize,
    /// Samples in the open chunk; 0 when none is open.
    samples: u16,
    /// The next byte in it, and the bits that are no byte yet.
    place: usize,
    bits: u32,
    held: u32,
    next: u64,
    axes: u8,
    channels: [[Channel; CHANNELS]; 2],
    phase: Phase,
}

impl Capture {
    /// Records into these chunks.
    pub fn new(chunks: &'static mut [Chunk]) -> Self {
        Self {
            chunks,
            at: 0,
            whole: 0,
            samples: 0,
            place: 0,
            bits: 0,
            held: 0,
            next: 0,
            axes: 0,
            channels: [[Channel::default(); CHANNELS]; 2],
            phase: Phase::Recording,
        }
    }

    /// Takes the sample with this number of a rig with so many axes; `follows_gap` when instants
    /// before it went by without one.
    pub fn sample(&mut self, number: u64, raw: &RawSample, axes: u8, follows_gap: bool) {
        if self.chunks.is_empty() || matches!(self.phase, Phase::Kept { .. }) {
            return;
        }
        let axes = axes.clamp(1, 2);
        let full = self.place + MOST * usize::from(axes) > CHUNK;
        let follows = !follows_gap && number == self.next && axes == self.axes;
        if self.samples > 0 && (full || !follows) {
            self.close();
            if matches!(self.phase, Phase::Kept { .. }) {
                return;
            }
        }
        self.next = number.wrapping_add(1);
        if self.samples == 0 {
            self.open(number, raw, axes, follows);
        } else {
            self.append(raw);
        }
        self.samples = self.samples.saturating_add(1);
    }

    /// An alarm was raised at this sample: what is around the first one is kept until it is
    /// released.
    pub fn alarm(&mut self, sample: u64) {
        if self.phase == Phase::Recording && !self.chunks.is_empty() {
            let all = self.chunks.len();
            // Three quarters of it show the joint as it is now.
            let left = ((all >> 1) + (all >> 2)).max(1) as u16;
            self.phase = Phase::Ending {
                alarm: sample,
                left,
            };
        }
    }

    /// Forgets what is kept, and records anew.
    pub fn release(&mut self) {
        self.phase = Phase::Recording;
        (self.whole, self.samples) = (0, 0);
    }

    /// One piece of what is kept, counted from 0.
    ///
    /// # Errors
    /// [`NoPiece`]: why there is none.
    pub fn piece(&self, piece: u16) -> Result<CapturePiece, NoPiece> {
        let alarm = match self.phase {
            Phase::Recording => return Err(NoPiece::Nothing),
            Phase::Ending { .. } => return Err(NoPiece::Unfinished),
            Phase::Kept { alarm } => alarm,
        };
        const PER_CHUNK: usize = CHUNK / CAPTURE_PIECE;
        let (chunk, part) = (
            usize::from(piece) / PER_CHUNK,
            usize::from(piece) % PER_CHUNK,
        );
        if chunk >= self.whole {
            return Err(NoPiece::Nothing);
        }
        // From the oldest on.
        let all = self.chunks.len();
        let place = self.at + 1 + all - self.whole + chunk;
        let place = if place >= all { place - all } else { place };
        let chunk = self.chunks.get(place).ok_or(NoPiece::Nothing)?;
        let bytes = chunk.chunks(CAPTURE_PIECE).nth(part);
        let bytes = bytes.ok_or(NoPiece::Nothing)?;
        Ok(CapturePiece {
            alarm,
            piece,
            pieces: (self.whole * PER_CHUNK) as u16,
            bytes: Vec::from_slice(bytes).unwrap_or_default(),
        })
    }

    /// Begins a chunk with this sample.
    fn open(&mut self, number: u64, raw: &RawSample, axes: u8, follows: bool) {
        let all = self.chunks.len();
        self.at = if self.at + 1 < all { self.at + 1 } else { 0 };
        self.whole = self.whole.min(all - 1);
        (self.place, self.bits, self.held, self.axes) = (0, 0, 0, axes);
        self.write(&number.to_le_bytes());
        // The count is not known yet.
        self.write(&[0, 0, axes, u8::from(!follows)]);
        for (axis, raw) in raw.iter().enumerate().take(usize::from(axes)) {
            for (channel, value) in counts(raw).into_iter().enumerate() {
                let known = self.channels.get_mut(axis).and_then(|c| c.get_mut(channel));
                let Some(known) = known else {
                    continue;
                };
                known.slope = match follows {
                    true => value.wrapping_sub(known.value),
                    false => 0,
                };
                known.value = value;
                let parameter = known.parameter();
                known.mean = 1 << (parameter + MEAN_LOG2);
                let slope = known.slope;
                self.write(&value.to_le_bytes());
                self.write(&slope.to_le_bytes());
                self.write(&[parameter as u8]);
            }
        }
    }

    /// Ends the open chunk.
    fn close(&mut self) {
        if self.held > 0 {
            let last = (self.bits << (8 - self.held)) as u8;
            self.byte(self.place, last);
        }
        let [low, high] = self.samples.to_le_bytes();
        self.byte(8, low);
        self.byte(9, high);
        self.samples = 0;
        self.whole += 1;
        if let Phase::Ending { alarm, left } = self.phase {
            self.phase = match left {
                0 | 1 => Phase::Kept { alarm },
                more => Phase::Ending {
                    alarm,
                    left: more - 1,
                },
            };
        }
    }

    fn append(&mut self, raw: &RawSample) {
        let Some(chunk) = self.chunks.get_mut(self.at) else {
            return;
        };
        // The numbers that every bit changes stay in registers.
        let mut pen = Pen {
            chunk,
            place: self.place,
            bits: self.bits,
            held: self.held,
        };
        let axes = self.channels.iter_mut().zip(raw);
        for (channels, raw) in axes.take(usize::from(self.axes)) {
            for (known, value) in channels.iter_mut().zip(counts(raw)) {
                let (parameter, missed) = (known.parameter(), known.missed(value));
                known.take(value, missed);
                let quotient = missed >> parameter;
                let rest = missed & ((1 << parameter) - 1);
                if quotient >= ESCAPE {
                    pen.put((1 << ESCAPE) - 1, ESCAPE);
                    pen.put(missed >> 16, 16);
                    pen.put(missed & 0xffff, 16);
                    continue;
                }
                let ones = (1 << (quotient + 1)) - 2;
                if quotient + parameter < PUT {
                    pen.put(ones << parameter | rest, quotient + 1 + parameter);
                } else {
                    pen.put(ones, quotient + 1);
                    pen.put(rest, parameter);
                }
            }
        }
        (self.place, self.bits, self.held) = (pen.place, pen.bits, pen.held);
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.byte(self.place, byte);
            self.place += 1;
        }
    }

    fn byte(&mut self, at: usize, byte: u8) {
        let chunk = self.chunks.get_mut(self.at);
        if let Some(place) = chunk.and_then(|chunk| chunk.get_mut(at)) {
            *place = byte;
        }
    }
}

/// Writes bits into a chunk.
struct Pen<'a> {
    chunk: &'a mut Chunk,
    /// The next byte, and the bits that are no byte yet.
    place: usize,
    bits: u32,
    held: u32,
}

impl Pen<'_> {
    /// Writes up to [`PUT`] bits, the highest first.
    fn put(&mut self, value: u32, bits: u32) {
        self.bits = (self.bits << bits) | value;
        self.held += bits;
        while self.held >= 8 {
            self.held -= 8;
            if let Some(byte) = self.chunk.get_mut(self.place) {
                *byte = (self.bits >> self.held) as u8;
            }
            self.place += 1;
        }
    }
}

/// What is packed: the body's count as its difference to the near displacement's, which is the same
/// counter on many rigs.
fn counts(raw: &RawAxis) -> Counts {
    let [far, near] = raw.displacement;
    let body = raw.body.wrapping_sub(near);
    [far, near, body, raw.acceleration, raw.force, raw.input]
}

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contents {
    /// The number of its first sample.
    pub first: u64,
    /// Samples in it, at least one.
    pub samples: u16,
    /// Axes of the rig.
    pub axes: u8,
    /// It does not begin right behind the chunk before it.
    pub follows_gap: bool,
}

/// Bits, the highest of each byte first.
struct Bits<'a> {
    bytes: core::slice::Iter<'a, u8>,
    bits: u32,
    held: u32,
}

impl Bits<'_> {
    fn take(&mut self, count: u32) -> Option<u32> {
        while self.held < count {
            self.bits = self.bits << 8 | u32::from(*self.bytes.next()?);
            self.held += 8;
        }
        self.held -= count;
        Some(self.bits >> self.held & ((1 << count) - 1))
    }

    fn missed(&mut self, parameter: u32) -> Option<u32> {
        let mut quotient = 0;
        while quotient < ESCAPE && self.take(1)? == 1 {
            quotient += 1;
        }
        if quotient == ESCAPE {
            return Some(self.take(16)? << 16 | self.take(16)?);
        }
        Some(quotient << parameter | self.take(parameter)?)
    }
}

/// Unpacks a chunk: shows every sample, for each axis displacement far and near, body,
/// acceleration, force and input. `None` when these are not the bytes of a chunk; the samples that
/// were shown then are not to be used.
pub fn unpack(chunk: &[u8], mut show: impl FnMut(&[Counts; 2])) -> Option<Contents> {
    let (head, rest) = chunk.split_first_chunk::<HEAD>()?;
    let (number, &[low, high, axes, gap]) =
        head.split_first_chunk::<8>().and_then(|(n, rest)| {
            let rest: &[u8; 4] = rest.try_into().ok()?;
            Some((n, rest))
        })?;
    let contents = Contents {
        first: u64::from_le_bytes(*number),
        samples: u16::from_le_bytes([low, high]),
        axes,
        follows_gap: gap != 0,
    };
    if !(1..=2).contains(&axes) || contents.samples == 0 || gap > 1 {
        return None;
    }
    let mut channels = [[Channel::default(); CHANNELS]; 2];
    let mut values = [[0; CHANNELS]; 2];
    let known = channels.iter_mut().take(usize::from(axes)).flatten();
    let mut rest = rest;
    for channel in known {
        let (value, after) = rest.split_first_chunk::<4>()?;
        let (slope, after) = after.split_first_chunk::<4>()?;
        let (parameter, after) = after.split_first()?;
        if u32::from(*parameter) > LARGEST {
            return None;
        }
        *channel = Channel {
            value: i32::from_le_bytes(*value),
            slope: i32::from_le_bytes(*slope),
            mean: 1 << (u32::from(*parameter) + MEAN_LOG2),
        };
        rest = after;
    }
    let mut bits = Bits {
        bytes: rest.iter(),
        bits: 0,
        held: 0,
    };
    for sample in 0..contents.samples {
        for (channels, values) in channels.iter_mut().zip(&mut values).take(axes.into()) {
            for (channel, value) in channels.iter_mut().zip(values.iter_mut()) {
                if sample > 0 {
                    let missed = bits.missed(channel.parameter())?;
                    let unfolded = (missed >> 1) as i32 ^ -((missed & 1) as i32);
                    let line = channel.value.wrapping_add(channel.slope);
                    channel.take(line.wrapping_add(unfolded), missed);
                }
                *value = channel.value;
            }
            let [_, near, body, ..] = values;
            *body = body.wrapping_add(*near);
        }
        show(&values);
    }
    Some(contents)
}
