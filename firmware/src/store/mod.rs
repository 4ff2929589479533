//! The two model slots in flash: which model runs, how a new one gets there, and why no loss of
//! power can spoil that.
//!
//! A new model goes into the slot that is not in use. Its life is a row of words, each programmed
//! once ([`jointwatch_shared::wire::slot`] has the places):
//!
//! 1. The signature of its header is verified. The slot is marked void, erased, and written: model,
//!    rig block, seal.
//! 2. All of it is read back and checked: digest, the model's own checks, model and rig block
//!    against each other. Then it is marked **sealed**.
//! 3. At the next restart the newer good slot is chosen. It is marked **tried** before it runs.
//! 4. When it has run long enough it is marked **confirmed**. From then on the other slot may be
//!    erased.
//! 5. When a restart finds it tried and not confirmed, it is marked void, and the old model runs
//!    again.
//!
//! A mark on which power failed may read either way, and may even change its mind. It never
//! matters: before *sealed* the old model runs whatever the new slot holds; between *sealed* and
//! *tried* both answers are right; *tried* counts as soon as one bit of it does, and means the old
//! model; a doubtful *confirmed* is confirmed once more, in the next of its words, before
//! the old slot may be erased.

mod blob_slot;
mod choice;
mod examine;
mod journal;
mod orders;
mod trial;
mod upload;
mod verify;

pub use blob_slot::Slot;
pub use choice::{Choice, Progress, SlotFault, State};
pub use jointwatch_shared::wire::telemetry::Slot as SlotName;
pub use journal::{ERASURES_PER_HOUR, ERASURES_PER_LIFE};
pub use trial::{Ended, Trial};
pub use upload::Upload;
pub use verify::{KEYS, Key, Trust, Verifier};

use embedded_storage::nor_flash::NorFlash;
use jointwatch_shared::base::Model;
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::slot::{
    BEGUN_OFFSET, CONFIRMED_OFFSETS, ERASED, Entry, Header, MARKED, MODEL_OFFSET, RIG_OFFSET,
    SEAL_LEN, SEAL_OFFSET, SEALED_OFFSET, SIGNATURE_LEN, Seal, TRIED_OFFSET, VOID_OFFSETS,
};
use jointwatch_shared::wire::telemetry::{ModelFault, Refusal};

/// Room to take a blob out of flash, for as long as a slot is looked at.
pub type Work = [u8; BLOB_LEN];

/// What a restart found.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the model on"
)]
pub struct Started {
    /// What slot A and slot B held.
    pub states: [State; 2],
    /// The model that runs, and where it lies; `None` when neither slot has one.
    pub model: Option<(SlotName, Model)>,
    /// Bytes of the rig block that belongs to it; 0 when there is none.
    pub rig_len: u32,
    /// Whether the model is on trial: it is to be [confirmed](Store::confirm) when it has run.
    pub trial: bool,
    /// The slot whose model has just failed its trial.
    pub set_aside: Option<SlotName>,
    /// Whether there is another model to go back to, should this one fail its trial.
    pub fallback: bool,
    /// Set when a mark could not be programmed; the choice stands, but will be made anew at the
    /// next restart.
    pub flash_failed: bool,
}

/// The two slots, behind one flash driver: slot A at its address 0, slot B one sector behind.
#[derive(Debug)]
pub struct Store<F, V> {
    flash: F,
    trust: Trust<V>,
    active: Option<SlotName>,
    /// The other slot may be erased.
    other_is_free: bool,
    /// The release of the model that runs, once it has proven itself.
    proven_release: Option<u32>,
    /// The release of the model that runs.
    release: u32,
    /// The key that the model that runs is signed by.
    signer: Option<u8>,
    /// The latest entry of the journals, once it was looked for.
    latest: Option<Entry>,
}

impl<F: NorFlash, V: Verifier> Store<F, V> {
    const GRANULE: () = assert!(
        4 % F::WRITE_SIZE == 0 && 4 % F::READ_SIZE == 0,
        "every mark is one word of four bytes"
    );

    /// The store on a flash of two sectors. Nothing is read before [`start`](Self::start).
    pub fn new(flash: F, trust: Trust<V>) -> Self {
        let () = Self::GRANULE;
        Self {
            flash,
            trust,
            active: None,
            other_is_free: false,
            proven_release: None,
            release: 0,
            signer: None,
            latest: None,
        }
    }

