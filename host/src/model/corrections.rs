//! What a model knows to be wrong with the instruments of its study, and the study put right.
//!
//! The effects of the instrument are found like those of the joint, but they are no part of its
//! force: they say by how much a channel or an inertia is wrong. From the moment a model holds one,
//! every record is read as the right instruments would have read it, and the prediction is held
//! against that:
//!
//! | effect | what becomes of the study |
//! |---|---|
//! | `inertia_error` | the inertia is the stated one plus Δm |
//! | `force_gain` | F·(1 − g) |
//! | `time_delay` | F read later by τ, between the samples by a cubic |
//! | `crosstalk` | F less χ times the other axis's force, after its own time and gain |
//! | `force_zero` | F less a zero, which is found in every record anew: the mean of what the model leaves of it |
//! | `force_drift` | the same with a straight line along the record in place of the zero |
//! | `mains_hum` | F less the line, whose size and phase are found in every record anew: in what the model leaves of it, so that no force that the model explains is taken for hum |

use crate::model::ModelEffect;
use crate::model::effects::{AxisEffect, is_correction};
use crate::study::Record;
use crate::text::error::{Error, Result};
use crate::text::table::{short, value_with_unit};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::axis::AxisKind;
use jointwatch_shared::base::corrections::ForceCorrection;
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::chain::interpolate::Between;
use jointwatch_shared::effect::{Entry, Subsystem};

/// Corrections of the force channels, axis by axis; that of an inertia stands in the model's axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrections {
    /// One per axis; that of an axis that is not there is none.
    pub force: [ForceCorrection; 2],
    /// What stands in a channel with a size of its own in every record;
    /// `ModelFile::corrected_record` takes it out.
    pub per_record: Vec<EffectValues>,
}

impl Corrections {
    /// What a model's effects say of its force channels.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a correction is too large to be one.
    pub fn of(effects: &[EffectValues], axes: usize) -> Result<Self> {
        let mut force = [ForceCorrection::NONE; 2];
        let (per_record, others): (Vec<&EffectValues>, Vec<&EffectValues>) =
            of_instruments(effects).partition(|term| term.entry.is_per_record());
        for term in others {
            let (Some(place), [value, ..]) = (
                force.get_mut(usize::from(term.axis)),
                term.values.as_slice(),
            ) else {
                continue;
            };
            match term.entry.about.name {
                "force_gain" => place.excess += value,
                "time_delay" => place.delay_s += value,
                "crosstalk" => place.cross += value,
                _ => {}
            }
        }
        for correction in &force {
            correction.check(axes).map_err(|e| {
                Error::data(format!(
                    "a force channel this wrong cannot be put right ({e}): check its column and its unit in study.toml"
                ))
            })?;
        }
        Ok(Self {
            force,
            per_record: per_record.into_iter().cloned().collect(),
        })
    }

    /// What a device is told of them.
    pub(crate) fn of_channels(&self) -> [ForceCorrection; 2] {
        let mut force = self.force;
        let lines = self.per_record.iter();
        for line in lines.filter(|term| term.entry.is_line()) {
            let (mut amplitude, mut frequency_hz) = (0.0, 0.0);
            for (parameter, value) in line.entry.parameters().iter().zip(&line.values) {
                match parameter.is_per_record() {
                    true => amplitude = value.abs(),
                    false => frequency_hz = *value,
                }
            }
            if let Some(channel) = force.get_mut(usize::from(line.axis)) {
                channel.hum = Hum {
                    frequency_hz,
                    amplitude,
                };
            }
        }
        force
    }

    /// Whether every force channel is right.
    pub fn is_none(&self) -> bool {
        self.force.iter().all(ForceCorrection::is_none) && self.per_record.is_empty()
    }

    /// A record with its force channels in time, of the right size and free of one another; what is
    /// another in every record stays in it.
    pub fn record(&self, record: &Record, sample_rate_hz: f64) -> Record {
        let mut record = record.clone();
        if self.force.iter().all(ForceCorrection::is_none) {
            return record;
        }
        // First every channel in time and in size, then what one hears of the other.
        for (channels, correction) in record.axes.iter_mut().zip(&self.force) {
            let late = correction.delay_s * sample_rate_hz;
            channels.force = later(&channels.force, late);
            let gain = 1.0 - correction.excess;
            channels.force.iter_mut().for_each(|f| *f *= gain);
        }
        if let [first, second] = record.axes.as_mut_slice() {
            let [of_first, of_second] = &self.force;
            for (f, g) in first.force.iter_mut().zip(&mut second.force) {
                let (alone, other) = (*f, *g);
                *f -= of_first.cross * other;
                *g -= of_second.cross * alone;
            }
        }
        record
    }
}

