//! A model slot byte by byte: model, rig block, the seal that makes them one signed whole, and the marks of its life.
//!
//! A slot is a flash sector of its own. Erased flash reads ones; a word of four bytes can be programmed once, then only the
//! whole sector can be erased. Every step of a slot's life is therefore a word of its own, and the order in which the words
//! are programmed is what makes an update safe (`firmware/src/store`). `docs/reference/slot.md` lists the bytes.
//!
//! A file that `jointwatch sign` writes is the same bytes: it can be sent to the device, or put into a slot by a debugger.

use crate::wire::blob::{BLOB_LEN, CRC};

/// Where the model blob begins.
pub const MODEL_OFFSET: usize = 0;
/// Where the rig block begins.
pub const RIG_OFFSET: usize = BLOB_LEN;
/// Bytes that a rig block may have.
pub const RIG_ROOM: usize = 4096;
/// Where the seal begins.
pub const SEAL_OFFSET: usize = 8224;
/// Bytes of the seal.
pub const SEAL_LEN: usize = 96;
/// Bytes of a slot that mean something; the rest of its sector stays erased.
pub const SLOT_LEN: usize = 8448;
/// Bytes of an Ed25519 signature.
pub const SIGNATURE_LEN: usize = 64;
/// The format version of seal and marks that this program writes and reads.
pub const SLOT_VERSION: u16 = 1;
/// The seal's first four bytes.
pub const SEAL_MAGIC: [u8; 4] = *b"JWSL";

/// A word as erased flash reads it: the step has not been taken.
pub const ERASED: [u8; 4] = [0xFF; 4];
/// A programmed mark: the step has been taken. Anything between is a word that power failed on.
pub const MARKED: [u8; 4] = [0; 4];

/// The slot is not to be used. Once before the seal and once behind it, so that an erasure that power cuts short, from
/// whichever end, cannot leave a seal without at least one of them.
pub const VOID_OFFSETS: [usize; 2] = [8192, 8444];
/// The slot was erased for an upload: what stands in it without a seal is no model, however much it looks like one.
pub const BEGUN_OFFSET: usize = 8196;
/// Everything was written and verified.
pub const SEALED_OFFSET: usize = 8320;
/// The device has started with this model.
pub const TRIED_OFFSET: usize = 8324;
/// The model has run: eight words, of which one suffices. The next one is taken when power failed on the one before.
pub const CONFIRMED_OFFSETS: [usize; 8] = [8328, 8332, 8336, 8340, 8344, 8348, 8352, 8356];

/// Bytes that are signed before model and rig block.
pub const PREFIX_LEN: usize = 24;
/// What a signature is for, so that none made for another purpose fits.
const PURPOSE: [u8; 16] = *b"jointwatch slot1";

/// What makes model and rig block one whole, and says whose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seal {
    /// Grows with every upload: of two good slots the one with the larger number is the newer. 0 in a file.
    pub sequence: u32,
    /// Bytes of the rig block, a multiple of 4; 0 when there is none.
    pub rig_len: u32,
    /// CRC-32/ISO-HDLC of the model and the rig block behind it.
    pub content_crc: u32,
    /// Ed25519 signature of prefix, model and rig block; `None` when nobody signed.
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
            BLOB_LEN as u32,
            self.rig_len,
            u32::from(self.signature.is_some()),
            self.content_crc,
        ];
        let (places, rest) = bytes.as_chunks_mut::<4>();
        debug_assert!(rest.is_empty(), "a seal is made of words");
        for (place, word) in places.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        let signature = self.signature.unwrap_or([0; SIGNATURE_LEN]);
        for (place, byte) in bytes.iter_mut().skip(28).zip(signature) {
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
        let (words, _) = bytes.as_chunks::<4>();
        let &[
            magic,
            version,
            sequence,
            model_len,
            rig_len,
            signed,
            content_crc,
            ..,
        ] = words
        else {
            return Err(SealFault::Field);
        };
        if magic != SEAL_MAGIC {
            return Err(SealFault::Magic);
        }
        let version = u32::from_le_bytes(version);
        if version != u32::from(SLOT_VERSION) {
            return Err(SealFault::Version(version as u16));
        }
        let (content, checksum) = bytes.split_last_chunk::<4>().ok_or(SealFault::Field)?;
        if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
            return Err(SealFault::Checksum);
        }
        let signature = content
            .last_chunk::<SIGNATURE_LEN>()
            .ok_or(SealFault::Field)?;
        let rig_len = u32::from_le_bytes(rig_len);
        if u32::from_le_bytes(model_len) != BLOB_LEN as u32
            || rig_len > RIG_ROOM as u32
            || !rig_len.is_multiple_of(4)
        {
            return Err(SealFault::Field);
        }
        Ok(Self {
            sequence: u32::from_le_bytes(sequence),
            rig_len,
            content_crc: u32::from_le_bytes(content_crc),
            signature: match u32::from_le_bytes(signed) {
                0 if signature.iter().all(|&byte| byte == 0) => None,
                1 => Some(*signature),
                _ => return Err(SealFault::Field),
            },
        })
    }
}

