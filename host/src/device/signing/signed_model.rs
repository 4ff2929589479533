//! A signed model as a file: the bytes of a whole model slot, so that it can be uploaded, or put
//! into flash by a debugger.

use super::PrivateKey;
use crate::text::error::{Error, Result};
use crate::text::input;
use ed25519_compact::sha512::Hash;
use jointwatch_shared::base::Model;
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{
    CLASS_LEN, CONFIRMED_OFFSETS, DIGEST_LEN, Header, MARKED, RIG_OFFSET, RIG_ROOM, SEAL_LEN,
    SEAL_OFFSET, SEALED_OFFSET, SIGNATURE_LEN, SLOT_LEN, Seal, SealFault, TRIED_OFFSET,
};
use std::path::Path;

/// What is signed beside model and rig block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Grows from one signed model to the next; a device takes none that is not newer than what
    /// has proven itself on it.
    pub release: u32,
    /// The name of the class of devices that it is for, and zeros behind it.
    pub class: [u8; CLASS_LEN],
}

impl Default for Stamp {
    /// The first release, for firmware that was built without a class.
    fn default() -> Self {
        Self {
            release: 1,
            class: [0; CLASS_LEN],
        }
    }
}

/// A model, the rig block that belongs to it, and the signature over both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignedModel {
    /// Model blob, and behind it the rig block if there is one: what an upload sends.
    content: Vec<u8>,
    header: Header,
    signature: Option<[u8; SIGNATURE_LEN]>,
}

impl SignedModel {
    /// Signs a blob, and the rig block that goes with it; an empty `rig` is none.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the blob is no model, or the rig block cannot be one
    /// by its length.
    pub fn sign(model: &[u8], rig: &[u8], key: &PrivateKey, stamp: &Stamp) -> Result<Self> {
        let mut signed = Self::unsigned(model, rig, stamp)?;
        signed.signature = Some(key.sign(&signed.header.signed_bytes()));
        Ok(signed)
    }

    /// The same without a signature, for a device that was built to take it.
    ///
    /// # Errors
    /// As [`sign`](Self::sign).
    pub fn unsigned(model: &[u8], rig: &[u8], stamp: &Stamp) -> Result<Self> {
        blob::decode(model).map_err(|e| Error::data(e.to_string()))?;
        if rig.len() > RIG_ROOM || !rig.len().is_multiple_of(4) {
            return Err(Error::data(format!(
                "the rig block has {} bytes, but has to have a multiple of 4 and at most {RIG_ROOM}: is it the right file?",
                rig.len()
            )));
        }
        let content = [model, rig].concat();
        Ok(Self {
            header: Header {
                rig_len: rig.len() as u32,
                release: stamp.release,
                class: Bytes::new(stamp.class),
                digest: Bytes::new(content_digest(&content)),
            },
            content,
            signature: None,
        })
    }

    /// Reads a file that `jointwatch sign` wrote. Whether the signature is good is for the device
    /// to say, which has the key.
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
        let end = RIG_OFFSET + seal.header.rig_len as usize;
        let content = bytes.get(..end).unwrap_or_default().to_vec();
        if content_digest(&content) != seal.header.digest.bytes() {
            return Err("its bytes do not have the checksum of its seal: it is damaged, sign the model again".into());
        }
        blob::decode(content.get(..BLOB_LEN).unwrap_or_default()).map_err(|e| e.to_string())?;
        Ok(Self {
            content,
            header: seal.header,
            signature: seal.signature,
        })
    }

    /// The file's bytes: a slot whose model is sealed and proven, so that a debugger can put it
    /// into flash.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.content.clone();
        bytes.resize(SLOT_LEN, 0xFF);
        let seal = Seal {
            sequence: 0,
            header: self.header,
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

    /// What is signed: the rig block's length, release, class, and the digest of model and rig
    /// block.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The signature, if somebody signed.
    pub fn signature(&self) -> Option<&[u8; SIGNATURE_LEN]> {
        self.signature.as_ref()
    }

    /// The model alone.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]; none for what [`read`](Self::read) gave.
    pub fn model(&self) -> Result<Model> {
        let bytes = self.content.get(..BLOB_LEN).unwrap_or_default();
        blob::decode(bytes).map_err(|e| Error::data(e.to_string()))
    }

    /// The name of the class of devices that it is for; empty for firmware without one.
    pub fn class(&self) -> String {
        let bytes = self.header.class.bytes();
        String::from_utf8_lossy(&bytes)
            .trim_end_matches('\0')
            .to_owned()
    }

    /// Bytes of the rig block.
    pub fn rig_len(&self) -> u32 {
        self.header.rig_len
    }
}

/// The digest of model and rig block: the first bytes of their SHA-512.
pub fn content_digest(bytes: &[u8]) -> [u8; DIGEST_LEN] {
    Hash::hash(bytes).first_chunk().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ed25519_compact::{PublicKey, Signature};
    use jointwatch_shared::selftest::reference_model;

    fn signed() -> SignedModel {
        let model = blob::encode(reference_model());
        let stamp = Stamp {
            release: 7,
            class: *b"line 7\0\0\0\0\0\0\0\0\0\0",
        };
        SignedModel::sign(&model, &[7; 260], &PrivateKey::development(), &stamp).unwrap()
    }

    #[test]
    fn a_signed_file_comes_back_and_its_signature_is_the_documented_one() {
        let signed = signed();
        let bytes = signed.to_bytes();
        assert_eq!(bytes.len(), SLOT_LEN);
        assert_eq!(SignedModel::from_bytes(&bytes).unwrap(), signed);
        // docs/reference/slot.md: 16 bytes of purpose, two lengths, release, class, digest.
        let mut message = b"jointwatch slot2\x00\x10\x00\x00\x04\x01\x00\x00\x07\0\0\0".to_vec();
        message.extend(b"line 7\0\0\0\0\0\0\0\0\0\0");
        message.extend(&Hash::hash(&bytes[..4096 + 260])[..32]);
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
        assert!(SignedModel::sign(&model[..4000], &[], &key, &Stamp::default()).is_err());
        for length in [3, RIG_ROOM + 4] {
            assert!(SignedModel::sign(&model, &vec![0; length], &key, &Stamp::default()).is_err());
        }
    }
}
