//! One frame on the line: written into a fixed buffer, and found again in whatever bytes arrive.

use super::cobs::{self, Unstuff};
use super::{CHECKSUM, HEAD, MAX_FRAME, MAX_PAYLOAD, Message};
use core::marker::PhantomData;
use serde::Serialize;

/// A message's fields take more bytes than a frame may have. A test shows that this happens to none
/// of the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

/// The frame of a message, from its leading 0 to its closing one.
///
/// # Errors
/// [`TooLong`], which none of the messages of this crate is.
pub fn encode<'a, M: Message>(
    message: &M,
    sequence: u16,
    place: &'a mut [u8; MAX_FRAME],
) -> Result<&'a [u8], TooLong> {
    let mut payload = [0; MAX_PAYLOAD];
    let length = fill(message, sequence, &mut payload).ok_or(TooLong)?;
    let payload = payload.get(..length).ok_or(TooLong)?;
    let coded = cobs::encode(payload, place.get_mut(1..).ok_or(TooLong)?).ok_or(TooLong)?;
    let end = coded.len() + 1;
    let [first, ..] = place;
    *first = 0;
    *place.get_mut(end).ok_or(TooLong)? = 0;
    place.get(..=end).ok_or(TooLong)
}

/// Tag, sequence number, fields and CRC; gives their length.
fn fill<M: Message>(message: &M, sequence: u16, payload: &mut [u8; MAX_PAYLOAD]) -> Option<usize> {
    let [low, high] = sequence.to_le_bytes();
    let (head, rest) = payload.split_first_chunk_mut::<HEAD>()?;
    *head = [message.tag(), low, high];
    let most = rest.len() - CHECKSUM;
    let end = HEAD + message.write(rest.get_mut(..most)?)?.len();
    let (content, rest) = payload.split_at_mut_checked(end)?;
    *rest.first_chunk_mut()? = checksum(content).to_le_bytes();
    Some(end + CHECKSUM)
}

/// CRC-32/ISO-HDLC, the one that the blob has, so that the device holds one table.
fn checksum(content: &[u8]) -> u32 {
    crate::wire::blob::CRC.checksum(content)
}

/// Something that arrived between two zeros and is not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// Longer than any frame.
    TooLong,
    /// Not COBS, or too short for tag, sequence number and CRC.
    Broken,
    /// The CRC does not match.
    Checksum,
    /// Undamaged, but with a tag or with fields that this program does not know: the other end is
    /// newer.
    Unknown {
        /// The tag of the message.
        tag: u8,
    },
}

/// A message that arrived undamaged.
#[derive(Clone, Debug, PartialEq)]
pub struct Received<M> {
    /// The sender's number of it; each frame has the next one, 0 follows on 65535.
    pub sequence: u16,
    /// The message that was decoded.
    pub message: M,
}

/// What a decoder has seen; each stays at its largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// The message that was decoded.
    pub messages: u32,
    /// [`Damage::TooLong`], [`Damage::Broken`] and [`Damage::Checksum`].
    pub damaged: u32,
    /// Frames with a tag that this version does not know: [`Damage::Unknown`].
    pub unknown: u32,
}

/// Finds the frames in a stream of bytes, one byte at a time.
///
/// A 0 always ends what came before it, so that after any noise the next whole frame is found.
#[derive(Clone, Debug)]
pub struct Decoder<M> {
    payload: [u8; MAX_PAYLOAD],
    length: usize,
    unstuff: Unstuff,
    /// Bytes since the last 0, held at one more than a frame may have.
    seen: usize,
    counts: Counts,
    message: PhantomData<M>,
}

impl<M> Default for Decoder<M> {
    fn default() -> Self {
        Self {
            payload: [0; MAX_PAYLOAD],
            length: 0,
            unstuff: Unstuff::default(),
            seen: 0,
            counts: Counts::default(),
            message: PhantomData,
        }
    }
}

impl<M: Message> Decoder<M> {
    /// Takes the next byte. A 0 gives what came before it, unless nothing did.
    pub fn push(&mut self, byte: u8) -> Option<Result<Received<M>, Damage>> {
        if byte != 0 {
            self.seen = self.seen.saturating_add(1);
            if let Some(plain) = self.unstuff.take(byte)
                && let Some(slot) = self.payload.get_mut(self.length)
            {
                *slot = plain;
                self.length += 1;
            }
            return None;
        }
        let found = (self.seen > 0).then(|| self.finish());
        self.seen = 0;
        self.length = 0;
        self.unstuff = Unstuff::default();
        let count = match &found {
            None => return None,
            Some(Ok(_)) => &mut self.counts.messages,
            Some(Err(Damage::Unknown { .. })) => &mut self.counts.unknown,
            Some(Err(_)) => &mut self.counts.damaged,
        };
        *count = count.saturating_add(1);
        found
    }

    /// What was seen so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Whether bytes have come since the last 0: the stream ended in the middle of something.
    pub fn in_frame(&self) -> bool {
        self.seen > 0
    }

    fn finish(&self) -> Result<Received<M>, Damage> {
        // COBS adds one byte to a message of one block.
        if self.seen > MAX_PAYLOAD + 1 {
            return Err(Damage::TooLong);
        }
        if !self.unstuff.complete() {
            return Err(Damage::Broken);
        }
        let payload = self.payload.get(..self.length).unwrap_or_default();
        let (content, &wanted) = payload.split_last_chunk().ok_or(Damage::Broken)?;
        let (&[tag, low, high], fields) = content.split_first_chunk().ok_or(Damage::Broken)?;
        if checksum(content) != u32::from_le_bytes(wanted) {
            return Err(Damage::Checksum);
        }
        match M::read(tag, fields) {
            Some(message) => Ok(Received {
                sequence: u16::from_le_bytes([low, high]),
                message,
            }),
            None => Err(Damage::Unknown { tag }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    extern crate std;
    use std::vec::Vec;

    /// The CRC is linear: damage is overlooked exactly when the syndromes of its bits cancel.
    fn syndromes() -> Vec<u32> {
        let content = [0_u8; MAX_PAYLOAD - CHECKSUM];
        let sound = checksum(&content);
        let of_content = (0..8 * content.len()).map(|bit| {
            let mut damaged = content;
            damaged[bit / 8] ^= 1 << (bit % 8);
            checksum(&damaged) ^ sound
        });
        of_content.chain((0..32).map(|bit| 1 << bit)).collect()
    }

    #[test]
    fn every_damage_of_up_to_four_bits_changes_the_checksum() {
        let one = syndromes();
        assert_eq!(one.len(), 8 * MAX_PAYLOAD);
        let mut sums = one.clone();
        sums.push(0);
        // Sums of none, one and two bits: all different, so no two of them cancel, and with them no
        // one to four bits.
        let pairs = one
            .iter()
            .enumerate()
            .flat_map(|(number, first)| one[..number].iter().map(move |second| first ^ second));
        sums.extend(pairs);
        let all = sums.len();
        sums.sort_unstable();
        sums.dedup();
        assert_eq!(sums.len(), all);
    }
}
