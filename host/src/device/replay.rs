//! The device's integer code run on a logged record: from raw counts to the residual, with the
//! device's own bits.

use crate::device::followed::Followed;
use crate::device::plain_rig;
use crate::device::wired::Wired;
use crate::fit::errors::Sums;
use crate::model::corrections::Corrections;
use crate::signal;
use crate::signal::motion::{self, Filters, Motion, low_pass};
use crate::study::series::peak;
use crate::study::{Channels, Record, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::corrections::ForceCorrection;
use jointwatch_shared::chain::{Chain, ChainState, Output, RawAxis, RawSample};
use jointwatch_shared::monitor::Faults;
use jointwatch_shared::selftest::Digest;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::{Rig, RigAxis};
use serde::Serialize;
use std::collections::BTreeMap;

/// What the chain said of one axis of one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisReplay {
    /// 100·Σ(r−r̂)²/(N·var r) in the common band over rows inside the training range, percent.
    pub nmse_percent: f64,
    /// RMS(r−r̂)/RMS(r) over the same rows.
    pub relative_error: f64,
    /// Largest |r−r̂| in the common band over the same rows, N or N·m.
    pub peak_error: f64,
    /// RMS of the measured force in the common band, N or N·m.
    pub rms_force: f64,
    /// Outputs in which a force ran into a rail of its 32 bits.
    pub saturated: usize,
}

/// What the chain said of one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordReplay {
    /// The record's file, as study.toml names it.
    pub file: String,
    /// Outputs of the chain: the rows less those that fill its filters.
    pub outputs: usize,
    /// Part of the outputs with a state outside the training range, where the device holds the
    /// state at its edge.
    pub outside_range: f64,
    /// FNV-1a digest of every output's bits, hexadecimal: two devices that agree on it agreed on
    /// every bit.
    pub digest: String,
    /// Figures by axis name.
    pub axes: BTreeMap<String, AxisReplay>,
}

/// The rig with what the model knows to be wrong with its force channels put right.
pub fn corrected(rig: &Rig, corrections: &[ForceCorrection; 2]) -> Rig {
    let mut rig = rig.clone();
    for (axis, correction) in rig.axes.iter_mut().zip(corrections) {
        axis.force_step *= 1.0 - correction.excess;
        axis.force_cross = correction.cross;
        axis.force_delay_samples = correction.delay_s * rig.sample_rate_hz;
        axis.hum = correction.hum;
    }
    rig
}

/// A record as the sensors would have counted it; `rig` is what their converters are set to, not
/// what is put right afterwards.
fn raw_counts(record: &Record, followed: &Followed, rig: &Rig) -> Vec<RawSample> {
    (0..record.rows)
        .map(|row| {
            let mut sample = RawSample::default();
            let axes = sample.iter_mut().zip(&record.axes).zip(&rig.axes);
            for (index, ((raw, channels), axis)) in axes.enumerate() {
                *raw = raw_axis(channels, axis, row);
                raw.input = followed.count(index, record, axis, row);
            }
            sample
        })
        .collect()
}

fn raw_axis(channels: &Channels, axis: &RigAxis, row: usize) -> RawAxis {
    // `as` saturates, as a converter does.
    let count = |series: Option<&Vec<f64>>, step: f64| {
        series
            .filter(|_| step > 0.0)
            .map_or(0, |values| (values[row] / step).round() as i32)
    };
    RawAxis {
        displacement: [
            count(Some(&channels.displacement_first), axis.displacement_step),
            count(
                channels.displacement_second.as_ref(),
                axis.displacement_step,
            ),
        ],
        body: count(channels.body_position.as_ref(), axis.body_step),
        acceleration: count(channels.acceleration.as_ref(), axis.acceleration_step),
        force: count(Some(&channels.force), axis.force_step),
        input: 0,
    }
}

/// One instant of a record on the device.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// The counts.
    pub raw: RawSample,
    /// What is wrong with the channels.
    pub faults: Faults,
    /// What the chain says, once its filters are full.
    pub output: Option<Output>,
}

/// A record after the chain.
pub struct Replayed {
    /// Errors per axis and what the chain saw.
    pub summary: RecordReplay,
    /// Every output, in order; the first belongs to row [`Replayed::first_row`].
    pub outputs: Vec<Output>,
    /// The record's row that the first output describes.
    pub first_row: usize,
}

