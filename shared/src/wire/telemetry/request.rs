//! What the host asks of the device.

use super::upload::{Signature, UploadRequest};
use super::{Message, read, write};
use crate::wire::slot::Order;
use serde::Serialize;

/// What the host says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "message", rename_all = "snake_case")]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger ones on"
)]
pub enum Request {
    /// Are you there? Answered by [`Answer`](super::Answer).
    Ping,
    /// Say who you are. Answered by [`Hello`](super::Hello).
    Hello,
    /// Send samples, or stop. Answered by [`Answer`](super::Answer).
    Stream {
        /// 0: none; 1: every sample; n: every n-th.
        every: u16,
    },
    /// Begin the monitor's statistics and the counters anew. Answered by [`Answer`](super::Answer).
    ResetStatistics,
    /// Send the snapshot of the last alarm again. Answered by [`Answer`](super::Answer), then by
    /// snapshots.
    Snapshot,
    /// A step of an upload. Answered by [`UploadReply`](super::UploadReply).
    Upload(UploadRequest),
    /// Something that the device does only when its owner signs for it. Answered by
    /// [`Answer`](super::Answer).
    Order {
        /// What the device is to do.
        order: Order,
        /// The number that [`Access`](super::Access) tells.
        number: u32,
        /// The signature of [`signed_order`](crate::wire::slot::signed_order).
        signature: Signature,
    },
    /// Send a piece of the counts around the alarm. Answered by
    /// [`CapturePiece`](super::CapturePiece), or by [`Answer`](super::Answer) when there is
    /// none.
    Capture {
        /// Which one, from 0.
        piece: u16,
    },
}

impl Message for Request {
    fn tag(&self) -> u8 {
        match self {
            Self::Ping => 0x81,
            Self::Hello => 0x82,
            Self::Stream { .. } => 0x83,
            Self::ResetStatistics => 0x84,
            Self::Snapshot => 0x85,
            Self::Upload(_) => 0x86,
            Self::Order { .. } => 0x87,
            Self::Capture { .. } => 0x88,
        }
    }

    fn write<'a>(&self, place: &'a mut [u8]) -> Option<&'a [u8]> {
        match self {
            Self::Ping | Self::Hello | Self::ResetStatistics | Self::Snapshot => Some(&[]),
            Self::Stream { every } => write(every, place),
            Self::Capture { piece } => write(piece, place),
            Self::Upload(step) => write(step, place),
            Self::Order {
                order,
                number,
                signature,
            } => write(&(order, number, signature), place),
        }
    }

    fn read(tag: u8, fields: &[u8]) -> Option<Self> {
        match (tag, fields) {
            (0x81, []) => Some(Self::Ping),
            (0x82, []) => Some(Self::Hello),
            (0x83, fields) => read(fields).map(|every| Self::Stream { every }),
            (0x84, []) => Some(Self::ResetStatistics),
            (0x85, []) => Some(Self::Snapshot),
            (0x86, fields) => read(fields).map(Self::Upload),
            (0x87, fields) => read(fields).map(|(order, number, signature)| Self::Order {
                order,
                number,
                signature,
            }),
            (0x88, fields) => read(fields).map(|piece| Self::Capture { piece }),
            _ => None,
        }
    }
}
