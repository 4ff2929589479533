//! Consistent overhead byte stuffing: bytes without a 0 in them, so that a 0 can end a frame
//! wherever noise has struck.
//!
//! Cheshire and Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Trans. Networking 7 (1999)
//! 159–172. Written out here, for frames of one block, because it is a dozen lines which so have no
//! panic path, and because decoding byte by byte needs no second buffer.

/// The longest message that fits one block.
pub(super) const BLOCK: usize = 254;

/// Codes `plain` into `place`: one byte more than `plain`, none of them 0. `None` when it is longer
/// than [`BLOCK`], or does not fit.
///
/// Each code byte tells how far the next one is, and stands for the 0 that was there in `plain`.
pub(super) fn encode<'a>(plain: &[u8], place: &'a mut [u8]) -> Option<&'a [u8]> {
    if plain.len() > BLOCK {
        return None;
    }
    let coded = place.get_mut(..plain.len() + 1)?;
    // From the end backwards, so that the distance to the next code byte is known at each.
    let mut distance = 1_u8;
    let bytes = plain.iter().rev();
    let (first, rest) = coded.split_first_mut()?;
    for (slot, &byte) in rest.iter_mut().rev().zip(bytes) {
        if byte == 0 {
            *slot = distance;
            distance = 1;
        } else {
            *slot = byte;
            distance = distance.saturating_add(1);
        }
    }
    *first = distance;
    Some(coded)
}

/// Decodes byte by byte.
#[derive(Clone, Debug, Default)]
pub(super) struct Unstuff {
    /// Bytes before the next code byte; 0 where one has to come.
    left: u8,
    /// Whether a code byte has been read.
    begun: bool,
}

impl Unstuff {
    /// The plain byte that this coded byte, which is not 0, stands for; the first stands for none.
    pub(super) fn take(&mut self, byte: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return Some(byte);
        }
        let zero = self.begun.then_some(0);
        self.begun = true;
        self.left = byte.saturating_sub(1);
        zero
    }

    /// Whether the bytes so far are a whole message.
    pub(super) fn complete(&self) -> bool {
        self.left == 0
    }
}
