//! Taking a new model in over the serial line, chunk by chunk, into the slot that is not in use.
//!
//! Nothing is erased before the signed header of what is to come has been verified. Nothing here
//! runs per sample. What takes long, and holds up everything on a chip that runs from the flash it
//! writes, is the erasure in `begin` (about a second); a chunk costs some microseconds for each
//! word.

use super::{SlotFault, SlotName, Store, Verifier, Work};
use embedded_storage::nor_flash::NorFlash;
use jointwatch_shared::wire::blob::BLOB_LEN;
use jointwatch_shared::wire::slot::{Header, RIG_OFFSET, RIG_ROOM};
use jointwatch_shared::wire::telemetry::{Kind, Refusal, Signature, UploadReply, UploadRequest};

/// The device's side of an upload. An upload is a model, with or without a rig block right behind
/// it.
#[derive(Debug, Default)]
pub struct Upload {
    under_way: Option<UnderWay>,
    /// What the last `Finish` was answered with, for a host that did not get it.
    ended: Option<UploadReply>,
}

#[derive(Clone, Copy, Debug)]
struct UnderWay {
    place: SlotName,
    header: Header,
    signature: Option<Signature>,
    next: u32,
}

impl UnderWay {
    const fn length(&self) -> u32 {
        RIG_OFFSET as u32 + self.header.rig_len
    }
}

impl Upload {
    /// No upload is under way.
    pub const fn new() -> Self {
        Self {
            under_way: None,
            ended: None,
        }
    }

    /// Whether an upload has begun and has not ended.
    pub const fn is_under_way(&self) -> bool {
        self.under_way.is_some()
    }

    /// Takes one step that the host asks for, and says what to answer.
    ///
    /// A step may come twice, because its answer was lost: the second time it changes nothing and
    /// has the same answer. After [`UploadReply::Activated`] the new model runs from the next
    /// restart on.
    pub fn step<F: NorFlash, V: Verifier>(
        &mut self,
        store: &mut Store<F, V>,
        request: &UploadRequest,
        work: &mut Work,
    ) -> UploadReply {
        let ended = self.ended.take();
        let outcome = match request {
            UploadRequest::Finish if self.under_way.is_none() => ended.ok_or(Refusal::NotBegun),
            UploadRequest::Begin { header, signature } => self.begin(store, header, *signature),
            UploadRequest::Chunk { offset, data } => self.chunk(store, *offset, data),
            UploadRequest::Finish => self.finish(store, work),
            UploadRequest::Abort => {
                self.under_way = None;
                Ok(UploadReply::Aborted)
            }
        };
        let reply = outcome.unwrap_or_else(|why| {
            // What begins another upload says itself when that ends the one under way: whoever may
            // not, ends none.
            let goes_on = matches!(why, Refusal::WrongOffset { .. } | Refusal::EmptyChunk)
                || matches!(request, UploadRequest::Begin { .. });
            if !goes_on {
                self.under_way = None;
            }
            UploadReply::Refused(why)
        });
        if matches!(request, UploadRequest::Finish) {
            self.ended = Some(reply);
        }
        reply
    }

    fn begin<F: NorFlash, V: Verifier>(
        &mut self,
        store: &mut Store<F, V>,
        header: &Header,
        signature: Option<Signature>,
    ) -> Result<UploadReply, Refusal> {
        match self.under_way {
            // The host begins again because an answer, or its own process, was lost: what is in
            // flash is kept.
            Some(now) if now.header == *header && now.signature == signature => {
                return Ok(UploadReply::Accepted { next: now.next });
            }
            _ => {}
        }
        if !header.has_possible_length() {
            return Err(Refusal::Length {
                seen: (BLOB_LEN as u32).saturating_add(header.rig_len),
                most: (RIG_OFFSET + RIG_ROOM) as u32,
            });
        }
        store.admit(header, signature.map(|signature| signature.bytes()))?;
        self.under_way = None;
        let place = store.free_slot().ok_or(Refusal::Busy)?;
        store.clear(place)?;
        self.under_way = Some(UnderWay {
            place,
            header: *header,
            signature,
            next: 0,
        });
        Ok(UploadReply::Accepted { next: 0 })
    }

    fn chunk<F: NorFlash, V: Verifier>(
        &mut self,
        store: &mut Store<F, V>,
        offset: u32,
        data: &[u8],
    ) -> Result<UploadReply, Refusal> {
        let now = self.under_way.as_mut().ok_or(Refusal::NotBegun)?;
        let end = offset
            .checked_add(data.len() as u32)
            .ok_or(Refusal::BeyondEnd)?;
        if end > now.length() {
            return Err(Refusal::BeyondEnd);
        }
        // Flash is written in words; the answer tells the host to begin the next chunk with what is
        // left over.
        let (words, _) = data.as_chunks::<4>();
        if words.is_empty() {
            return Err(Refusal::EmptyChunk);
        }
        if end <= now.next {
            return Ok(UploadReply::Accepted { next: now.next });
        }
        if offset != now.next {
            return Err(Refusal::WrongOffset { next: now.next });
        }
        let bytes = words.as_flattened();
        store.write(now.place, offset as usize, bytes)?;
        now.next += bytes.len() as u32;
        Ok(UploadReply::Accepted { next: now.next })
    }

    fn finish<F: NorFlash, V: Verifier>(
        &mut self,
        store: &mut Store<F, V>,
        work: &mut Work,
    ) -> Result<UploadReply, Refusal> {
        let now = self.under_way.ok_or(Refusal::NotBegun)?;
        if now.next != now.length() {
            return Err(Refusal::Incomplete { seen: now.next });
        }
        let seen = store.digest(now.place, now.header.rig_len)?;
        if seen != now.header.digest.bytes() {
            let [a, b, c, d, ..] = seen;
            return Err(Refusal::Checksum {
                seen: u32::from_be_bytes([a, b, c, d]),
            });
        }
        let signature = now.signature.map(|signature| signature.bytes());
        store.seal(now.place, &now.header, signature, work)?;
        self.under_way = None;
        Ok(UploadReply::Activated {
            kind: Kind::Model,
            slot: Some(now.place),
        })
    }
}

impl From<SlotFault> for Refusal {
    fn from(fault: SlotFault) -> Self {
        match fault {
            SlotFault::Unsigned => Self::Unsigned,
            SlotFault::Signature => Self::Signature,
            SlotFault::Class => Self::Class,
            SlotFault::Model(fault) => Self::Model(fault),
            SlotFault::Rig(fault) => Self::Rig(fault),
            SlotFault::Mismatch => Self::Mismatch,
            SlotFault::Worn => Self::Worn,
            // The content had its digest a moment ago, so the flash does not hold what was written.
            SlotFault::Flash | SlotFault::Checksum | SlotFault::Seal | SlotFault::Unfinished => {
                Self::Flash
            }
        }
    }
}