    /// The flash driver that the store writes with.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// The same, for who plays the board that it is on.
    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Gives the flash driver back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// After a restart: looks at both slots, sets a failed model aside, and takes the model that is
    /// to run.
    ///
    /// Reads all of both slots and checks up to two signatures; programs at most four words, none
    /// when nothing has changed. To be called once, before anything runs. Whatever the flash
    /// holds, this gives a model if a slot has a good one.
    pub fn start(&mut self, work: &mut Work) -> Started {
        let remembered = self.remembered();
        let mut flash_failed = remembered.is_err();
        let mut states = SlotName::ALL.map(|place| self.examine(place, work));
        let mut set_aside = None;
        // Twice at most: a slot that was good a moment ago and now is not becomes refused, and the
        // other one is taken.
        for _ in SlotName::ALL {
            let choice = choice::choose(&states);
            if let Some(place) = choice.set_aside {
                flash_failed |= self.set_void(place).is_err();
                set_aside = Some(place);
            }
            let Some(place) = choice.run else { break };
            let model = match self.model(place, work) {
                Ok(model) => model,
                Err(fault) => {
                    set(&mut states, place, State::Refused(fault));
                    continue;
                }
            };
            let State::Good {
                rig_len,
                progress,
                release,
                signer,
                ..
            } = choice::of(&states, place)
            else {
                break;
            };
            flash_failed |= match progress {
                Progress::Untried => self.mark(place, TRIED_OFFSET).is_err(),
                Progress::Confirmed { sure: false } => self.confirm_in(place).is_err(),
                _ => false,
            };
            let other = choice::of(&states, place.other());
            let fallback = matches!(other, State::Good { .. }) && choice.set_aside.is_none();
            self.active = Some(place);
            (self.release, self.signer) = (release, signer);
            self.proven_release = (!choice.trial).then_some(release);
            self.other_is_free = !(flash_failed || choice.trial && fallback);
            return Started {
                states,
                model: Some((place, model)),
                rig_len,
                trial: choice.trial,
                set_aside,
                fallback,
                flash_failed,
            };
        }
        self.active = None;
        self.other_is_free = true;
        Started {
            states,
            model: None,
            rig_len: 0,
            trial: false,
            set_aside,
            fallback: false,
            flash_failed,
        }
    }

    /// The slot whose model runs.
    pub fn active(&self) -> Option<SlotName> {
        self.active
    }

    /// Marks the model that runs as proven, so that it stays; the other slot is then free for an
    /// upload.
    ///
    /// # Errors
    /// The flash's, when the mark cannot be programmed or does not read back. The trial then goes
    /// on.
    pub fn confirm(&mut self) -> Result<(), SlotFault> {
        let Some(place) = self.active else {
            return Ok(());
        };
        self.confirm_in(place)?;
        self.proven_release = Some(self.release);
        self.other_is_free = true;
        Ok(())
    }

