//! A model slot byte by byte: model, rig block, the seal that makes them one signed whole, and the
//! marks of its life.
//!
//! A slot is a flash sector of its own. Erased flash reads ones; a word of four bytes can be
//! programmed once, then only the whole sector can be erased. Every step of a slot's life is
//! therefore a word of its own, and the order in which the words are programmed is what makes an
//! update safe (`firmware/src/store`). `docs/reference/slot.md` lists the bytes.
//!
//! A file that `jointwatch sign` writes is the same bytes: it can be sent to the device, or put
//! into a slot by a debugger.

use crate::wire::blob::{BLOB_LEN, CRC};
use crate::wire::bytes::Bytes;
use crate::wire::telemetry::{KeptAlarm, Verdict};
use serde::{Deserialize, Serialize};

/// Where the model blob begins.
pub const MODEL_OFFSET: usize = 0;
/// Where the rig block begins.
pub const RIG_OFFSET: usize = BLOB_LEN;
/// Bytes that a rig block may have.
pub const RIG_ROOM: usize = 4096;
/// Where the seal begins.
pub const SEAL_OFFSET: usize = 8224;
/// Bytes of the seal.
pub const SEAL_LEN: usize = 140;
/// Bytes of a slot that belong to its model. The journal follows.
pub const SLOT_LEN: usize = 8448;
/// Bytes of an Ed25519 signature.
pub const SIGNATURE_LEN: usize = 64;
/// The format version of seal and marks that this program writes and reads.
pub const SLOT_VERSION: u16 = 2;
/// The seal's first four bytes.
pub const SEAL_MAGIC: [u8; 4] = *b"JWSL";

/// A word as erased flash reads it: the step has not been taken.
pub const ERASED: [u8; 4] = [0xFF; 4];
/// A programmed mark: the step has been taken. Anything between is a word that power failed on.
pub const MARKED: [u8; 4] = [0; 4];

/// The slot is not to be used. Once before the seal and once behind it, so that an erasure that
/// power cuts short, from whichever end, cannot leave a seal without at least one of them.
pub const VOID_OFFSETS: [usize; 2] = [8192, 8444];
/// The slot was erased for an upload: what stands in it without a seal is no model, however much it
/// looks like one.
pub const BEGUN_OFFSET: usize = 8196;
/// Everything was written and verified.
pub const SEALED_OFFSET: usize = 8364;
/// The device has started with this model.
pub const TRIED_OFFSET: usize = 8368;
/// The model has run: eight words, of which one suffices. The next one is taken when power failed
/// on the one before.
pub const CONFIRMED_OFFSETS: [usize; 8] = [8372, 8376, 8380, 8384, 8388, 8392, 8396, 8400];
/// Where the journal begins: what a device has to remember beyond the life of a model, an [`Entry`]
/// after the other, up to the end of the sector.
pub const JOURNAL_OFFSET: usize = SLOT_LEN;

/// Bytes of what is signed: see [`Header::signed_bytes`].
pub const HEADER_LEN: usize = 76;
/// Bytes of a [`signed_order`].
pub const ORDER_LEN: usize = 40;
/// Bytes of the name of a class of devices.
pub const CLASS_LEN: usize = 16;
/// Bytes of a digest: the first of SHA-512.
pub const DIGEST_LEN: usize = 32;
/// What a signature is for, so that none made for another purpose fits.
const PURPOSE: [u8; 16] = *b"jointwatch slot2";
/// The same of an order.
const ORDER_PURPOSE: [u8; 16] = *b"jointwatch order";

/// What is signed of an upload, and sent before the first of its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Bytes of the rig block, a multiple of 4; 0 when there is none.
    pub rig_len: u32,
    /// Grows from one signed model to the next. A device takes none that is not newer than the
    /// newest that has proven itself on it.
    pub release: u32,
    /// The class of devices that it is for: its name, and zeros behind it.
    pub class: Bytes<CLASS_LEN>,
    /// The first bytes of the SHA-512 of model and rig block.
    pub digest: Bytes<DIGEST_LEN>,
}

impl Header {
    /// The bytes that a signature is made over.
    pub fn signed_bytes(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        let numbers = [BLOB_LEN as u32, self.rig_len, self.release].map(u32::to_le_bytes);
        let (class, digest) = (self.class.bytes(), self.digest.bytes());
        let all = PURPOSE.iter().chain(numbers.as_flattened());
        for (place, &byte) in bytes.iter_mut().zip(all.chain(&class).chain(&digest)) {
            *place = byte;
        }
        bytes
    }