/// What a signature is made over before the model and the rig block: its purpose and both lengths, so that no byte can move
/// from the one to the other.
pub fn signed_prefix(rig_len: u32) -> [u8; PREFIX_LEN] {
    let mut prefix = [0; PREFIX_LEN];
    let lengths = [(BLOB_LEN as u32).to_le_bytes(), rig_len.to_le_bytes()];
    let bytes = PURPOSE.iter().chain(lengths.as_flattened());
    for (place, &byte) in prefix.iter_mut().zip(bytes) {
        *place = byte;
    }
    prefix
}

/// The CRC-32 of content that comes in pieces.
pub struct ContentCrc(crc::Digest<'static, u32>);

impl ContentCrc {
    /// Of nothing so far.
    pub fn new() -> Self {
        Self(CRC.digest())
    }

    /// Takes the next bytes in.
    pub fn absorb(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Of all bytes taken in.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

impl Default for ContentCrc {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec;

    fn seal() -> Seal {
        Seal {
            sequence: 0x0102_0304,
            rig_len: 1024,
            content_crc: 0xAABB_CCDD,
            signature: Some(core::array::from_fn(|place| place as u8 + 1)),
        }
    }

    #[test]
    fn every_byte_of_a_seal_is_pinned() {
        let bytes = seal().encode();
        assert_eq!(bytes[..8], *b"JWSL\x01\0\0\0");
        assert_eq!(bytes[8..16], [4, 3, 2, 1, 0, 0x10, 0, 0]);
        assert_eq!(bytes[16..24], [0, 4, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[24..30], [0xDD, 0xCC, 0xBB, 0xAA, 1, 2]);
        assert_eq!(bytes[91], 64);
        assert_eq!(bytes[92..], CRC.checksum(&bytes[..92]).to_le_bytes());
        assert_eq!(Seal::decode(&bytes), Ok(seal()));
        let bare = Seal {
            signature: None,
            ..seal()
        };
        assert_eq!(Seal::decode(&bare.encode()), Ok(bare));
        assert_eq!(
            signed_prefix(258),
            *b"jointwatch slot1\0\x10\0\0\x02\x01\0\0"
        );
    }

    #[test]
    fn every_single_bit_flip_of_a_seal_is_refused() {
        let good = seal().encode();
        for bit in 0..SEAL_LEN * 8 {
            let mut bytes = good;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Seal::decode(&bytes).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn impossible_fields_are_refused_even_with_a_right_checksum() {
        for (place, value, wanted) in [
            (4, 2, SealFault::Version(2)),
            (13, 0, SealFault::Field),
            (16, 2, SealFault::Field),
            (17, 0x11, SealFault::Field),
            (20, 2, SealFault::Field),
            (20, 0, SealFault::Field),
        ] {
            let mut bytes = seal().encode();
            bytes[place] = value;
            let checksum = CRC.checksum(&bytes[..92]).to_le_bytes();
            bytes[92..].copy_from_slice(&checksum);
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
