//! What the device does only when its owner signs for it.

use super::{Progress, SlotFault, SlotName, State, Store, Verifier, Work};
use embedded_storage::nor_flash::NorFlash;
use jointwatch_shared::wire::slot::{CLASS_LEN, Entry, Order, SIGNATURE_LEN, signed_order};
use jointwatch_shared::wire::telemetry::Answered;

impl<F: NorFlash, V: Verifier> Store<F, V> {
    /// The class of devices that this one belongs to, and zeros behind it.
    pub fn class(&self) -> [u8; CLASS_LEN] {
        self.trust.class
    }

    /// The keys that are trusted: bit 0 the first, bit 1 the second.
    pub fn trusted(&self) -> u8 {
        let keys = (0..).zip(&self.trust.keys);
        let there = keys.fold(0, |bits, (number, key)| {
            bits | u8::from(key.is_some()) << number
        });
        there & !self.revoked()
    }

    /// What the device remembers, with what the model that runs adds to it.
    ///
    /// # Errors
    /// When the flash cannot be read.
    pub fn standing(&mut self) -> Result<Entry, SlotFault> {
        let entry = self.remembered()?;
        Ok(Entry {
            newest: self.newest(&entry),
            ..entry
        })
    }

    /// Carries out what an order asks of the store, once; `Ok` when the rest of it may be done. The
    /// number of an order that was carried out is in flash before anything of it happens.
    ///
    /// # Errors
    /// What is to be answered instead.
    pub fn order(
        &mut self,
        order: Order,
        number: u32,
        signature: &[u8; SIGNATURE_LEN],
        work: &mut Work,
    ) -> Result<(), Answered> {
        let entry = self.standing().map_err(|_| Answered::Failed)?;
        if number != entry.number {
            return Err(Answered::Stale);
        }
        let message = signed_order(order, number, &self.trust.class);
        let signer = self.trust.signer(&message, signature, self.revoked());
        let signer = signer.ok_or(Answered::NotSigned)?;
        let mut after = entry;
        let mut given_up = None;
        match order {
            Order::Restart => {}
            Order::Acknowledge => after.alarm = None,
            Order::RollBack => {
                given_up = Some(self.replaceable(work).ok_or(Answered::Nothing)?);
                after.newest = after.newest.max(self.release);
            }
            Order::RevokeOther => {
                after.revoked |= self.revocable(signer).ok_or(Answered::Nothing)?;
            }
        }
        let failed = |_: SlotFault| Answered::Failed;
        self.remember_anywhere(after).map_err(failed)?;
        if let Some(place) = given_up {
            // From now on the other slot holds the only model.
            self.other_is_free = false;
            self.set_void(place).map_err(failed)?;
        }
        Ok(())
    }

    /// The slot of the model that runs, when the other one holds a model that has proven itself.
    fn replaceable(&mut self, work: &mut Work) -> Option<SlotName> {
        let active = self.active?;
        let other = self.examine(active.other(), work);
        let proven = matches!(
            other,
            State::Good {
                progress: Progress::Confirmed { .. },
                ..
            }
        );
        proven.then_some(active)
    }

    /// The bit of the other key, when there is one and the model that runs does not depend on it.
    fn revocable(&self, signer: u8) -> Option<u8> {
        let [first, second] = &self.trust.keys;
        let both = first.is_some() && second.is_some();
        let stays = self.active.is_none() || self.signer == Some(signer);
        (both && stays).then_some(1 << (1 - signer.min(1)))
    }
}