/// The sensors that a record is read through.
enum Sensors {
    /// Channel by channel, converters set to what the study's records reach.
    Plain { converters: Rig, followed: Followed },
    /// Those of a rig block.
    Wired(Wired),
}

/// The device as it would be set up for one study and one model.
pub struct SetUp {
    /// What each count means, force channels put right.
    pub rig: Rig,
    /// How a record becomes counts.
    sensors: Sensors,
    /// The integers that follow from it.
    pub chain: Chain,
    filters: Filters,
}

impl SetUp {
    /// Designs the filters for the bands that the model states, and turns the study into the
    /// device's integers.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the study's axes or sample rate are not the model's,
    /// or when a quantity cannot be held in the device's integers.
    pub fn new(study: &Study, model: &Model) -> Result<Self> {
        let filters = filters(study, model)?;
        let converters = plain_rig::rig(study, model, &filters)?;
        let rig = corrected(&converters, model.corrections());
        let chain = Chain::new(model, &rig).map_err(|e| {
            Error::data(format!(
                "{}: this rig cannot run on the device's integers ({e}); check the study's units, encoder_step, and what corrects \
                 its force channels",
                study.path.display()
            ))
        })?;
        Ok(Self {
            rig,
            sensors: Sensors::Plain {
                converters,
                followed: Followed::of(model),
            },
            chain,
            filters,
        })
    }

    /// The device with the rig block that it holds, fed with the records of a study.
    ///
    /// # Errors
    /// As [`SetUp::new`], and [`crate::text::error::Kind::Data`] when the block is for another
    /// model, and when its wiring cannot give a record.
    pub fn of_block(study: &Study, model: &Model, block: &Rig) -> Result<Self> {
        if block.model_checksum != blob::checksum_of(model) {
            return Err(Error::data(
                "the rig block is for another model, and a device would not use it; export it for this model with `export --rig`",
            ));
        }
        let filters = filters(study, model)?;
        let wired = Wired::new(study, model, &filters, block)?;
        let chain = Chain::new(model, block).map_err(|e| {
            Error::data(format!(
                "the rig block cannot run on the device's integers ({e}); export it again with `export --rig`"
            ))
        })?;
        Ok(Self {
            rig: block.clone(),
            sensors: Sensors::Wired(wired),
            chain,
            filters,
        })
    }

    /// Seconds by which an output, and its residual in the band, lag behind the sensors.
    pub fn delays_s(&self, study: &Study) -> [f64; 2] {
        [self.chain.delay(), self.chain.band_delay()]
            .map(|samples| samples as f64 / study.sample_rate_hz)
    }

    /// The counts of one record, sample by sample, and what the chain says at each of them.
    pub fn samples<'a>(
        &'a self,
        record: &Record,
        model: &'a Model,
    ) -> impl Iterator<Item = Sampled> + use<'a> {
        let mut state = ChainState::default();
        let counts = self.counts(record).into_iter();
        counts.map(move |(raw, faults)| Sampled {
            raw,
            faults,
            output: self.chain.step(&mut state, model, &raw),
        })
    }

    /// A record as the sensors would have counted it, with what was wrong with its channels.
    pub fn counts(&self, record: &Record) -> Vec<(RawSample, Faults)> {
        match &self.sensors {
            Sensors::Plain {
                converters,
                followed,
            } => {
                let counts = raw_counts(record, followed, converters).into_iter();
                counts.map(|raw| (raw, Faults::default())).collect()
            }
            Sensors::Wired(wired) => wired.counts(record),
        }
    }

    /// The wired sensors, where a rig block describes them.
    pub fn wired(&self) -> Option<&Wired> {
        match &self.sensors {
            Sensors::Plain { .. } => None,
            Sensors::Wired(wired) => Some(wired),
        }
    }

    /// The motion of a record, as the host finds it with the model's filters.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the record is shorter than the filters.
    pub(crate) fn motion(&self, study: &Study, record: &Record) -> Result<Motion> {
        motion::motion(study, 0, record, &self.filters)
    }

    /// Runs the chain over one record.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the record is shorter than the filters.
    pub fn replay(&self, study: &Study, record: &Record, model: &Model) -> Result<Replayed> {
        let chain = &self.chain;
        let corrections = Corrections {
            force: *model.corrections(),
            per_record: Vec::new(),
        };
        let record_corrected = corrections.record(record, study.sample_rate_hz);
        let motion = motion::motion(study, 0, &record_corrected, &self.filters)?;
        let outputs: Vec<Output> = self
            .samples(record, model)
            .filter_map(|s| s.output)
            .collect();
        Ok(summarise(study, &motion, record, model, chain, outputs))
    }
}