    /// Whether the rig block has a length that one can have.
    pub const fn has_possible_length(&self) -> bool {
        self.rig_len <= RIG_ROOM as u32 && self.rig_len.is_multiple_of(4)
    }
}

/// What a device does only when its owner signs for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Restart after a second.
    Restart,
    /// Go back to the model before the one that runs, and take this one never again.
    RollBack,
    /// The alarm that stands has been seen.
    Acknowledge,
    /// Trust the other key no longer.
    RevokeOther,
}

/// The bytes that the signature of an order is made over. `number` is the one that the device tells
/// when it introduces itself; it changes with every order that is carried out, so that none is
/// carried out twice.
pub fn signed_order(order: Order, number: u32, class: &[u8; CLASS_LEN]) -> [u8; ORDER_LEN] {
    let mut bytes = [0; ORDER_LEN];
    let numbers = [order as u32, number].map(u32::to_le_bytes);
    let all = ORDER_PURPOSE.iter().chain(numbers.as_flattened());
    for (place, &byte) in bytes.iter_mut().zip(all.chain(class)) {
        *place = byte;
    }
    bytes
}

/// What a device has to remember beyond the life of a model. Every change of it is an entry of its
/// own in the journal of a slot that is not about to be erased; the one with the largest number
/// counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    /// Grows with every entry.
    pub number: u32,
    /// Erasures of a slot in the device's life.
    pub erasures: u32,
    /// The largest release of a model that has proven itself, or was taken back.
    pub newest: u32,
    /// Bit k: key k is trusted no longer.
    pub revoked: u8,
    /// Erasures since an hour of running without one was over.
    pub this_hour: u8,
    /// The first alarm that nobody has acknowledged.
    pub alarm: Option<KeptAlarm>,
}

/// Bytes of an entry.
pub const ENTRY_LEN: usize = 32;

impl Entry {
    /// The entry as it stands in flash.
    pub fn encode(&self) -> [u8; ENTRY_LEN] {
        let KeptAlarm { sample, verdict } = self.alarm.unwrap_or_default();
        let flags = [self.revoked, self.this_hour, verdict.axis, verdict.channel];
        let [low, high] = verdict.permille.to_le_bytes();
        let [before, behind] = [sample as u32, (sample >> 32) as u32].map(u32::to_le_bytes);
        let [number, erasures, newest] =
            [self.number, self.erasures, self.newest].map(u32::to_le_bytes);
        let said = [verdict.state, verdict.cause, low, high];
        let words = [number, erasures, newest, flags, before, behind, said];
        let checksum = CRC.checksum(words.as_flattened()).to_le_bytes();
        let mut bytes = [0; ENTRY_LEN];
        let all = words.as_flattened().iter().chain(&checksum);
        for (place, &byte) in bytes.iter_mut().zip(all) {
            *place = byte;
        }
        bytes
    }

    /// Reads an entry; `None` when it was never written to its end.
    pub fn decode(bytes: &[u8; ENTRY_LEN]) -> Option<Self> {
        let (words, _) = bytes.as_chunks::<4>();
        let &[
            number,
            erasures,
            newest,
            flags,
            before,
            behind,
            said,
            checksum,
        ] = words
        else {
            return None;
        };
        let content = bytes.split_last_chunk::<4>()?.0;
        if CRC.checksum(content) != u32::from_le_bytes(checksum) {
            return None;
        }
        let [revoked, this_hour, axis, channel] = flags;
        let [state, cause, low, high] = said;
        let [before, behind] = [before, behind].map(|word| u64::from(u32::from_le_bytes(word)));
        let alarm = KeptAlarm {
            sample: before | behind << 32,
            verdict: Verdict {
                state,
                cause,
                axis,
                channel,
                permille: u16::from_le_bytes([low, high]),
            },
        };
        Some(Self {
            number: u32::from_le_bytes(number),
            erasures: u32::from_le_bytes(erasures),
            newest: u32::from_le_bytes(newest),
            revoked,
            this_hour,
            // A state of 0 is that of a joint that is not judged, which is no alarm.
            alarm: (state != 0).then_some(alarm),
        })
    }
}

/// What makes model and rig block one whole, and says whose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seal {
    /// Grows with every upload: of two good slots the one with the larger number is the newer. 0
    /// in a file.
    pub sequence: u32,
    /// What is signed: the rig block's length, release, class and digest.
    pub header: Header,
    /// Ed25519 signature of the header; `None` when nobody signed.
    pub signature: Option<[u8; SIGNATURE_LEN]>,
}

