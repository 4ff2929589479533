//! What a slot holds, from all of its bytes: signature, class, digest, and the model's own checks.

use super::verify::ContentDigest;
use super::{Progress, SlotFault, SlotName, State, Store, Verifier, Work};
use crate::pair::{self, Unfit};
use embedded_storage::nor_flash::NorFlash;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::slot::{
    BEGUN_OFFSET, CONFIRMED_OFFSETS, DIGEST_LEN, ERASED, Header, MARKED, MODEL_OFFSET, RIG_OFFSET,
    SEAL_LEN, SEAL_OFFSET, SEALED_OFFSET, SIGNATURE_LEN, Seal, SealFault, TRIED_OFFSET,
    VOID_OFFSETS,
};
use jointwatch_shared::wire::telemetry::ModelFault;

impl<F: NorFlash, V: Verifier> Store<F, V> {
    /// What a slot holds, from all of its bytes.
    pub(super) fn examine(&mut self, place: SlotName, work: &mut Work) -> State {
        self.look(place, work).unwrap_or_else(State::Refused)
    }

    fn look(&mut self, place: SlotName, work: &mut Work) -> Result<State, SlotFault> {
        let mut seal = [0; SEAL_LEN];
        self.read(place, SEAL_OFFSET, &mut seal)?;
        let mut marks = [ERASED; 5 + CONFIRMED_OFFSETS.len()];
        let offsets = [&BEGUN_OFFSET]
            .into_iter()
            .chain(&VOID_OFFSETS)
            .chain([&SEALED_OFFSET, &TRIED_OFFSET])
            .chain(&CONFIRMED_OFFSETS);
        for (mark, &offset) in marks.iter_mut().zip(offsets) {
            self.read(place, offset, mark)?;
        }
        let [
            begun,
            void_before,
            void_behind,
            sealed,
            tried,
            confirmed @ ..,
        ] = marks;
        // An emulator's flash may begin as zeros instead of ones; every mark then seems to be set,
        // and none means anything.
        if seal == [0; SEAL_LEN] || (seal == [0xFF; SEAL_LEN] && begun == ERASED) {
            return self.look_at_bare(place, work);
        }
        if void_before != ERASED || void_behind != ERASED {
            return Ok(State::Void);
        }
        let confirmed_at_all = confirmed.iter().any(|&word| word != ERASED);
        if sealed == ERASED && tried == ERASED && !confirmed_at_all {
            return Err(SlotFault::Unfinished);
        }
        let seal = Seal::decode(&seal).map_err(|_: SealFault| SlotFault::Seal)?;
        let signer = self.check(place, &seal, work)?;
        Ok(State::Good {
            sequence: seal.sequence,
            rig_len: seal.header.rig_len,
            release: seal.header.release,
            signer,
            progress: if confirmed_at_all {
                Progress::Confirmed {
                    sure: confirmed.contains(&MARKED),
                }
            } else if tried != ERASED {
                Progress::Tried
            } else {
                Progress::Untried
            },
        })
    }

    /// A slot without a seal: empty, or a bare blob that a debugger put there.
    fn look_at_bare(&mut self, place: SlotName, work: &mut Work) -> Result<State, SlotFault> {
        self.read(place, MODEL_OFFSET, work)?;
        if is_blank(work) {
            return Ok(State::Empty);
        }
        self.check_model(place, work)?;
        if !self.trust.unsigned {
            return Err(SlotFault::Unsigned);
        }
        Ok(State::Good {
            sequence: 0,
            rig_len: 0,
            release: 0,
            signer: None,
            progress: Progress::Confirmed { sure: true },
        })
    }

    /// Holds content against its seal: signature, class, digest, and the model's own checks, in
    /// this order. Gives the key that signed.
    fn check(
        &mut self,
        place: SlotName,
        seal: &Seal,
        work: &mut Work,
    ) -> Result<Option<u8>, SlotFault> {
        let signer = self.check_header(&seal.header, seal.signature.as_ref())?;
        if self.digest(place, seal.header.rig_len)? != seal.header.digest.bytes() {
            return Err(SlotFault::Checksum);
        }
        self.check_model(place, work)?;
        Ok(signer)
    }

    /// Who signed a header, and whether it is for this class of devices.
    pub(super) fn check_header(
        &self,
        header: &Header,
        signature: Option<&[u8; SIGNATURE_LEN]>,
    ) -> Result<Option<u8>, SlotFault> {
        let signer = match signature {
            Some(signature) => {
                let message = header.signed_bytes();
                let signer = self.trust.signer(&message, signature, self.revoked());
                Some(signer.ok_or(SlotFault::Signature)?)
            }
            None if self.trust.unsigned => None,
            None => return Err(SlotFault::Unsigned),
        };
        if header.class.bytes() == self.trust.class {
            Ok(signer)
        } else {
            Err(SlotFault::Class)
        }
    }

    /// The digest of model and rig block. Not inlined: what it needs on the stack is free again
    /// when the model is looked at.
    #[inline(never)]
    pub(super) fn digest(
        &mut self,
        place: SlotName,
        rig_len: u32,
    ) -> Result<[u8; DIGEST_LEN], SlotFault> {
        let mut digest = ContentDigest::new();
        let end = RIG_OFFSET as u32 + rig_len;
        let mut piece = [0; 64];
        let mut at = 0;
        while at < end {
            let length = (end - at).min(piece.len() as u32);
            let Some(piece) = piece.get_mut(..length as usize) else {
                break;
            };
            self.read(place, at as usize, piece)?;
            digest.absorb(piece);
            at += length;
        }
        Ok(digest.value())
    }

    /// The model's own checks. Not inlined, as above.
    #[inline(never)]
    pub(super) fn check_model(
        &mut self,
        place: SlotName,
        work: &mut Work,
    ) -> Result<(), SlotFault> {
        self.read(place, MODEL_OFFSET, work)?;
        match blob::decode(work) {
            Ok(_) => Ok(()),
            Err(why) => Err(SlotFault::Model(ModelFault::from(&why))),
        }
    }

    /// Whether the rig block behind a model can go with it. Not inlined, as above.
    #[inline(never)]
    pub(super) fn check_pair(
        &mut self,
        place: SlotName,
        rig_len: u32,
        work: &mut Work,
    ) -> Result<(), SlotFault> {
        if rig_len == 0 {
            return Ok(());
        }
        self.read(place, MODEL_OFFSET, work)?;
        let checksum = blob::checksum(work);
        let bytes = work
            .get_mut(..rig_len as usize)
            .ok_or(SlotFault::Rig(ModelFault::Length))?;
        self.read(place, RIG_OFFSET, bytes)?;
        pair::check(bytes, checksum).map_err(|why| match why {
            Unfit::Refused(why) => SlotFault::Rig(pair::fault(&why)),
            Unfit::Mismatch => SlotFault::Mismatch,
        })
    }
}

/// All ones or all zeros.
fn is_blank(bytes: &[u8]) -> bool {
    let all = |level: u8| bytes.iter().all(|&byte| byte == level);
    all(0xFF) || all(0)
}