/// The filters for the bands that the model states, once study and model fit each other.
fn filters(study: &Study, model: &Model) -> Result<Filters> {
    let header = model.header();
    study.check_has_time("a device runs in time", "use compare")?;
    study.check_fits(
        "the blob",
        header.axes.iter().map(|a| (a.name.as_str(), a.kind.into())),
        header.sample_rate_hz,
    )?;
    Filters::for_bands(study.sample_rate_hz, header.band_hz, header.state_band_hz)
}

fn summarise(
    study: &Study,
    motion: &Motion,
    record: &Record,
    model: &Model,
    chain: &Chain,
    outputs: Vec<Output>,
) -> Replayed {
    let mut digest = Digest::new();
    outputs
        .iter()
        .for_each(|output| output.words().for_each(|word| digest.add(word)));
    let outside = outputs.iter().filter(|o| o.outside != 0).count();

    let skipped = chain.first_row() - motion.first_row;
    let rows = skipped..skipped + outputs.len();
    let axes = study.axes.iter().enumerate().map(|(index, axis)| {
        let unit = model.outputs()[index].force_per_lsb;
        let saturated = outputs
            .iter()
            .filter(|o| o.saturated & (1 << index) != 0)
            .count();
        // Both lose half the derivatives' length; where counters are late, the outputs begin a
        // little after the motion.
        let mut measured = motion.measured_force(
            index,
            axis.inertia
                .map_or(0.0, |_| model.header().axes[index].inertia),
            axis.inertia.is_none(),
            axis.restoring_force,
        );
        if !model.corrections()[index].hum.is_none() {
            // What stood in the channel beside the force only the device knows, that has followed
            // it.
            let places = measured[rows.clone()].iter_mut().zip(&outputs);
            places.for_each(|(force, o)| *force = f64::from(o.measured[index]) * unit);
        }
        (
            axis.name.clone(),
            figures(
                &outputs,
                index,
                unit,
                chain,
                saturated,
                &measured[skipped..],
            ),
        )
    });
    Replayed {
        summary: RecordReplay {
            file: record.file.clone(),
            outputs: outputs.len(),
            outside_range: outside as f64 / outputs.len().max(1) as f64,
            digest: format!("{:016x}", digest.value()),
            axes: axes.collect(),
        },
        outputs,
        first_row: chain.first_row(),
    }
}

/// The residual in the band against the measured force in the band, over outputs whose state was
/// inside the range.
fn figures(
    outputs: &[Output],
    axis: usize,
    unit: f64,
    chain: &Chain,
    saturated: usize,
    measured: &[f64],
) -> AxisReplay {
    let half = chain.band_delay() - chain.delay();
    let band = signal::fir::to_f64(chain.band());
    let measured = low_pass(measured, &band);
    // The low-passed residual of output n belongs to output n − half, the low-passed force at n −
    // 2·half to the same.
    let values = outputs.iter().enumerate();
    let values = values.filter_map(|(at, o)| Some((at, o.residual_band?)));
    let inside = values.filter_map(|(at, residual)| {
        let force = *measured.get(at.checked_sub(2 * half)?)?;
        let is_inside = outputs.get(at - half)?.outside == 0;
        is_inside.then_some((force, f64::from(residual[axis]) * unit))
    });
    let (force, error): (Vec<f64>, Vec<f64>) = inside.unzip();
    let sums = Sums::of(&error, &force);
    AxisReplay {
        nmse_percent: sums.nmse_percent(),
        relative_error: sums.relative_error(),
        peak_error: peak(&error),
        rms_force: sums.rms_force(),
        saturated,
    }
}