/// Why the bytes of a seal are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SealFault {
    /// The seal does not begin as one does.
    Magic,
    /// Another version of the format.
    Version(u16),
    /// The seal's own checksum does not match.
    Checksum,
    /// A length or a mark that no writer writes.
    Field,
}

impl SealFault {
    /// The fault in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Magic => "it has no seal",
            Self::Version(_) => "its seal has another version",
            Self::Checksum => "the checksum of its seal does not match",
            Self::Field => "its seal has a value that is not known",
        }
    }
}

impl Seal {
    /// The seal as it is written behind model and rig block.
    pub fn encode(&self) -> [u8; SEAL_LEN] {
        let mut bytes = [0; SEAL_LEN];
        let words = [
            u32::from_le_bytes(SEAL_MAGIC),
            u32::from(SLOT_VERSION),
            self.sequence,
            u32::from(self.signature.is_some()),
            self.header.rig_len,
            self.header.release,
        ]
        .map(u32::to_le_bytes);
        let (class, digest) = (self.header.class.bytes(), self.header.digest.bytes());
        let signature = self.signature.unwrap_or([0; SIGNATURE_LEN]);
        let parts = words.as_flattened().iter().chain(&class).chain(&digest);
        for (place, &byte) in bytes.iter_mut().zip(parts.chain(&signature)) {
            *place = byte;
        }
        let checksum = CRC.checksum(bytes.get(..SEAL_LEN - 4).unwrap_or_default());
        if let Some(place) = bytes.last_chunk_mut() {
            *place = checksum.to_le_bytes();
        }
        bytes
    }

