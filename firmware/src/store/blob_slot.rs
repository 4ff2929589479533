//! A bare model blob in a slot, as a debugger puts it there: what it is, and which of two is used.
//! For the self-test.

use jointwatch_shared::base::Model;
use jointwatch_shared::fault::Error;
use jointwatch_shared::wire::blob;

/// One of the two places in flash that can hold a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotName {
    /// Slot A, which is looked at first.
    A,
    /// Slot B, which is used when A has no usable model.
    B,
}

impl SlotName {
    /// Both, in the order in which they are looked at.
    pub const ALL: [SlotName; 2] = [SlotName::A, SlotName::B];

    /// `a` or `b`, as logs and the self-test's text have it.
    pub fn name(self) -> &'static str {
        match self {
            SlotName::A => "a",
            SlotName::B => "b",
        }
    }

    /// The slot that this one is not.
    pub fn other(self) -> SlotName {
        match self {
            SlotName::A => SlotName::B,
            SlotName::B => SlotName::A,
        }
    }
}

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

/// Reads the slots (A, then B), tells `report` what each holds, and gives the model of the first
/// that holds one.
pub fn choose(
    slots: &[&[u8]],
    mut report: impl FnMut(SlotName, &Slot),
) -> Option<(SlotName, Model)> {
    let mut chosen = None;
    for (place, bytes) in SlotName::ALL.into_iter().zip(slots) {
        let slot = Slot::read(bytes);
        report(place, &slot);
        if let (None, Slot::Model(model)) = (&chosen, slot) {
            chosen = Some((place, model));
        }
    }
    chosen
}

/// Why a slot is refused, in a fixed phrase.
///
/// The error's own sentence has numbers in it. Formatting a floating-point number needs kilobytes
/// of code with panic paths, which the flashed image is not to have; the self-test and the host
/// print the whole sentence.
pub fn phrase(why: &Error) -> &'static str {
    match why {
        Error::BlobLength { .. } => "it has another length than a model blob",
        Error::BlobMagic { .. } => "it does not begin like a model blob",
        Error::BlobVersion { .. } => "its format has another version",
        Error::BlobChecksum { .. } => "its checksum does not match",
        Error::BlobField { field, .. } => field,
        Error::BlobReserved { .. } => "a byte that has to be zero is not",
        Error::Name { fault, .. } => fault,
        Error::OutOfRange { quantity, .. } => quantity,
        Error::Overflow { .. } => "its coefficients could overflow a sum",
        Error::WeightOverflow { .. } => "its weights could overflow a sum",
        Error::Weight { .. } => "a weight stands where it has no axis",
        Error::Coefficient { .. } => "a coefficient stands where its orders have none",
        _ => "it is not a model that this program can use",
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
    fn slot_b_steps_in_when_a_is_damaged_or_empty() {
        let good = blob_of_reference();
        let mut damaged = good;
        damaged[100] ^= 4;
        for first in [&damaged, &ERASED] {
            let mut seen = 0;
            let chosen = choose(&[first, &good], |_, _| seen += 1);
            assert_eq!(chosen, Some((SlotName::B, reference_model().clone())));
            assert_eq!(seen, 2, "both slots are reported");
        }
    }

    #[test]
    fn slot_a_wins_over_b_and_nothing_comes_of_two_bad_slots() {
        let good = blob_of_reference();
        let chosen = choose(&[&good, &good], |_, _| ());
        assert_eq!(chosen.map(|(place, _)| place), Some(SlotName::A));
        assert_eq!(choose(&[&ERASED, &good[..99]], |_, _| ()), None);
    }

    #[test]
    fn a_flipped_bit_is_told_from_another_file() {
        let mut bytes = blob_of_reference();
        bytes[2000] ^= 1;
        let Slot::Refused(why) = Slot::read(&bytes) else {
            panic!("a damaged blob was taken")
        };
        assert_eq!(phrase(&why), "its checksum does not match");
        let Slot::Refused(why) = Slot::read(&[b'#'; blob::BLOB_LEN]) else {
            panic!("a file of # was taken")
        };
        assert_eq!(phrase(&why), "it does not begin like a model blob");
    }
}
