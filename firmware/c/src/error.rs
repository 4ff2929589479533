//! What a call can come to: one number each, with a name.

use core::ffi::CStr;
use jointwatch_shared::fault::Error;
use jointwatch_shared::wire::rig_block::Refusal;

/// What a call came to. The numbers never change their meaning; new ones may be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
#[allow(clippy::upper_case_acronyms, reason = "constants of C are in capitals")]
pub enum jw_error {
    /// It did its work.
    JW_OK = 0,
    /// A pointer is null.
    JW_NULL = 1,
    /// A pointer is not aligned as its object has to be; a buffer has to be a multiple of JW_ALIGN.
    JW_ALIGNMENT = 2,
    /// A buffer is too small: the sizes are JW_MODEL_SIZE, JW_CHAIN_SIZE and JW_MONITOR_SIZE.
    JW_TOO_SMALL = 3,
    /// A model blob or rig block has another length than JW_BLOB_LENGTH.
    JW_LENGTH = 4,
    /// The bytes do not begin as a model blob or a rig block does.
    JW_MAGIC = 5,
    /// The bytes are of a format version that this library does not read: export them again.
    JW_VERSION = 6,
    /// The checksum does not match: the bytes are damaged.
    JW_CHECKSUM = 7,
    /// A field or a quantity is not usable: `jointwatch inspect` says which.
    JW_VALUE = 8,
    /// The rig block or its limits were made for another model.
    JW_OTHER_MODEL = 9,
    /// The rig block has no limits for the monitor.
    JW_NO_LIMITS = 10,
    /// The pointer is not to an object of this kind that this library made.
    JW_NO_OBJECT = 11,
    /// There is no such axis or window.
    JW_RANGE = 12,
    /// There is no value yet.
    JW_NOTHING = 13,
}

use jw_error::*;

impl jw_error {
    /// Every one, in the order of the numbers.
    const ALL: [Self; 14] = [
        JW_OK,
        JW_NULL,
        JW_ALIGNMENT,
        JW_TOO_SMALL,
        JW_LENGTH,
        JW_MAGIC,
        JW_VERSION,
        JW_CHECKSUM,
        JW_VALUE,
        JW_OTHER_MODEL,
        JW_NO_LIMITS,
        JW_NO_OBJECT,
        JW_RANGE,
        JW_NOTHING,
    ];

    /// Its name, as C has it.
    pub const fn name(self) -> &'static CStr {
        match self {
            JW_OK => c"JW_OK",
            JW_NULL => c"JW_NULL",
            JW_ALIGNMENT => c"JW_ALIGNMENT",
            JW_TOO_SMALL => c"JW_TOO_SMALL",
            JW_LENGTH => c"JW_LENGTH",
            JW_MAGIC => c"JW_MAGIC",
            JW_VERSION => c"JW_VERSION",
            JW_CHECKSUM => c"JW_CHECKSUM",
            JW_VALUE => c"JW_VALUE",
            JW_OTHER_MODEL => c"JW_OTHER_MODEL",
            JW_NO_LIMITS => c"JW_NO_LIMITS",
            JW_NO_OBJECT => c"JW_NO_OBJECT",
            JW_RANGE => c"JW_RANGE",
            JW_NOTHING => c"JW_NOTHING",
        }
    }

    /// The name of a number; "unknown" for one that this library does not give.
    pub fn name_of(number: i32) -> &'static CStr {
        let known = Self::ALL.into_iter().find(|error| *error as i32 == number);
        known.map_or(c"unknown", Self::name)
    }
}

impl From<Error> for jw_error {
    fn from(error: Error) -> Self {
        match error {
            Error::BlobLength { .. } => JW_LENGTH,
            Error::BlobMagic { .. } => JW_MAGIC,
            Error::BlobVersion { .. } => JW_VERSION,
            Error::BlobChecksum { .. } => JW_CHECKSUM,
            _ => JW_VALUE,
        }
    }
}

impl From<Refusal> for jw_error {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Length { .. } => JW_LENGTH,
            Refusal::Magic { .. } => JW_MAGIC,
            Refusal::Version { .. } => JW_VERSION,
            Refusal::Checksum { .. } => JW_CHECKSUM,
            _ => JW_VALUE,
        }
    }
}
