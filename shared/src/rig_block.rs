//! The rig as bytes: 4096 of them, the same layout in a file, on the wire and in flash beside the model.
//!
//! It holds what the device has to know besides the model: what each count is worth, how the chips are wired and set, the
//! filters' taps, by how much channels are late, and the monitor's limits. `docs/rig-block.md` lists every byte. Decoding
//! refuses whatever is not as the page says, and every quantity that the chain or a chip could not take.

mod message;

use crate::blob::{BLOB_LEN, CRC};
use crate::error::Error;
use crate::layout::{Field, Reader, Writer};
use crate::monitor::limits::Limits;
use crate::rig::{MAX_BAND_TAPS, MAX_TAPS, Rig};
use crate::wiring::Wiring;
use core::fmt;
use message::Message;

/// Bytes of a rig block.
pub const RIG_BLOCK_LEN: usize = 4096;
/// The format version that this program writes and reads.
pub const RIG_BLOCK_VERSION: u16 = 1;
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
/// Bytes for them; the rest of the block up to the checksum is zero.
const LIMITS_LEN: usize = 256;
const PADDING_OFFSET: usize = LIMITS_OFFSET + LIMITS_LEN;

/// Everything that a device has to know of its rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigBlock {
    /// What a count is worth, inertia, filters, delays.
    pub rig: Rig,
    /// Which chip gives which count, and how the chips are set.
    pub wiring: Wiring,
    /// What is normal; `None` until validation records were evaluated, and the monitor then only watches the sensors.
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
    /// The monitor's limits are not written as they should be.
    Limits,
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
            Self::Limits => "the monitor's limits cannot be read",
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
            Self::Limits => f.write_str(
                "the limits of the monitor in the rig block cannot be read: export it again",
            ),
            Self::Value(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Refusal {}

impl RigBlock {
    /// Checks every quantity, and that rig, wiring and limits are of one rig.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        self.rig.check()?;
        self.wiring.check()?;
        let within = Error::unless_within;
        let axes = self.rig.axes.len() as f64;
        within(
            "axes of the wiring",
            self.wiring.axes.len() as f64,
            axes,
            axes,
        )?;
        if let Some(limits) = &self.limits {
            limits.check()?;
            within(
                "axes of the monitor's limits",
                limits.axes.len() as f64,
                axes,
                axes,
            )?;
        }
        let alike = |quantity, wired: bool, counted: bool| {
            let wanted = f64::from(u8::from(counted));
            within(quantity, f64::from(u8::from(wired)), wanted, wanted)
        };
        for (axis, wired) in self.rig.axes.iter().zip(&self.wiring.axes) {
            alike(
                "near counters wired, where the displacement is a difference",
                wired.near.is_some(),
                axis.displacement_difference,
            )?;
            alike(
                "body counters wired, where its counts are worth something",
                wired.body.is_some(),
                axis.body_step > 0.0,
            )?;
            alike(
                "accelerometers wired, where their codes are worth something",
                wired.acceleration.iter().any(Option::is_some),
                axis.acceleration_step > 0.0,
            )?;
        }
        Ok(())
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
    Message::of(block).write(&mut Writer::new(header));
    let (places, _) = taps.as_chunks_mut::<4>();
    let (velocity, places) = places.split_at_mut(MAX_TAPS);
    let (acceleration, band) = places.split_at_mut(MAX_TAPS);
    message::write_taps(&block.rig.velocity.taps, velocity);
    message::write_taps(&block.rig.acceleration.taps, acceleration);
    message::write_taps(&block.rig.band.taps, band);
    if let (Some(limits), Some(place)) = (&block.limits, rest.get_mut(..LIMITS_LEN)) {
        // At its longest a list of limits takes 231 bytes, which a test pins.
        let _ = postcard::to_slice(limits, place);
    }
    let checksum = CRC.checksum(bytes.get(..CHECKSUM_OFFSET).unwrap_or_default());
    if let Some(place) = bytes.last_chunk_mut() {
        *place = checksum.to_le_bytes();
    }
    Ok(bytes)
}

/// The rig block of some bytes, checked in every respect.
///
/// # Errors
/// [`Refusal`]: length, magic, version and checksum first, in this order, then each field, then each quantity.
///
/// Not inlined: a device's stack holds what it needs only meanwhile.
#[inline(never)]
pub fn decode(bytes: &[u8]) -> Result<RigBlock, Refusal> {
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
    unless_zero(PADDING_OFFSET, part(PADDING_OFFSET, CHECKSUM_OFFSET))?;
    let block = RigBlock {
        rig: message.rig(content, part(TAPS_OFFSET, LIMITS_OFFSET))?,
        wiring: message.wiring()?,
        limits: limits(message.limits, part(LIMITS_OFFSET, PADDING_OFFSET))?,
    };
    block.check()?;
    Ok(block)
}

/// The limits in their bytes, when there are any.
fn limits(present: u8, bytes: &[u8]) -> Result<Option<Limits>, Refusal> {
    match present {
        0 => unless_zero(LIMITS_OFFSET, bytes).map(|()| None),
        1 => {
            let (limits, rest) = postcard::take_from_bytes(bytes).map_err(|_| Refusal::Limits)?;
            // One list of limits has one form: what would be written otherwise is not read.
            let mut written = [0; LIMITS_LEN];
            let used = bytes.len() - rest.len();
            let same = postcard::to_slice(&limits, &mut written)
                .is_ok_and(|form| Some(&*form) == bytes.get(..used));
            if !same {
                return Err(Refusal::Limits);
            }
            unless_zero(LIMITS_OFFSET + used, rest)?;
            Ok(Some(limits))
        }
        seen => Err(Refusal::Field {
            field: "mark of the monitor's limits",
            seen,
        }),
    }
}

/// Refuses the first byte that is not zero; `offset` is where `bytes` begin.
fn unless_zero(offset: usize, bytes: &[u8]) -> Result<(), Refusal> {
    match bytes.iter().position(|&byte| byte != 0) {
        None => Ok(()),
        Some(place) => Err(Refusal::Reserved {
            offset: offset + place,
            seen: bytes.get(place).copied().unwrap_or(0),
        }),
    }
}