    /// The rig block of the model that runs, `into` filled from its beginning; `None` when it has
    /// none or the flash fails.
    pub fn rig<'a>(&mut self, rig_len: u32, into: &'a mut [u8]) -> Option<&'a [u8]> {
        let place = self.active?;
        let bytes = into
            .get_mut(..rig_len as usize)
            .filter(|bytes| !bytes.is_empty())?;
        self.read(place, RIG_OFFSET, bytes).ok()?;
        Some(bytes)
    }

    /// Whether what a header announces may be taken now: it is signed, for this device, newer than
    /// all that has proven itself, and the flash may be erased once more. Erases nothing.
    fn admit(
        &mut self,
        header: &Header,
        signature: Option<[u8; SIGNATURE_LEN]>,
    ) -> Result<(), Refusal> {
        self.check_header(header, signature.as_ref())?;
        let entry = self.remembered()?;
        let newest = self.newest(&entry);
        if header.release <= newest {
            return Err(Refusal::NotNewer { newest });
        }
        if entry.erasures >= ERASURES_PER_LIFE {
            return Err(Refusal::Worn);
        }
        if entry.this_hour >= ERASURES_PER_HOUR {
            return Err(Refusal::TooOften);
        }
        Ok(())
    }

    /// The largest release of a model that has proven itself, or was taken back.
    fn newest(&self, entry: &Entry) -> u32 {
        entry.newest.max(self.proven_release.unwrap_or(0))
    }

    /// Takes the model out of a slot.
    fn model(&mut self, place: SlotName, work: &mut Work) -> Result<Model, SlotFault> {
        self.read(place, MODEL_OFFSET, work)?;
        blob::decode(work).map_err(|why| SlotFault::Model(ModelFault::from(&why)))
    }

    /// Programs the next word that says that a slot's model has run; none when one is sure already.
    fn confirm_in(&mut self, place: SlotName) -> Result<(), SlotFault> {
        let mut word = ERASED;
        for offset in CONFIRMED_OFFSETS {
            self.read(place, offset, &mut word)?;
            if word == MARKED {
                return Ok(());
            }
            if word == ERASED {
                return self.mark(place, offset);
            }
        }
        Err(SlotFault::Flash)
    }

    /// Says that a slot is not to be used. A word that power failed on counts already and is not
    /// programmed again.
    fn set_void(&mut self, place: SlotName) -> Result<(), SlotFault> {
        let mut word = ERASED;
        for offset in VOID_OFFSETS {
            self.read(place, offset, &mut word)?;
            if word == ERASED {
                self.mark(place, offset)?;
            }
        }
        Ok(())
    }

    /// Programs one mark and reads it back.
    fn mark(&mut self, place: SlotName, offset: usize) -> Result<(), SlotFault> {
        self.write(place, offset, &MARKED)?;
        let mut seen = ERASED;
        self.read(place, offset, &mut seen)?;
        if seen == MARKED {
            Ok(())
        } else {
            Err(SlotFault::Flash)
        }
    }

    /// The slot that an upload goes into, if it may be erased now.
    fn free_slot(&self) -> Option<SlotName> {
        match self.active {
            None => Some(SlotName::A),
            Some(active) => self.other_is_free.then_some(active.other()),
        }
    }

    /// Makes a slot ready to be written: counted where it survives, void, so that nothing of it can
    /// ever run again, then erased.
    fn clear(&mut self, place: SlotName) -> Result<(), SlotFault> {
        let entry = self.remembered()?;
        self.remember(
            place.other(),
            Entry {
                erasures: entry.erasures.saturating_add(1),
                this_hour: entry.this_hour.saturating_add(1),
                newest: self.newest(&entry),
                ..entry
            },
        )?;
        self.set_void(place)?;
        let start = address::<F>(place, 0);
        self.flash
            .erase(start, start + F::ERASE_SIZE as u32)
            .map_err(|_| SlotFault::Flash)?;
        self.mark(place, BEGUN_OFFSET)
    }

    /// Writes the seal behind content that has the digest of its header, checks it, and marks it
    /// sealed.
    fn seal(
        &mut self,
        place: SlotName,
        header: &Header,
        signature: Option<[u8; SIGNATURE_LEN]>,
        work: &mut Work,
    ) -> Result<(), SlotFault> {
        self.check_model(place, work)?;
        self.check_pair(place, header.rig_len, work)?;
        let mut bytes = [0; SEAL_LEN];
        self.read(place.other(), SEAL_OFFSET, &mut bytes)?;
        let before = Seal::decode(&bytes).map_or(0, |seal| seal.sequence);
        let seal = Seal {
            // A flash wears out long before it has been erased 2³² times.
            sequence: before.checked_add(1).ok_or(SlotFault::Flash)?,
            header: *header,
            signature,
        };
        let bytes = seal.encode();
        self.write(place, SEAL_OFFSET, &bytes)?;
        let mut seen = [0; SEAL_LEN];
        self.read(place, SEAL_OFFSET, &mut seen)?;
        if seen != bytes {
            return Err(SlotFault::Flash);
        }
        self.mark(place, SEALED_OFFSET)
    }

    // Not inlined, nor is `write`: which of their callers takes them in would depend on the flash.
    #[inline(never)]
    fn read(&mut self, place: SlotName, offset: usize, into: &mut [u8]) -> Result<(), SlotFault> {
        self.flash
            .read(address::<F>(place, offset), into)
            .map_err(|_| SlotFault::Flash)
    }

    #[inline(never)]
    fn write(&mut self, place: SlotName, offset: usize, bytes: &[u8]) -> Result<(), SlotFault> {
        self.flash
            .write(address::<F>(place, offset), bytes)
            .map_err(|_| SlotFault::Flash)
    }
}

/// Where a byte of a slot lies in the flash driver's addresses.
fn address<F: NorFlash>(place: SlotName, offset: usize) -> u32 {
    let sector = match place {
        SlotName::A => 0,
        SlotName::B => F::ERASE_SIZE,
    };
    (sector + offset) as u32
}

fn set(states: &mut [State; 2], place: SlotName, state: State) {
    let [a, b] = states;
    *match place {
        SlotName::A => a,
        SlotName::B => b,
    } = state;
}