    /// Reads a seal.
    ///
    /// # Errors
    /// [`SealFault`], in the order of its variants.
    pub fn decode(bytes: &[u8; SEAL_LEN]) -> Result<Self, SealFault> {
        let (content, checksum) = bytes.split_last_chunk::<4>().ok_or(SealFault::Field)?;
        let (words, rest) = content.split_at_checked(24).ok_or(SealFault::Field)?;
        let (words, _) = words.as_chunks::<4>();
        let &[magic, version, sequence, signed, rig_len, release] = words else {
            return Err(SealFault::Field);
        };
        if magic != SEAL_MAGIC {
            return Err(SealFault::Magic);
        }
        let version = u32::from_le_bytes(version);
        if version != u32::from(SLOT_VERSION) {
            return Err(SealFault::Version(version as u16));
        }
        if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
            return Err(SealFault::Checksum);
        }
        let (class, rest) = rest.split_first_chunk().ok_or(SealFault::Field)?;
        let (digest, rest) = rest.split_first_chunk().ok_or(SealFault::Field)?;
        let signature: &[u8; SIGNATURE_LEN] = rest.first_chunk().ok_or(SealFault::Field)?;
        let header = Header {
            rig_len: u32::from_le_bytes(rig_len),
            release: u32::from_le_bytes(release),
            class: Bytes::new(*class),
            digest: Bytes::new(*digest),
        };
        if !header.has_possible_length() {
            return Err(SealFault::Field);
        }
        Ok(Self {
            sequence: u32::from_le_bytes(sequence),
            header,
            signature: match u32::from_le_bytes(signed) {
                0 if signature.iter().all(|&byte| byte == 0) => None,
                1 => Some(*signature),
                _ => return Err(SealFault::Field),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;

    fn header() -> Header {
        Header {
            rig_len: 1024,
            release: 0x0A0B_0C0D,
            class: Bytes::new(*b"line 7\0\0\0\0\0\0\0\0\0\0"),
            digest: Bytes::new([0xD1; 32]),
        }
    }

    fn seal() -> Seal {
        Seal {
            sequence: 0x0102_0304,
            header: header(),
            signature: Some(core::array::from_fn(|place| place as u8 + 1)),
        }
    }

    #[test]
    fn every_byte_of_a_seal_is_pinned() {
        let bytes = seal().encode();
        assert_eq!(bytes[..8], *b"JWSL\x02\0\0\0");
        assert_eq!(bytes[8..16], [4, 3, 2, 1, 1, 0, 0, 0]);
        assert_eq!(bytes[16..24], [0, 4, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A]);
        assert_eq!(bytes[24..40], *b"line 7\0\0\0\0\0\0\0\0\0\0");
        assert_eq!(bytes[40..72], [0xD1; 32]);
        assert_eq!((bytes[72], bytes[135]), (1, 64));
        assert_eq!(bytes[136..], CRC.checksum(&bytes[..136]).to_le_bytes());
        assert_eq!(Seal::decode(&bytes), Ok(seal()));
        let bare = Seal {
            signature: None,
            ..seal()
        };
        assert_eq!(Seal::decode(&bare.encode()), Ok(bare));
        let signed = header().signed_bytes();
        let lengths = *b"\0\x10\0\0\0\x04\0\0\x0d\x0c\x0b\x0a";
        assert_eq!(signed[..16], *b"jointwatch slot2");
        assert_eq!(signed[16..28], lengths);
        assert_eq!(signed[28..44], bytes[24..40]);
        assert_eq!(signed[44..], [0xD1; 32]);
        assert_eq!(
            signed_order(Order::RollBack, 0x0506, b"line 7..........",),
            *b"jointwatch order\x01\0\0\0\x06\x05\0\0line 7.........."
        );
    }

    #[test]
    fn every_single_bit_flip_of_a_seal_and_of_an_entry_is_refused() {
        let good = seal().encode();
        for bit in 0..SEAL_LEN * 8 {
            let mut bytes = good;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Seal::decode(&bytes).is_err(), "bit {bit}");
        }
        let entry = Entry {
            number: 7,
            erasures: 5,
            newest: 0x0102_0304,
            revoked: 2,
            this_hour: 3,
            alarm: None,
        };
        let without = entry.encode();
        assert_eq!(
            without[..16],
            *b"\x07\0\0\0\x05\0\0\0\x04\x03\x02\x01\x02\x03\0\0"
        );
        assert_eq!(without[16..28], [0; 12]);
        assert_eq!(Entry::decode(&without), Some(entry));
        let entry = Entry {
            alarm: Some(KeptAlarm {
                sample: 0x0807_0605_0403_0201,
                verdict: Verdict {
                    state: 3,
                    cause: 51,
                    axis: 1,
                    channel: 4,
                    permille: 0x0A09,
                },
            }),
            ..entry
        };
        let good = entry.encode();
        assert_eq!(
            good[12..28],
            *b"\x02\x03\x01\x04\x01\x02\x03\x04\x05\x06\x07\x08\x03\x33\x09\x0a"
        );
        assert_eq!(Entry::decode(&good), Some(entry));
        for bit in 0..ENTRY_LEN * 8 {
            let mut bytes = good;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Entry::decode(&bytes), None, "bit {bit}");
        }
        for blank in [0, 0xFF] {
            assert_eq!(Entry::decode(&[blank; ENTRY_LEN]), None);
        }
    }

    #[test]
    fn impossible_fields_are_refused_even_with_a_right_checksum() {
        for (place, value, wanted) in [
            (4, 3, SealFault::Version(3)),
            (12, 2, SealFault::Field),
            (12, 0, SealFault::Field),
            (16, 2, SealFault::Field),
            (17, 0x11, SealFault::Field),
        ] {
            let mut bytes = seal().encode();
            bytes[place] = value;
            let checksum = CRC.checksum(&bytes[..136]).to_le_bytes();
            bytes[136..].copy_from_slice(&checksum);
            assert_eq!(Seal::decode(&bytes), Err(wanted), "byte {place}");
        }
    }

    #[test]
    fn no_two_parts_of_a_slot_overlap() {
        let mut parts = vec![
            (MODEL_OFFSET, BLOB_LEN),
            (RIG_OFFSET, RIG_ROOM),
            (SEAL_OFFSET, SEAL_LEN),
            (BEGUN_OFFSET, 4),
            (SEALED_OFFSET, 4),
            (TRIED_OFFSET, 4),
        ];
        parts.extend(VOID_OFFSETS.map(|at| (at, 4)));
        parts.extend(CONFIRMED_OFFSETS.map(|at| (at, 4)));
        parts.sort_unstable();
        for pair in parts.windows(2) {
            assert!(pair[0].0 + pair[0].1 <= pair[1].0, "{pair:?}");
            assert!(pair[1].0.is_multiple_of(4), "{pair:?}");
        }
        assert_eq!(parts.last().map(|(at, len)| at + len), Some(SLOT_LEN));
        // The marks of not being used stand on both sides of the seal.
        assert!(VOID_OFFSETS[0] < SEAL_OFFSET && VOID_OFFSETS[1] > CONFIRMED_OFFSETS[7]);
    }
}
