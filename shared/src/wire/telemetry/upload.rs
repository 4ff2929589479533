//! How a model or a rig block gets onto the device: the host's requests, piece by piece, and the
//! device's replies.
//!
//! The host begins, sends chunks in order, and finishes. Each request is answered; a chunk or its
//! answer that got lost on the line is simply sent again, because a chunk that the device already
//! has is answered and otherwise ignored.

use crate::fault::Error;
use crate::wire::bytes::Bytes;
use crate::wire::slot::{Header, SIGNATURE_LEN};
use core::fmt;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Bytes that a chunk may have. A chunk that ends elsewhere than the upload should be this long.
pub const MAX_CHUNK: usize = 128;

/// What is uploaded: a model or a rig block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A model blob, with the rig block behind it where there is one.
    Model,
    /// A rig block alone, which today's firmware takes no more.
    Rig,
}

/// One of the two places in flash that can hold a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slot {
    /// Slot A, which is looked at first.
    A,
    /// Slot B.
    B,
}

impl Slot {
    /// Both, in the order in which they are looked at.
    pub const ALL: [Self; 2] = [Self::A, Self::B];

    /// `a` or `b`, as logs and the self-test's text have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::B => "b",
        }
    }

    /// The slot that this one is not.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// An Ed25519 signature: R, then S, 64 bytes in a row on the line.
pub type Signature = Bytes<SIGNATURE_LEN>;

/// A step of an upload.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on"
)]
pub enum UploadRequest {
    /// Begins; an upload that was under way is given up when the header may be taken.
    Begin {
        /// What is signed: length, release, class of devices, digest.
        header: Header,
        /// The signature of the header; a device refuses one without it unless it was built
        /// otherwise.
        signature: Option<Signature>,
    },
    /// The next bytes of the content.
    Chunk {
        /// Where they belong, in bytes from the beginning.
        offset: u32,
        /// The bytes, at least one.
        data: Vec<u8, MAX_CHUNK>,
    },
    /// All bytes were sent: check them, and activate them if they are good.
    Finish,
    /// Give up; what was active stays active.
    Abort,
}

/// Where an upload stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UploadReply {
    /// Bytes up to this one are in flash; the next chunk begins here.
    Accepted {
        /// In bytes from the beginning; the length of the upload once all are there.
        next: u32,
    },
    /// The content was checked and takes effect.
    Activated {
        /// What was uploaded: a model or a rig block.
        kind: Kind,
        /// The slot of a model; `None` for a rig block.
        slot: Option<Slot>,
    },
    /// Given up as asked.
    Aborted,
    /// Refused. The upload is over, except after [`Refusal::WrongOffset`] and
    /// [`Refusal::EmptyChunk`].
    Refused(Refusal),
}

/// Why an upload, or a step of it, was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// Nothing was begun: the device has restarted, or the host never began.
    NotBegun,
    /// The device is busy with something that must not be disturbed.
    Busy,
    /// What was announced is not as long as a blob of its kind.
    Length {
        /// Bytes that were announced.
        seen: u32,
        /// Bytes that are possible at most.
        most: u32,
    },
    /// A chunk does not begin where the last one ended; send the one that does.
    WrongOffset {
        /// Where the next chunk has to begin.
        next: u32,
    },
    /// A chunk without bytes.
    EmptyChunk,
    /// A chunk reaches beyond the announced length.
    BeyondEnd,
    /// Finished before all bytes were there.
    Incomplete {
        /// Bytes that are there.
        seen: u32,
    },
    /// The bytes do not have the announced digest.
    Checksum {
        /// The first four bytes of the digest of those that are there.
        seen: u32,
    },
    /// No signature, and this device asks for one.
    Unsigned,
    /// The signature is not one of a key that the firmware trusts.
    Signature,
    /// No key is built into the firmware, so that nothing can be verified. Today's firmware always
    /// has one, and never sends this.
    NoKey,
    /// The bytes are no model that the device can use.
    Model(ModelFault),
    /// The bytes are no rig block that the device can use.
    Rig(ModelFault),
    /// The model and the rig block do not fit each other: axes, sample rate, or a quantity outside
    /// the integers.
    Mismatch,
    /// The flash could not be erased or written.
    Flash,
    /// The flash has been erased as often as it may be in its life, or the journal that counts it
    /// is full.
    Worn,
    /// The flash has been erased as often as it may be in an hour.
    TooOften,
    /// It is signed for another class of devices.
    Class,
    /// Its release is not newer than that of a model that has proven itself here, or was taken
    /// back.
    NotNewer {
        /// The newest of those.
        newest: u32,
    },
}

