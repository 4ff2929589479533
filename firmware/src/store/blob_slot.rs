//! A bare model blob in a slot, as a debugger puts it there. For the self-test.

use jointwatch_shared::base::Model;
use jointwatch_shared::fault::Error;
use jointwatch_shared::wire::blob;

/// What a slot in flash holds.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the model on"
)]
pub enum Slot {
    /// Nothing was ever written: every byte is as erased flash reads.
    Empty,
    /// Something that is not a usable model, and why it is not.
    Refused(Error),
    /// A model that has passed every check of [`blob::decode`].
    Model(Model),
}

impl Slot {
    /// Reads a slot from the first [`blob::BLOB_LEN`] bytes of its flash.
    ///
    /// Erased flash reads 0xFF; QEMU's flash starts out as zeros. Both are an empty slot.
    pub fn read(bytes: &[u8]) -> Self {
        let all = |level: u8| bytes.iter().all(|&byte| byte == level);
        if all(0xFF) || all(0x00) {
            return Slot::Empty;
        }
        match blob::decode(bytes) {
            Ok(model) => Slot::Model(model),
            Err(why) => Slot::Refused(why),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::selftest::reference_model;

    const ERASED: [u8; blob::BLOB_LEN] = [0xFF; blob::BLOB_LEN];

    fn blob_of_reference() -> [u8; blob::BLOB_LEN] {
        blob::encode(reference_model())
    }

    #[test]
    fn erased_flash_is_empty_and_not_refused() {
        assert_eq!(Slot::read(&ERASED), Slot::Empty);
        assert_eq!(Slot::read(&[0; blob::BLOB_LEN]), Slot::Empty);
    }

    #[test]
    fn one_written_byte_is_refused_and_not_empty() {
        let mut bytes = ERASED;
        bytes[blob::BLOB_LEN - 1] = 0xFE;
        assert!(matches!(Slot::read(&bytes), Slot::Refused(_)));
    }

    #[test]
    fn a_flipped_bit_is_told_from_another_file() {
        let mut bytes = blob_of_reference();
        bytes[2000] ^= 1;
        let Slot::Refused(why) = Slot::read(&bytes) else {
            panic!("a damaged blob was taken")
        };
        assert!(matches!(why, Error::BlobChecksum { .. }));
        let Slot::Refused(why) = Slot::read(&[b'#'; blob::BLOB_LEN]) else {
            panic!("a file of # was taken")
        };
        assert!(matches!(why, Error::BlobMagic { .. }));
    }
}
