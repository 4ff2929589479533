//! A signed model as a file: the bytes of a whole model slot, so that it can be uploaded, or put into flash by a debugger.

use super::PrivateKey;
use crate::text::error::{Error, Result};
use crate::text::input;
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::slot::{
    CONFIRMED_OFFSETS, ContentCrc, MARKED, RIG_OFFSET, RIG_ROOM, SEAL_LEN, SEAL_OFFSET,
    SEALED_OFFSET, SIGNATURE_LEN, SLOT_LEN, Seal, SealFault, TRIED_OFFSET, signed_prefix,
};
use std::path::Path;

/// A model, the rig block that belongs to it, and the signature over both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignedModel {
    /// Model blob, and behind it the rig block if there is one: what an upload sends.
    content: Vec<u8>,
    signature: Option<[u8; SIGNATURE_LEN]>,
}

impl SignedModel {
    /// Signs a blob, and the rig block that goes with it; an empty `rig` is none.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the blob is no model, or the rig block cannot be one by its length.
    pub fn sign(model: &[u8], rig: &[u8], key: &PrivateKey) -> Result<Self> {
        let mut signed = Self::unsigned(model, rig)?;
        let message = [&signed_prefix(signed.rig_len())[..], &signed.content].concat();
        signed.signature = Some(key.sign(&message));
        Ok(signed)
    }

    /// The same without a signature, for a device that was built to take it.
    ///
    /// # Errors
    /// As [`sign`](Self::sign).
    pub fn unsigned(model: &[u8], rig: &[u8]) -> Result<Self> {
        blob::decode(model).map_err(|e| Error::data(e.to_string()))?;
        if rig.len() > RIG_ROOM || !rig.len().is_multiple_of(4) {
            return Err(Error::data(format!(
                "the rig block has {} bytes, but has to have a multiple of 4 and at most {RIG_ROOM}: is it the right file?",
                rig.len()
            )));
        }
        Ok(Self {
            content: [model, rig].concat(),
            signature: None,
        })
    }

    /// Reads a file that `jointwatch sign` wrote. Whether the signature is good is for the device to say, which has the key.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] with what is wrong: not signed at all, cut, or damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path).map_err(|e| {
            Error::data(format!(
                "{}: could not be read ({e}); give the file that `jointwatch sign` wrote",
                path.display()
            ))
        })?;
        Self::from_bytes(&bytes).map_err(|what| Error::data(format!("{}: {what}", path.display())))
    }

    fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, String> {
        if bytes.len() == BLOB_LEN && blob::decode(bytes).is_ok() {
            return Err("is a model that nobody signed; sign it with `jointwatch sign`".into());
        }
        let sealed: Option<&[u8; SEAL_LEN]> = bytes
            .get(SEAL_OFFSET..)
            .and_then(<[u8]>::first_chunk)
            .filter(|_| bytes.len() == SLOT_LEN);
        let Some(sealed) = sealed else {
            return Err(format!(
                "has {} bytes, but a signed model has {SLOT_LEN}; sign the model with `jointwatch sign`",
                bytes.len()
            ));
        };
        let seal = Seal::decode(sealed).map_err(|fault| match fault {
            SealFault::Magic => {
                "is no signed model; sign the model with `jointwatch sign`".to_owned()
            }
            SealFault::Version(seen) => {
                format!("its seal has version {seen}, which this program does not know")
            }
            _ => format!("{}; sign the model again", fault.words()),
        })?;
        let end = RIG_OFFSET + seal.rig_len as usize;
        let content = bytes.get(..end).unwrap_or_default().to_vec();
        if crc(&content) != seal.content_crc {
            return Err("its bytes do not have the checksum of its seal: it is damaged, sign the model again".into());
        }
        blob::decode(content.get(..BLOB_LEN).unwrap_or_default()).map_err(|e| e.to_string())?;
        Ok(Self {
            content,
            signature: seal.signature,
        })
    }

    /// The file's bytes: a slot whose model is sealed and proven, so that a debugger can put it into flash.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.content.clone();
        bytes.resize(SLOT_LEN, 0xFF);
        let seal = Seal {
            sequence: 0,
            rig_len: self.rig_len(),
            content_crc: self.crc(),
            signature: self.signature,
        };
        let mut put = |offset: usize, part: &[u8]| {
            bytes[offset..offset + part.len()].copy_from_slice(part);
        };
        put(SEAL_OFFSET, &seal.encode());
        for offset in [SEALED_OFFSET, TRIED_OFFSET, CONFIRMED_OFFSETS[0]] {
            put(offset, &MARKED);
        }
        bytes
    }

    /// Model and rig block, in a row.
    pub fn content(&self) -> &[u8] {
        &self.content
    }

    /// CRC-32/ISO-HDLC over all bytes of [`content`](Self::content).
    pub fn crc(&self) -> u32 {
        crc(&self.content)
    }

    /// The signature, if somebody signed.
    pub fn signature(&self) -> Option<&[u8; SIGNATURE_LEN]> {
        self.signature.as_ref()
    }

    /// Bytes of the rig block.
    pub fn rig_len(&self) -> u32 {
        (self.content.len() - RIG_OFFSET) as u32
    }
}

fn crc(bytes: &[u8]) -> u32 {
    let mut crc = ContentCrc::new();
    crc.absorb(bytes);
    crc.value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ed25519_compact::{PublicKey, Signature};
    use jointwatch_shared::selftest::reference_model;

    fn signed() -> SignedModel {
        let model = blob::encode(reference_model());
        SignedModel::sign(&model, &[7; 260], &PrivateKey::development()).unwrap()
    }

    #[test]
    fn a_signed_file_comes_back_and_its_signature_is_the_documented_one() {
        let signed = signed();
        let bytes = signed.to_bytes();
        assert_eq!(bytes.len(), SLOT_LEN);
        assert_eq!(SignedModel::from_bytes(&bytes).unwrap(), signed);
        // docs/reference/slot.md: 16 bytes of purpose, two lengths, model, rig block.
        let mut message = b"jointwatch slot1\x00\x10\x00\x00\x04\x01\x00\x00".to_vec();
        message.extend(&bytes[..4096 + 260]);
        let key = PublicKey::new(PrivateKey::development().public());
        let signature = Signature::new(*signed.signature().unwrap());
        key.verify(&message, &signature).unwrap();
    }

    #[test]
    fn every_damaged_byte_of_what_is_sent_is_noticed_before_it_is_sent() {
        let bytes = signed().to_bytes();
        let sent = (0..4096 + 260).chain(SEAL_OFFSET..SEAL_OFFSET + SEAL_LEN);
        for place in sent {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x20;
            assert!(SignedModel::from_bytes(&damaged).is_err(), "byte {place}");
        }
        for length in [0, 1, 4095, 4096, SLOT_LEN - 1] {
            assert!(SignedModel::from_bytes(&bytes[..length]).is_err());
        }
    }

    #[test]
    fn what_cannot_be_signed_is_refused() {
        let model = blob::encode(reference_model());
        let key = PrivateKey::development();
        assert!(SignedModel::sign(&model[..4000], &[], &key).is_err());
        for length in [3, RIG_ROOM + 4] {
            assert!(SignedModel::sign(&model, &vec![0; length], &key).is_err());
        }
    }
}
