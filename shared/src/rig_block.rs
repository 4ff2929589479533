//! The rig as bytes: 4096 of them, the same layout in a file, on the wire and in flash beside the model.
//!
//! It holds what the device has to know besides the model: how the chips are wired and set, the filters' taps, the monitor's
//! limits, and the chain's numbers, in which what a count is worth, inertia and delays are integers already ([`on_board`]).
//! What a count is worth in SI follows for people and the host ([`decode`]); the device does not look at it. `docs/reference/rig-block.md`
//! lists every byte. Reading refuses whatever is not as the page says, and every quantity that the chain or a chip could not take.

mod limits;
mod lines;
mod message;
mod si;

use crate::blob::{self, BLOB_LEN, CRC};
use crate::error::{Checks, Error};
use crate::layout::{Field, Reader, Writer};
use crate::model::Model;
use crate::monitor::limits::Limits;
use crate::pipeline::Chain;
use crate::rig::{MAX_BAND_TAPS, MAX_TAPS, Rig};
use crate::wiring::Wiring;
use core::fmt;
use limits::LimitsMessage;
use lines::{HumsMessage, LinesMessage};
use message::Message;
use si::SiMessage;

/// Bytes of a rig block.
pub const RIG_BLOCK_LEN: usize = 4096;
/// The format version that this program writes and reads.
pub const RIG_BLOCK_VERSION: u16 = 3;
/// The first four bytes.
pub const RIG_BLOCK_MAGIC: [u8; 4] = *b"JWRB";
/// Where a flash slot holds it: right behind the model blob, so that both are written and given up together.
pub const RIG_BLOCK_OFFSET: usize = BLOB_LEN;
/// Where the checksum stands.
pub const CHECKSUM_OFFSET: usize = RIG_BLOCK_LEN - 4;

/// Where the taps of the three filters begin: first derivative, second derivative, low-pass.
const TAPS_OFFSET: usize = Message::LEN;
/// Where the monitor's limits begin.
const LIMITS_OFFSET: usize = TAPS_OFFSET + 4 * (2 * MAX_TAPS + MAX_BAND_TAPS);
/// Where the SI values begin.
const SI_OFFSET: usize = LIMITS_OFFSET + LimitsMessage::LEN;
/// Where the lines of the force channels begin, and the same in SI; the rest of the block up to the checksum is zero.
const LINES_OFFSET: usize = SI_OFFSET + SiMessage::LEN;
const HUMS_OFFSET: usize = LINES_OFFSET + LinesMessage::LEN;
const PADDING_OFFSET: usize = HUMS_OFFSET + HumsMessage::LEN;

/// A rig with one model on it, in SI and in the device's numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct RigBlock {
    /// What a count is worth, inertia, filters, delays.
    pub rig: Rig,
    /// Which chip gives which count, and how the chips are set.
    pub wiring: Wiring,
    /// What is normal; `None` until validation records were evaluated, and the monitor then only watches the sensors.
    pub limits: Option<Limits>,
    /// What the device computes with: the rig's and the model's values as integers.
    pub chain: Chain,
    /// The checksum of the model blob that the chain is for.
    pub model_checksum: u32,
}

/// What of a rig block runs on the device, beside its chain.
#[derive(Clone, Debug, PartialEq)]
pub struct OnBoard {
    /// Samples per second, in Hz, to be told.
    pub sample_rate_hz: f64,
    /// The same in 10⁻⁶ Hz, to be computed with.
    pub sample_rate_uhz: u64,
    /// Which chip gives which count, and how the chips are set.
    pub wiring: Wiring,
    /// The checksum of the model blob that the chain is for.
    pub model_checksum: u32,
    /// What is normal.
    pub limits: Option<Limits>,
}

