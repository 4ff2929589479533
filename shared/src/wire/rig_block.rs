//! The rig as bytes: 4096 of them, the same in a file, on the wire and in flash beside the model.
//!
//! A head, then the [`Rig`] as a postcard message, then zeros, then a checksum;
//! `docs/reference/rig-block.md` lists the fields. A block is refused unless it is, to the byte,
//! what [`encode`] writes of the rig in it, and unless the chain and the chips can take every
//! quantity.

use crate::fault::Error;
use crate::wire::blob::{BLOB_LEN, CRC};
use crate::wire::rig::Rig;
use core::fmt;
use postcard::ser_flavors::Flavor;

/// Bytes of a rig block.
pub const RIG_BLOCK_LEN: usize = 4096;
/// The format version that this program writes and reads.
pub const RIG_BLOCK_VERSION: u16 = 5;
/// The first four bytes.
pub const RIG_BLOCK_MAGIC: [u8; 4] = *b"JWRB";
/// Where a flash slot holds it: right behind the model blob, so that both are written and given up
/// together.
pub const RIG_BLOCK_OFFSET: usize = BLOB_LEN;
/// Where the message begins, behind magic and version.
pub const MESSAGE_OFFSET: usize = 6;
/// Where the checksum stands.
pub const CHECKSUM_OFFSET: usize = RIG_BLOCK_LEN - 4;

/// Why bytes are no rig block. `Display` writes one sentence without a full stop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// Another length than [`RIG_BLOCK_LEN`].
    Length {
        /// Bytes that were found.
        seen: usize,
    },
    /// The first bytes are not those of a rig block: erased flash, or another file.
    Magic {
        /// The four bytes seen.
        seen: [u8; 4],
    },
    /// The block has a format version that this program does not read.
    Version {
        /// The format version that was found.
        seen: u16,
    },
    /// The block is damaged.
    Checksum {
        /// The checksum that stands in the block.
        seen: u32,
        /// The checksum of its bytes.
        wanted: u32,
    },
    /// Its message is not that of a rig: a mark that is neither 0 nor 1, a list that is too long, a
    /// number that is too wide.
    Message,
    /// Its message says what it says in other bytes than this program would.
    Form,
    /// A byte behind the message is not zero.
    Reserved {
        /// Where it stands, from the block's start.
        offset: usize,
        /// The value that was found.
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
            Self::Message => "its message is not that of a rig",
            Self::Form => "its message is not written as this program writes it",
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
            Self::Message => write!(
                f,
                "the rig block's message is not that of a rig: export it again"
            ),
            Self::Form => write!(
                f,
                "the rig block's message is not written as this program writes it: export it again"
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

/// The bytes of a rig block.
///
/// # Errors
/// [`Error::OutOfRange`] names the first quantity that is not usable: what is written can be read.
pub fn encode(rig: &Rig) -> Result<[u8; RIG_BLOCK_LEN], Error> {
    rig.check()?;
    let mut bytes = [0; RIG_BLOCK_LEN];
    let (content, checksum) = bytes.split_at_mut(CHECKSUM_OFFSET);
    let (head, message) = content.split_at_mut(MESSAGE_OFFSET);
    let (magic, version) = head.split_at_mut(RIG_BLOCK_MAGIC.len());
    magic.copy_from_slice(&RIG_BLOCK_MAGIC);
    version.copy_from_slice(&RIG_BLOCK_VERSION.to_le_bytes());
    let room = message.len() as f64;
    let too_long = |_| Error::OutOfRange {
        quantity: "bytes of a rig's message",
        seen: room + 1.0,
        least: 1.0,
        most: room,
    };
    postcard::to_slice(rig, message).map_err(too_long)?;
    checksum.copy_from_slice(&CRC.checksum(content).to_le_bytes());
    Ok(bytes)
}

/// The rig of a block's bytes, checked in every respect.
///
/// # Errors
/// [`Refusal`]: length, magic, version and checksum first, in this order, then the message, then
/// each quantity, then the form.
pub fn decode(bytes: &[u8]) -> Result<Rig, Refusal> {
    let message = message(bytes)?;
    let (rig, rest) = postcard::take_from_bytes::<Rig>(message).map_err(|_| Refusal::Message)?;
    if let Some(at) = rest.iter().position(|&byte| byte != 0) {
        return Err(Refusal::Reserved {
            offset: CHECKSUM_OFFSET - rest.len() + at,
            seen: rest.get(at).copied().unwrap_or_default(),
        });
    }
    rig.check()?;
    postcard::serialize_with_flavor(&rig, Same(message)).map_err(|_| Refusal::Form)?;
    Ok(rig)
}

/// The checksum of the model that an undamaged block is for, without the rest of it: the whole is
/// too large for a stack that holds much else.
///
/// # Errors
/// [`Refusal`]: length, magic, version and checksum, then the message.
pub fn model_checksum(bytes: &[u8]) -> Result<u32, Refusal> {
    // It stands first.
    let read = postcard::take_from_bytes::<u32>(message(bytes)?);
    read.map(|(checksum, _)| checksum)
        .map_err(|_| Refusal::Message)
}

/// The message of an undamaged block, and the zeros behind it.
fn message(bytes: &[u8]) -> Result<&[u8], Refusal> {
    let wrong_length = Refusal::Length { seen: bytes.len() };
    let bytes: &[u8; RIG_BLOCK_LEN] = bytes.try_into().map_err(|_| wrong_length)?;
    let (content, &checksum) = bytes.split_last_chunk::<4>().ok_or(wrong_length)?;
    let (&magic, rest) = content.split_first_chunk::<4>().ok_or(wrong_length)?;
    if magic != RIG_BLOCK_MAGIC {
        return Err(Refusal::Magic { seen: magic });
    }
    let (&version, message) = rest.split_first_chunk::<2>().ok_or(wrong_length)?;
    let seen = u16::from_le_bytes(version);
    if seen != RIG_BLOCK_VERSION {
        return Err(Refusal::Version { seen });
    }
    let (seen, wanted) = (u32::from_le_bytes(checksum), CRC.checksum(content));
    if seen != wanted {
        return Err(Refusal::Checksum { seen, wanted });
    }
    Ok(message)
}

/// Holds what is written against bytes that are there already.
struct Same<'a>(&'a [u8]);

impl Flavor for Same<'_> {
    type Output = ();

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        match self.0.split_first() {
            Some((&seen, rest)) if seen == byte => {
                self.0 = rest;
                Ok(())
            }
            _ => Err(postcard::Error::SerializeBufferFull),
        }
    }

    fn finalize(self) -> postcard::Result<()> {
        Ok(())
    }
}
