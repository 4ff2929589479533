//! The device to be emulated: a model and a rig block in its slot, for the records of one study.

use super::bench::{Bench, REST, Run, Scenario};
use super::judge::{Judge, Known, Replayed};
use super::qemu;
use crate::device::chip_rates;
use crate::device::monitor_limits;
use crate::device::replay::SetUp;
use crate::device::rig_block;
use crate::device::signing::{PrivateKey, SignedModel, Stamp};
use crate::device::wired::Wired;
use crate::study::{Record, Study};
use crate::text::error::Result;
use jointwatch_shared::base::Model;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::telemetry::SampleOutput;
use std::path::Path;
use std::time::Duration;

/// Mean time between false alarms for which the limits of a rig block without any are set, hours:
/// 30 days.
const FALSE_ALARM_HOURS: u32 = 30 * 24;

/// A device with its model and its rig block.
pub struct EmulatedDevice<'a> {
    study: &'a Study,
    model: &'a Model,
    /// What the slot holds besides the model.
    pub block: Rig,
    /// The host's side of the same.
    pub set_up: SetUp,
}

/// A run of the emulated firmware over one record.
pub struct Emulated {
    /// What came of it.
    pub run: Run,
    /// The time it took on this computer.
    pub took: Duration,
}

impl<'a> EmulatedDevice<'a> {
    /// The device for a study; without a rig block it gets one from the study's records, with
    /// limits for its monitor where the study has validation records.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the block does not fit model and study, or has chips
    /// that are slower than the sampling.
    pub fn new(study: &'a Study, model: &'a Model, block: Option<Rig>) -> Result<Self> {
        let given = block.is_some();
        let mut block = match block {
            Some(block) => block,
            None => rig_block::of_study(study, model)?,
        };
        let set_up = SetUp::of_block(study, model, &block)?;
        if !given {
            let purpose = monitor_limits::Purpose {
                model_checksum: blob::checksum_of(model),
                false_alarm_hours: FALSE_ALARM_HOURS,
                drift: 0.0,
            };
            // A study without validation records leaves the monitor without limits: it then watches
            // the sensors only.
            let limits = monitor_limits::limits(study, &set_up, model, purpose);
            block.limits = limits.ok().map(|calibration| calibration.limits);
        }
        chip_rates::check(&block)?;
        Ok(Self {
            study,
            model,
            block,
            set_up,
        })
    }

    /// The slot's bytes: model and rig block, signed with the development key, which a firmware
    /// that is built here trusts.
    ///
    /// # Errors
    /// When the rig block cannot be written.
    pub fn slot(&self) -> Result<SignedModel> {
        let rig = rig_block::encode(&self.block)?;
        let oldest = Stamp {
            release: 0,
            ..Stamp::default()
        };
        SignedModel::sign(
            &blob::encode(self.model),
            &rig,
            &PrivateKey::development(),
            &oldest,
        )
    }

    /// The rig as it is wired.
    ///
    /// # Panics
    /// Never: [`EmulatedDevice::new`] sets it up from a rig block.
    pub(crate) fn wired(&self) -> &Wired {
        self.set_up
            .wired()
            .expect("the set-up was made from a rig block")
    }

    /// The model with the host's chain for it.
    pub fn known(&self) -> Known<'_> {
        Known {
            crc: blob::checksum_of(self.model),
            model: self.model,
            chain: &self.set_up.chain,
        }
    }

    /// Runs the image `elf` over one record. `slot` is what slot A holds; `others` are models that
    /// the device may come to run.
    ///
    /// # Errors
    /// As [`qemu::run`], and when the record is shorter than the chain's filters.
    pub fn run(
        &self,
        elf: &Path,
        slot: &[u8],
        record: &Record,
        others: &[Known<'_>],
        scenario: Scenario,
    ) -> Result<Emulated> {
        let mut bench = self.bench(record, others, scenario)?;
        let took = qemu::run(elf, slot, &mut bench)?;
        Ok(Emulated {
            run: bench.end(),
            took,
        })
    }

    /// The bench for one record.
    ///
    /// # Errors
    /// When the record is shorter than the chain's filters.
    pub fn bench<'b>(
        &'b self,
        record: &Record,
        others: &[Known<'b>],
        scenario: Scenario,
    ) -> Result<Bench<'b>> {
        let replayed = self.set_up.replay(self.study, record, self.model)?;
        let fill = 2 * self.set_up.chain.delay() as u64;
        let replayed = Replayed {
            outputs: replayed.outputs.iter().map(SampleOutput::from).collect(),
            first: REST + fill,
        };
        let known = [&[self.known()], others].concat();
        let wired = self.wired();
        let rows = wired.readings(record).collect();
        let rate = self.block.sample_rate_hz;
        let judge = Judge::new(replayed, known);
        Ok(Bench::new(wired.wiring(), rate, rows, judge, scenario))
    }
}