/// Why bytes are no rig block. `Display` writes one sentence without a full stop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// Another length than [`RIG_BLOCK_LEN`].
    Length {
        /// Bytes seen.
        seen: usize,
    },
    /// The first bytes are not those of a rig block: erased flash, or another file.
    Magic {
        /// The four bytes seen.
        seen: [u8; 4],
    },
    /// Another format version.
    Version {
        /// The version seen.
        seen: u16,
    },
    /// The block is damaged.
    Checksum {
        /// The checksum that stands in the block.
        seen: u32,
        /// The checksum of its bytes.
        wanted: u32,
    },
    /// A byte has a value that its field does not know.
    Field {
        /// The field, in words.
        field: &'static str,
        /// The value seen.
        seen: u8,
    },
    /// A byte that has to be zero is not.
    Reserved {
        /// Where it stands, from the block's start.
        offset: usize,
        /// The value seen.
        seen: u8,
    },
    /// A quantity is not usable.
    Value(Error),
}

impl Refusal {
    /// The reason in a fixed phrase, for a device that formats no numbers.
    pub fn phrase(&self) -> &'static str {
        match self {
            Self::Length { .. } => "it has another length than a rig block",
            Self::Magic { .. } => "it does not begin like a rig block",
            Self::Version { .. } => "its format has another version",
            Self::Checksum { .. } => "its checksum does not match",
            Self::Field { field, .. } => field,
            Self::Reserved { .. } => "a byte that has to be zero is not",
            Self::Value(Error::OutOfRange { quantity, .. }) => quantity,
            Self::Value(_) => "a quantity is not usable",
        }
    }
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::Value(error)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { seen } => {
                write!(
                    f,
                    "it has {seen} bytes, but a rig block has {RIG_BLOCK_LEN}"
                )
            }
            Self::Magic { seen } => write!(
                f,
                "it begins with the bytes {seen:02x?}, which is not a Jointwatch rig block"
            ),
            Self::Version { seen } => write!(
                f,
                "the rig block has format version {seen}, but this program reads version {RIG_BLOCK_VERSION}: export it again"
            ),
            Self::Checksum { seen, wanted } => write!(
                f,
                "the rig block's checksum is {seen:08x}, but its bytes give {wanted:08x}: it is damaged, copy it again"
            ),
            Self::Field { field, seen } => write!(
                f,
                "the rig block's {field} is {seen}, which this program does not know"
            ),
            Self::Reserved { offset, seen } => {
                write!(
                    f,
                    "byte {offset} of the rig block is {seen}, but has to be 0"
                )
            }
            Self::Value(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Refusal {}

impl RigBlock {
    /// The block of a rig with a model on it.
    ///
    /// # Errors
    /// [`Error`] names the first quantity that is not usable, or that the device's integers cannot hold.
    pub fn new(
        rig: Rig,
        wiring: Wiring,
        limits: Option<Limits>,
        model: &Model,
    ) -> Result<Self, Error> {
        let chain = Chain::new(model, &rig)?;
        let block = Self {
            rig,
            wiring,
            limits,
            chain,
            model_checksum: blob::checksum_of(model),
        };
        block.check()?;
        Ok(block)
    }

    /// Checks every quantity, and that rig, wiring, chain and limits are of one rig.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        self.rig.check()?;
        self.wiring.check()?;
        let axes = self.rig.axes.len();
        let mut checks = Checks::new();
        let limits = self.limits.as_ref();
        check_together(axes, &self.wiring, limits, &self.chain, &mut checks);
        checks.done()?;
        if let Some(limits) = &self.limits {
            limits.check()?;
        }
        let mut checks = Checks::new();
        let (seen, wanted) = (self.chain.axes() as i32, axes as i32);
        checks.whole("axes of the chain", seen, wanted, wanted);
        let of_rig = self.chain.has_filters_of(&self.rig);
        let quantity = "filters of the rig that are not those of the chain";
        checks.whole(quantity, i32::from(!of_rig), 0, 0);
        for (number, axis) in self.rig.axes.iter().enumerate() {
            let wired = self.wiring.axes.get(number);
            let mut alike = |quantity, wired: bool, counted: bool| {
                let wanted = i32::from(counted);
                checks.whole(quantity, i32::from(wired), wanted, wanted);
            };
            let line = self.chain.lines().get(number).copied().unwrap_or_default();
            alike(
                "lines of the chain, where the force channel has one",
                !line.is_none(),
                !axis.hum.is_none(),
            );
            alike(
                "near counters wired, where the displacement is a difference",
                wired.is_some_and(|w| w.near.is_some()),
                axis.displacement_difference,
            );
            alike(
                "body counters wired, where its counts are worth something",
                wired.is_some_and(|w| w.body.is_some()),
                axis.body_step > 0.0,
            );
            alike(
                "accelerometers wired, where their codes are worth something",
                wired.is_some_and(|w| w.acceleration.iter().any(Option::is_some)),
                axis.acceleration_step > 0.0,
            );
        }
        checks.done()
    }
}

