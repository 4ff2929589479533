//! What a model knows to be wrong with the instruments of its study, and the study put right.
//!
//! The effects of the instrument are found like those of the joint, but they are no part of its force: they say by how much a
//! channel or an inertia is wrong. From the moment a model holds one, every record is read as the right instruments would
//! have read it, and the prediction is held against that:
//!
//! | effect | what becomes of the study |
//! |---|---|
//! | `inertia_error` | the inertia is the stated one plus Δm |
//! | `force_gain` | F·(1 − g) |
//! | `time_delay` | F read later by τ, between the samples by a cubic |
//! | `crosstalk` | F less χ times the other axis's force, after its own time and gain |

use crate::error::{Error, Result};
use crate::model::EffectTerm;
use crate::study::{Record, Study};
use jointwatch_shared::effect::{Entry, Seat};
use jointwatch_shared::interpolate::Between;
use jointwatch_shared::model::corrections::ForceCorrection;
use jointwatch_shared::model::terms::InSi;

/// Corrections of the force channels, axis by axis; that of an inertia stands in the model's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrections {
    /// One per axis; that of an axis that is not there is none.
    pub force: [ForceCorrection; 2],
}

impl Corrections {
    /// What a model's effects say of its force channels.
    ///
    /// # Errors
    /// [`crate::error::Kind::Data`] when a correction is too large to be one.
    pub fn of(effects: &[InSi], axes: usize) -> Result<Self> {
        let mut force = [ForceCorrection::NONE; 2];
        for term in of_instruments(effects) {
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
        Ok(Self { force })
    }

    /// Whether every force channel is right.
    pub fn is_none(&self) -> bool {
        self.force.iter().all(ForceCorrection::is_none)
    }

    /// The study as the right instruments would have logged it; its inertias stay as they are stated.
    pub fn study(&self, study: &Study) -> Study {
        let records = study.records.iter();
        Study {
            records: records
                .map(|record| self.record(record, study.sample_rate_hz))
                .collect(),
            ..study.clone()
        }
    }

    /// One record of it.
    pub fn record(&self, record: &Record, sample_rate_hz: f64) -> Record {
        let mut record = record.clone();
        if self.is_none() {
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

/// The effects of the instruments among a model's.
fn of_instruments(effects: &[InSi]) -> impl Iterator<Item = &InSi> {
    effects
        .iter()
        .filter(|term| term.entry.seat == Seat::Instrument)
}

/// The effects of the joint among a model's: what adds up to its force.
pub fn of_the_joint(effects: &[InSi]) -> Vec<InSi> {
    let joint = effects.iter().filter(|t| t.entry.seat != Seat::Instrument);
    joint.cloned().collect()
}

/// By how much the inertia of an axis is more than stated, kg or kg·m².
pub fn missing_inertia(effects: &[EffectTerm], axis: &str) -> f64 {
    let mine = effects
        .iter()
        .filter(|e| e.effect == "inertia_error" && e.axis.as_deref() == Some(axis));
    mine.flat_map(|e| &e.parameters).map(|p| p.value).sum()
}

/// Whether an effect of this name corrects an instrument.
pub fn is_correction(effect: &str) -> bool {
    Entry::named(effect).is_some_and(|entry| entry.seat == Seat::Instrument)
}

/// What a model's corrections mean, one sentence each.
pub fn in_words(effects: &[EffectTerm]) -> Vec<String> {
    let corrections = effects.iter().filter(|e| is_correction(&e.effect));
    let sentence = |term: &EffectTerm| {
        let first = term.parameters.first()?;
        let axis = term.axis.as_deref().unwrap_or("both axes");
        let (value, unit) = (first.value, &first.unit);
        Some(match term.effect.as_str() {
            "inertia_error" => format!(
                "the inertia of {axis} is {:.4e} {unit} {} than the study states",
                value.abs(),
                if value < 0.0 { "less" } else { "more" }
            ),
            "force_gain" => format!(
                "the force channel of {axis} reads {:.3} % too {}",
                100.0 * value.abs(),
                if value < 0.0 { "little" } else { "much" }
            ),
            "time_delay" => format!(
                "the force channel of {axis} is {:.3} ms {}",
                1e3 * value.abs(),
                if value < 0.0 { "early" } else { "late" }
            ),
            "crosstalk" if unit == "–" => format!(
                "the force channel of {axis} reads {:.3} % of the force on the other axis",
                100.0 * value
            ),
            "crosstalk" => format!(
                "the force channel of {axis} reads {value:.3e} {unit} of the force on the other axis"
            ),
            _ => return None,
        })
    };
    corrections.filter_map(sentence).collect()
}

/// A channel read `samples` later; at its ends, where it has no neighbours, from its last ones.
fn later(channel: &[f64], samples: f64) -> Vec<f64> {
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