/// The corrections that a device applies, as the effects they came from; that of an inertia stands
/// in the model's axis.
pub fn of_device(model: &Model) -> Vec<ModelEffect> {
    let axes = &model.header().axes;
    let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
    let kinds: Vec<AxisKind> = axes.iter().map(|a| a.kind).collect();
    let mut all = Vec::new();
    for (axis, correction) in model.corrections().iter().enumerate().take(names.len()) {
        let Hum {
            frequency_hz,
            amplitude,
        } = correction.hum;
        for (effect, values) in [
            ("force_gain", &[correction.excess][..]),
            ("time_delay", &[correction.delay_s]),
            ("crosstalk", &[correction.cross]),
            ("mains_hum", &[amplitude, frequency_hz]),
        ] {
            if let Some(entry) = Entry::named(effect).filter(|_| values[0] != 0.0) {
                let bound = AxisEffect {
                    entry,
                    axis,
                    input: None,
                };
                all.push(ModelEffect::new(&bound, &names, &kinds, values, &[]));
            }
        }
    }
    all
}

/// The effects of the instruments among a model's.
fn of_instruments(effects: &[EffectValues]) -> impl Iterator<Item = &EffectValues> {
    effects
        .iter()
        .filter(|term| term.entry.subsystem == Subsystem::Sensor)
}

/// The effects of the joint among a model's: what adds up to its force.
pub fn of_the_joint(effects: &[EffectValues]) -> Vec<EffectValues> {
    let joint = effects
        .iter()
        .filter(|t| t.entry.subsystem != Subsystem::Sensor);
    joint.cloned().collect()
}

/// By how much the inertia of an axis is more than stated, kg or kg·m².
pub fn missing_inertia(effects: &[ModelEffect], axis: &str) -> f64 {
    let mine = effects
        .iter()
        .filter(|e| e.effect == "inertia_error" && e.axis.as_deref() == Some(axis));
    mine.flat_map(|e| &e.parameters).map(|p| p.value).sum()
}

/// What a model's corrections mean, one sentence each.
pub fn in_words(effects: &[ModelEffect]) -> Vec<String> {
    let corrections = effects.iter().filter(|e| is_correction(&e.effect));
    let sentence = |term: &ModelEffect| {
        let first = term.parameters.first()?;
        let axis = term.axis.as_deref().unwrap_or("both axes");
        let (value, unit) = (first.value, &first.unit);
        Some(match term.effect.as_str() {
            "inertia_error" => format!(
                "the inertia of {axis} is {} {unit} {} than the study states",
                short(value.abs()),
                if value < 0.0 { "less" } else { "more" }
            ),
            "force_gain" => format!(
                "the force channel of {axis} reads {:.3} % too {}",
                100.0 * value.abs(),
                if value < 0.0 { "little" } else { "much" }
            ),
            "time_delay" => format!(
                "the force channel of {axis} is {} {}",
                value_with_unit(value.abs(), "s"),
                if value < 0.0 { "early" } else { "late" }
            ),
            "crosstalk" if unit == "–" => format!(
                "the force channel of {axis} reads {:.3} % of the force on the other axis",
                100.0 * value
            ),
            "crosstalk" => format!(
                "the force channel of {axis} reads {} {unit} of the force on the other axis",
                short(value)
            ),
            "force_zero" => format!(
                "a constant force on {axis} differs from record to record, {} from nothing (RMS), as the zero of its channel, a preload or the \
                 place of rest may; it is found and taken out in every record anew",
                value_with_unit(value, unit)
            ),
            "force_drift" => {
                let drift = term.parameters.get(1)?;
                format!(
                    "the zero of the force channel of {axis} drifts along every record, by {} each second (RMS), which is found and taken out \
                     in every record anew",
                    value_with_unit(drift.value, unit)
                )
            }
            _ => {
                let entry = Entry::named(&term.effect).filter(|e| e.is_line())?;
                let size = entry.parameters().iter().position(|p| p.is_per_record())?;
                let size = term.parameters.get(size)?;
                let frequency = term.parameters.iter().find(|p| p.name != size.name)?;
                format!(
                    "the force channel of {axis} hums at {:.3} {} with an amplitude of {}, which is found and taken out in \
                     every record anew, and on a device as it goes",
                    frequency.value,
                    frequency.unit,
                    value_with_unit(size.value, &size.unit)
                )
            }
        })
    };
    corrections.filter_map(sentence).collect()
}

/// A channel read `samples` later; at its ends, where it has no neighbours, from its last ones.
pub(crate) fn later(channel: &[f64], samples: f64) -> Vec<f64> {
    let between = Between::at(samples);
    let last = channel.len() as i64 - 1;
    let at = |row: i64| channel[row.clamp(0, last) as usize];
    (0..channel.len() as i64)
        .map(|row| {
            let first = row + i64::from(between.whole) - 1;
            let neighbours = (first..first + 4).map(at);
            neighbours.zip(between.weights).map(|(f, w)| f * w).sum()
        })
        .collect()
}