/// Checks that the wiring has as many axes, and that the limits are for such a chain.
fn check_together(
    axes: usize,
    wiring: &Wiring,
    limits: Option<&Limits>,
    chain: &Chain,
    checks: &mut Checks,
) {
    let wanted = axes as i32;
    let wired = wiring.axes.len() as i32;
    checks.whole("axes of the wiring", wired, wanted, wanted);
    if let Some(limits) = limits {
        limits.check_beside(chain, checks);
    }
}

/// The bytes of a rig block.
///
/// # Errors
/// [`Error::OutOfRange`] names the first quantity that is not usable: what is written can be read.
pub fn encode(block: &RigBlock) -> Result<[u8; RIG_BLOCK_LEN], Error> {
    block.check()?;
    let mut bytes = [0; RIG_BLOCK_LEN];
    let (header, rest) = bytes.split_at_mut(TAPS_OFFSET);
    let (taps, rest) = rest.split_at_mut(LIMITS_OFFSET - TAPS_OFFSET);
    let (limits, rest) = rest.split_at_mut(LimitsMessage::LEN);
    Message::of(block).write(&mut Writer::new(header));
    let (places, _) = taps.as_chunks_mut::<4>();
    let (velocity, places) = places.split_at_mut(MAX_TAPS);
    let (acceleration, band) = places.split_at_mut(MAX_TAPS);
    message::write_taps(&block.rig.velocity.taps, velocity);
    message::write_taps(&block.rig.acceleration.taps, acceleration);
    message::write_taps(&block.rig.band.taps, band);
    if let Some(known) = &block.limits {
        LimitsMessage::of(known).write(&mut Writer::new(limits));
    }
    let mut rest = Writer::new(rest);
    SiMessage::of(&block.rig).write(&mut rest);
    block.chain.lines().write(&mut rest);
    lines::hums(&block.rig.axes).write(&mut rest);
    let checksum = CRC.checksum(bytes.get(..CHECKSUM_OFFSET).unwrap_or_default());
    if let Some(place) = bytes.last_chunk_mut() {
        *place = checksum.to_le_bytes();
    }
    Ok(bytes)
}

/// The rig block of some bytes, checked in every respect.
///
/// # Errors
/// As [`on_board`]; then the fields and the quantities of the SI values.
pub fn decode(bytes: &[u8]) -> Result<RigBlock, Refusal> {
    let mut chain = Chain::empty();
    let OnBoard {
        sample_rate_hz,
        sample_rate_uhz,
        wiring,
        model_checksum,
        limits,
    } = on_board(bytes, &mut chain)?;
    let part = bytes.get(SI_OFFSET..PADDING_OFFSET).unwrap_or_default();
    let message = SiMessage::read(&mut Reader::new(part));
    let mut rig = message.rig(sample_rate_hz, bytes, &chain, &wiring)?;
    let part = bytes.get(HUMS_OFFSET..PADDING_OFFSET).unwrap_or_default();
    let mut seen = Seen::new();
    lines::put_hums(part, &mut rig.axes, &mut seen);
    seen.done()?;
    let wanted = rig.sample_rate_uhz();
    let mut checks = Checks::new();
    let quantity = "sample rate in 10⁻⁶ Hz, against that in Hz";
    checks.long(quantity, sample_rate_uhz, wanted, wanted);
    checks.done()?;
    let block = RigBlock {
        rig,
        wiring,
        limits,
        chain,
        model_checksum,
    };
    block.check()?;
    Ok(block)
}

