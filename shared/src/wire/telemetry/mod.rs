//! What the device and the host tell each other over the serial line, as frames that survive noise.
//!
//! A frame is a tag, a sequence number, the fields of one message as
//! [postcard](https://postcard.jamesmunns.com) writes them, and a CRC-32; all of it COBS-coded, so
//! that the byte 0 occurs in no frame and ends each one. `docs/reference/telemetry.md` lists every
//! byte.
//!
//! Undetected errors. In a payload of at most [`MAX_PAYLOAD`] bytes the CRC finds every error of up
//! to four bits and every burst of up to 32 bits (a test proves the first by trying all), and any
//! other damage with probability 1 − 2⁻³². On a line that destroys each of a thousand frames a
//! second, a wrong one would get through about once in fifty days, if its tag and its fields
//! happened to make sense as well. A CRC-16 would let one through each minute.

mod cobs;
mod frame;
mod report;
mod request;
mod upload;
mod verdict;

pub use frame::{Counts, Damage, Decoder, Received, TooLong, encode};
pub use report::{
    Access, Alarm, Answer, Answered, AxisHealth, AxisIdentity, AxisStatus, CAPTURE_PIECE,
    CapturePiece, Counters, Event, Health, Hello, MAX_CHANNELS, ModelIdentity, Occasion, Quantity,
    Restart, RigIdentity, SNAPSHOT_PIECE, Sample, SampleOutput, SensorStatus, Snapshot, Status,
    Supply, Upkeep,
};
pub use request::Request;
pub use upload::{
    Kind, MAX_CHUNK, ModelFault, Refusal, Signature, Slot, UploadReply, UploadRequest,
};
pub use verdict::{KeptAlarm, Verdict};

use heapless::String;
use serde::{Deserialize, Serialize};

/// The version of this protocol, which a [`Hello`] carries. It changes when a frame changes its
/// meaning or its bytes; a message that is merely added keeps it, because an old receiver counts a
/// tag that it does not know and goes on.
pub const PROTOCOL_VERSION: u16 = 3;

/// Bits per second on the serial line: 8 data bits, no parity, one stop bit. A divider of the
/// microcontroller's 42 MHz gives it exactly.
pub const BAUD: u32 = 1_000_000;
/// Status reports per second.
pub const STATUS_HZ: u32 = 10;
/// Bytes of tag, sequence number, fields and CRC that a frame may have, before COBS. It keeps every
/// frame within one COBS block, which is at most 254 bytes long.
pub const MAX_PAYLOAD: usize = 250;
/// Bytes of a frame on the line: a 0 that cuts off what noise left behind, COBS's one byte, the
/// payload, the closing 0.
pub const MAX_FRAME: usize = MAX_PAYLOAD + 3;
/// Bytes of a payload before its fields: tag and sequence number.
const HEAD: usize = 3;
/// Bytes of a payload after its fields.
const CHECKSUM: usize = 4;

/// A short text in a frame.
pub type Text = String<16>;

/// A set of messages that go one way over the line, each with a tag of its own.
///
/// Tags of the two directions differ in their highest bit, so that a line that echoes is not taken
/// for an answer.
pub trait Message: Sized {
    /// The byte that says which message it is; never used for another one.
    fn tag(&self) -> u8;

    /// Writes the fields into `place` and gives the written bytes; `None` when they do not fit.
    fn write<'a>(&self, place: &'a mut [u8]) -> Option<&'a [u8]>;

    /// The message with this tag and these fields; `None` for an unknown tag, for fields that make
    /// no sense, and for bytes left over.
    fn read(tag: u8, fields: &[u8]) -> Option<Self>;
}

/// Writes one message's fields.
fn write<'a, T: Serialize>(fields: &T, place: &'a mut [u8]) -> Option<&'a [u8]> {
    let written = postcard::to_slice(fields, place).ok()?;
    Some(written)
}

/// Reads one message's fields, all of the bytes.
fn read<'a, T: Deserialize<'a>>(fields: &'a [u8]) -> Option<T> {
    match postcard::take_from_bytes(fields) {
        Ok((message, [])) => Some(message),
        _ => None,
    }
}

/// The messages that the device sends, each with its tag and the type of its fields.
macro_rules! reports {
    ($($(#[$about:meta])* $message:ident($fields:ident) = $tag:literal,)*) => {
        /// What the device says.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(tag = "message", rename_all = "snake_case")]
        #[allow(
            clippy::large_enum_variant,
            reason = "there is no heap to put the larger ones on"
        )]
        pub enum Report {
            $($(#[$about])* $message($fields),)*
        }

        impl Message for Report {
            fn tag(&self) -> u8 {
                match self {
                    $(Self::$message(_) => $tag,)*
                }
            }

            fn write<'a>(&self, place: &'a mut [u8]) -> Option<&'a [u8]> {
                match self {
                    $(Self::$message(fields) => write(fields, place),)*
                }
            }

            fn read(tag: u8, fields: &[u8]) -> Option<Self> {
                match tag {
                    $($tag => read(fields).map(Self::$message),)*
                    _ => None,
                }
            }
        }
    };
}

reports! {
    /// Who it is: after a restart, when asked, and when its model or rig has changed.
    Hello(Hello) = 0x01,
    /// How it is, ten times a second.
    Status(Status) = 0x02,
    /// A piece of the residual around an alarm.
    Snapshot(Snapshot) = 0x03,
    /// One sample, when streaming.
    Sample(Sample) = 0x04,
    /// How an upload is getting on.
    Upload(UploadReply) = 0x05,
    /// Something happened that a person should know of.
    Event(Event) = 0x06,
    /// What became of a request other than an upload.
    Answer(Answer) = 0x07,
    /// How each axis stands and how much that says, with every status.
    Health(Health) = 0x08,
    /// An alarm that nobody has acknowledged, with every status.
    Alarm(Alarm) = 0x09,
    /// A piece of the counts around an alarm.
    Capture(CapturePiece) = 0x0a,
    /// What outlasts a loss of power, with every status.
    Upkeep(Upkeep) = 0x0b,
}