impl Refusal {
    /// Every refusal in words, for a person.
    pub const fn words(self) -> &'static str {
        match self {
            Self::NotBegun => "no upload is under way; the device may have restarted: begin again",
            Self::Busy => "the device is busy; try again",
            Self::Length { .. } => "it is not as long as the device expects; is it the right file?",
            Self::WrongOffset { .. } => "a chunk came out of turn",
            Self::EmptyChunk => "a chunk had no bytes",
            Self::BeyondEnd => "a chunk reached beyond the announced length",
            Self::Incomplete { .. } => "the upload was finished before all bytes were there",
            Self::Checksum { .. } => "the bytes that arrived are not those that were announced",
            Self::Unsigned => "the device takes only what is signed: sign it first",
            Self::Signature => "the signature is not by the key that the device trusts",
            Self::NoKey => "the firmware was built without a key, so it can verify no signature",
            Self::Model(_) => "the device cannot use this model",
            Self::Rig(_) => "the device cannot use this rig block",
            Self::Mismatch => "model and rig block do not fit each other",
            Self::Flash => "the flash could not be written; the slot may be worn out",
            Self::Worn => {
                "the device's flash has been erased as often as it may be, or its journal is full"
            }
            Self::TooOften => {
                "the device's flash has been erased too often this hour; try again in an hour"
            }
            Self::Class => {
                "it is signed for another class of devices; sign it with --class and the name of this one"
            }
            Self::NotNewer { .. } => {
                "it is not newer than what has run on the device; sign it again"
            }
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())?;
        match self {
            Self::Length { seen, most } => write!(f, " ({seen} bytes, at most {most})"),
            Self::WrongOffset { next } => write!(f, " (the next one begins at byte {next})"),
            Self::Incomplete { seen } => write!(f, " ({seen} bytes are)"),
            Self::Checksum { seen } => write!(f, " (their digest begins with {seen:08x})"),
            Self::NotNewer { newest } => write!(f, " (its release has to be above {newest})"),
            Self::Model(fault) | Self::Rig(fault) => write!(f, ": {}", fault.words()),
            _ => Ok(()),
        }
    }
}

/// What is wrong with a model or a rig block, without the numbers: the host finds those out from
/// its own copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelFault {
    /// The content has another length than was announced.
    Length,
    /// Does not begin as it should.
    Magic,
    /// Another version of the format.
    Version,
    /// The content's checksum does not hold.
    Checksum,
    /// A field has a value that is not known.
    Field,
    /// A byte that has to be zero is not.
    Reserved,
    /// A quantity lies outside its range.
    OutOfRange,
    /// A sum could overflow.
    Overflow,
    /// A refusal that this version does not know.
    Other,
}

impl ModelFault {
    /// The fault in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Length => "it has another length",
            Self::Magic => "it does not begin as it should",
            Self::Version => "its format has another version",
            Self::Checksum => "its checksum does not match",
            Self::Field => "a field has a value that is not known",
            Self::Reserved => "a byte that has to be zero is not",
            Self::OutOfRange => "a quantity lies outside its range",
            Self::Overflow => "a sum could overflow",
            Self::Other => "it is not one that the device can use",
        }
    }
}

impl From<&Error> for ModelFault {
    fn from(why: &Error) -> Self {
        match why {
            Error::BlobLength { .. } => Self::Length,
            Error::BlobMagic { .. } => Self::Magic,
            Error::BlobVersion { .. } => Self::Version,
            Error::BlobChecksum { .. } => Self::Checksum,
            Error::BlobField { .. } => Self::Field,
            Error::BlobReserved { .. } => Self::Reserved,
            Error::OutOfRange { .. } => Self::OutOfRange,
            Error::Overflow { .. } | Error::WeightOverflow { .. } => Self::Overflow,
            _ => Self::Other,
        }
    }
}