/// What runs on the device, out of the bytes of a rig block; the chain is put into its place, which is [`Chain::empty`], and is of use only
/// when nothing is refused. (A device has no room on its stack to hand a chain round.)
///
/// # Errors
/// [`Refusal`]: length, magic, version and checksum first, in this order, then each field, then each quantity.
///
/// Not inlined: a device's stack holds what it needs only meanwhile.
#[inline(never)]
pub fn on_board(bytes: &[u8], chain: &mut Chain) -> Result<OnBoard, Refusal> {
    let wrong_length = Refusal::Length { seen: bytes.len() };
    let bytes: &[u8; RIG_BLOCK_LEN] = bytes.try_into().map_err(|_| wrong_length)?;
    let (content, &checksum) = bytes.split_last_chunk::<4>().ok_or(wrong_length)?;
    let (&magic, rest) = content.split_first_chunk::<4>().ok_or(wrong_length)?;
    if magic != RIG_BLOCK_MAGIC {
        return Err(Refusal::Magic { seen: magic });
    }
    let (&version, _) = rest.split_first_chunk::<2>().ok_or(wrong_length)?;
    let seen = u16::from_le_bytes(version);
    if seen != RIG_BLOCK_VERSION {
        return Err(Refusal::Version { seen });
    }
    let (seen, wanted) = (u32::from_le_bytes(checksum), CRC.checksum(content));
    if seen != wanted {
        return Err(Refusal::Checksum { seen, wanted });
    }
    let message = Message::read(&mut Reader::new(content));
    let part = |from: usize, to: usize| content.get(from..to).unwrap_or_default();
    let mut seen = Seen::new();
    seen.zeros(PADDING_OFFSET, part(PADDING_OFFSET, CHECKSUM_OFFSET));
    let limits = limits::read(&message, part(LIMITS_OFFSET, SI_OFFSET), &mut seen);
    let wiring = message.wiring(&mut seen);
    seen.done()?;
    if let Some(limits) = &limits {
        limits.check()?;
    }
    wiring.check()?;
    message.put_chain(part(TAPS_OFFSET, LIMITS_OFFSET), chain)?;
    let mut seen = Seen::new();
    lines::put(part(LINES_OFFSET, HUMS_OFFSET), chain, &mut seen);
    seen.done()?;
    let mut checks = Checks::new();
    check_together(chain.axes(), &wiring, limits.as_ref(), chain, &mut checks);
    let (rate, [least, most]) = (message.sample_rate_uhz, RATES_UHZ);
    checks.long("sample rate in 10⁻⁶ Hz", rate, least, most);
    checks.done()?;
    Ok(OnBoard {
        sample_rate_hz: message.sample_rate_hz,
        sample_rate_uhz: message.sample_rate_uhz,
        wiring,
        model_checksum: message.model_checksum,
        limits,
    })
}

/// The sample rates that a block can have, 1 to 10⁶ Hz.
const RATES_UHZ: [u64; 2] = [1_000_000, 1_000_000_000_000];

/// What was seen while a message was read: the first thing that is not as it should be. As [`Checks`], for the bytes.
struct Seen(Option<Refusal>);

impl Seen {
    const fn new() -> Self {
        Self(None)
    }

    #[inline(never)]
    fn say(&mut self, refusal: Refusal) {
        self.0.get_or_insert(refusal);
    }

    /// Bytes that have to be zero; `offset` is where they begin.
    #[inline(never)]
    fn zeros(&mut self, offset: usize, bytes: &[u8]) {
        for (place, &seen) in bytes.iter().enumerate() {
            if seen != 0 {
                self.say(Refusal::Reserved {
                    offset: offset.saturating_add(place),
                    seen,
                });
                return;
            }
        }
    }

    /// A mark that is 0 or 1.
    #[inline(never)]
    fn mark(&mut self, field: &'static str, seen: u8) -> bool {
        if seen > 1 {
            self.say(Refusal::Field { field, seen });
        }
        seen == 1
    }

    /// A real number of which zero has one form.
    fn signless(&mut self, value: f64) {
        if value == 0.0 && value.is_sign_negative() {
            self.say(Refusal::Field {
                field: "sign of a zero",
                seen: 0x80,
            });
        }
    }

    fn done(self) -> Result<(), Refusal> {
        self.0.map_or(Ok(()), Err)
    }
}
