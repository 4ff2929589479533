//! What the device remembers beyond the life of a model: erasures, the newest release, revoked
//! keys, carried-out orders, and the alarm that stands.
//!
//! Before a slot is erased, what is to be remembered is written into the other slot's journal. So
//! the latest entry is always in one of the two, whatever power does.

use super::{SlotFault, SlotName, Store, Verifier};
use embedded_storage::nor_flash::NorFlash;
use jointwatch_shared::wire::slot::{ENTRY_LEN, ERASED, Entry, JOURNAL_OFFSET};
use jointwatch_shared::wire::telemetry::KeptAlarm;

/// Entries of a journal that are used at most: they are all read when one is wanted.
const MAX_ENTRIES: usize = 2000;
/// Erasures in an hour of running. A model that is tried out ten times an hour is far below.
pub const ERASURES_PER_HOUR: u8 = 20;
/// Erasures in the device's life: half of what both sectors last for (DS8626, “Flash memory
/// endurance”: 10,000 cycles each).
pub const ERASURES_PER_LIFE: u32 = 10_000;

impl<F: NorFlash, V: Verifier> Store<F, V> {
    /// Entries that a slot's journal has room for.
    const ENTRIES: usize = {
        let room = F::ERASE_SIZE.saturating_sub(JOURNAL_OFFSET) / ENTRY_LEN;
        if room < MAX_ENTRIES {
            room
        } else {
            MAX_ENTRIES
        }
    };

    /// Entries of the journal of the model that runs which only erasures may take: without one no
    /// upload begins, and it is an upload that makes room.
    const FOR_ERASURES: usize = Self::ENTRIES / 2;

    /// What the device remembers.
    ///
    /// # Errors
    /// When the flash cannot be read.
    pub fn remembered(&mut self) -> Result<Entry, SlotFault> {
        if let Some(latest) = self.latest {
            return Ok(latest);
        }
        let mut latest = Entry::default();
        for place in SlotName::ALL {
            for number in 0..Self::ENTRIES {
                // Most places were never written: their first word is enough.
                let mut first = ERASED;
                self.read(place, JOURNAL_OFFSET + number * ENTRY_LEN, &mut first)?;
                if first != ERASED
                    && let Some(entry) = Entry::decode(&self.entry(place, number)?)
                    // Of two with one number power failed on the first, which may read as whole now
                    // and then.
                    && entry.number >= latest.number
                {
                    latest = entry;
                }
            }
        }
        self.latest = Some(latest);
        Ok(latest)
    }

    /// The keys that are trusted no longer.
    pub(super) fn revoked(&self) -> u8 {
        self.latest.map_or(0, |entry| entry.revoked)
    }

    fn entry(&mut self, place: SlotName, number: usize) -> Result<[u8; ENTRY_LEN], SlotFault> {
        let mut bytes = [0; ENTRY_LEN];
        self.read(place, JOURNAL_OFFSET + number * ENTRY_LEN, &mut bytes)?;
        Ok(bytes)
    }

    /// Writes an entry behind the last one of a slot's journal, under the next number.
    ///
    /// # Errors
    /// [`SlotFault::Worn`] when the journal is full, [`SlotFault::Flash`] when the entry does not
    /// read back.
    pub(super) fn remember(&mut self, place: SlotName, entry: Entry) -> Result<(), SlotFault> {
        self.remember_within(place, entry, Self::ENTRIES)
    }

    /// The same in a journal of which so many places may be used.
    fn remember_within(
        &mut self,
        place: SlotName,
        entry: Entry,
        most: usize,
    ) -> Result<(), SlotFault> {
        let number = entry.number.checked_add(1).ok_or(SlotFault::Worn)?;
        let entry = Entry { number, ..entry };
        let bytes = entry.encode();
        // Behind the last that is not blank: power may have failed on one, which then reads as
        // anything. Where the last of all is not blank, in front of that: one bad cell
        // there fills no journal.
        let mut free = None;
        for number in (0..Self::ENTRIES).rev() {
            if self.entry(place, number)? == [0xFF; ENTRY_LEN] {
                free = Some(number);
            } else if free.is_some() {
                break;
            }
        }
        let free = free.filter(|free| *free < most).ok_or(SlotFault::Worn)?;
        self.write(place, JOURNAL_OFFSET + free * ENTRY_LEN, &bytes)?;
        if self.entry(place, free)? == bytes {
            self.latest = Some(entry);
            Ok(())
        } else {
            Err(SlotFault::Flash)
        }
    }

    /// An hour of running is over: erasures are counted anew.
    ///
    /// # Errors
    /// As `remember`; the next hour is then waited for.
    pub fn an_hour_is_over(&mut self) -> Result<(), SlotFault> {
        let entry = self.remembered()?;
        if entry.this_hour == 0 {
            return Ok(());
        }
        self.remember_anywhere(Entry {
            this_hour: 0,
            ..entry
        })
    }

    /// Keeps an alarm over a restart, until it is acknowledged; of several the first. So each
    /// acknowledgement, which its owner signs, lets one entry be written.
    ///
    /// # Errors
    /// As `remember`.
    pub fn keep_alarm(&mut self, alarm: KeptAlarm) -> Result<(), SlotFault> {
        let entry = self.remembered()?;
        if entry.alarm.is_some() {
            return Ok(());
        }
        self.remember_anywhere(Entry {
            alarm: Some(alarm),
            ..entry
        })
    }

    /// Writes an entry that no erasure follows on: into the journal of the slot that is erased
    /// next, if there is room.
    pub(super) fn remember_anywhere(&mut self, entry: Entry) -> Result<(), SlotFault> {
        let active = self.active.unwrap_or(SlotName::B);
        self.remember(active.other(), entry)
            .or_else(|_| self.remember_within(active, entry, Self::ENTRIES - Self::FOR_ERASURES))
    }
}
