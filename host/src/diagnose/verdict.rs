//! What is wrong with a model, in one answer: the data, a missing effect, something unknown, or nothing.

use super::data_checks;
use super::missing::{self, Judged, Round};
use super::noise;
use crate::compare::{self, Sums};
use crate::diagnose::where_it_fails::Place;
use crate::error::{Error, Result};
use crate::fit::effects::columns::Records;
use crate::identify::Prepared;
use crate::identify::base_terms;
use crate::model::effects::Bound;
use crate::model_file::{Base, ModelFile};
use crate::study::Study;
use jointwatch_shared::effect::Acts;
use jointwatch_shared::model::terms::InSi;
use serde::Serialize;
use std::collections::BTreeMap;

/// A figure per axis.
pub type PerAxis = BTreeMap<String, f64>;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One or more effects of the library are missing.
    Effect,
    /// Nothing is missing.
    None,
    /// Something is missing that is not in the library.
    Unknown,
    /// The data are at fault.
    Data,
}

/// An effect that is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// The effect.
    pub effect: String,
    /// The axis, or `both`.
    pub axis: String,
}

/// One parameter of a candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CandidateParameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// The SI unit.
    pub unit: String,
}

/// A candidate for the first missing effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// The effect.
    pub effect: String,
    /// The axis, or `both`.
    pub axis: String,
    /// Effects that these records cannot tell from it.
    pub equivalent: Vec<String>,
    /// Held-out drop of the squared residual, in units of its variance.
    pub score: f64,
    /// Relative error on its axis without it, on held-out blocks.
    pub error_before: f64,
    /// Relative error on its axis with it, on held-out blocks.
    pub error_after: f64,
    /// 95 % interval of error_before/error_after.
    pub error_drop_interval: [f64; 2],
    /// Its parameters beside the model.
    pub parameters: Vec<CandidateParameter>,
    /// The experiment that tells it from its look-alikes.
    pub separating_experiment: String,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// RMS error over RMS force before anything was added, per axis, on validation records.
    pub relative_error_before: PerAxis,
    /// The same after everything that was found was added.
    pub relative_error_after: PerAxis,
    /// What no model can go below.
    pub noise_floor: PerAxis,
    /// Everything that is missing, in the order in which it was added.
    pub found: Vec<Found>,
    /// Candidates for the first of them, best first.
    pub ranked: Vec<Ranked>,
    /// Where the model that was brought fails.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What is wrong with the data.
    pub data_problems: Vec<String>,
    /// What else is to be said, one sentence each.
    pub notes: Vec<String>,
}

/// What is left above the floor, as a multiple of it, may be this much before something must be missing.
const ABOVE_FLOOR: f64 = 2.0;
/// Relative errors below this are those of any model of a real joint.
const DISCREPANCY: f64 = 0.012;
/// Of the error's power before, this part may be left above the floor.
const LEFT_OVER: f64 = 0.1;

/// Diagnoses a model on a study.
///
/// # Errors
/// [`crate::error::Kind::Data`] when the study does not fit the model, or its records are too short.
pub fn diagnose(study: &Study, model: &ModelFile) -> Result<Diagnosis> {
    model.check_fits(study)?;
    let prepared = Prepared::with_filters(study, model.filters.clone())?;
    let training = prepared.training(study);
    let validation = prepared.validation(study);
    let low_pass = &model.filters.band;
    let mut notes = Vec::new();
    let (base, values) = base_of(study, model, &mut notes)?;

    let rounds = missing::search(&study.axes, &training, low_pass, &base, values)?;
    let (Some(first), Some(last)) = (rounds.first(), rounds.last()) else {
        return Err(Error::failed("the diagnosis ended before it began"));
    };
    let judged_on = if validation.is_empty() {
        notes.push(
            "the study has no validation records, so errors are those on the records learnt from"
                .into(),
        );
        &training
    } else {
        &validation
    };
    let held = Records::new(&study.axes, judged_on, low_pass);
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let before = relative_errors(&held, first);
    let after = relative_errors(&held, last);

    let all: Vec<&crate::motion::Motion> = prepared.motions.iter().collect();
    let terms: Vec<InSi> = last
        .terms
        .iter()
        .zip(&last.solution.solved.values)
        .map(|(bound, values)| InSi {
            entry: bound.entry,
            axis: bound.axis as u8,
            values: values.clone(),
        })
        .collect();
    let inertia: Vec<f64> = study
        .axes
        .iter()
        .zip(&last.solution.solved.inertia)
        .map(|(axis, found)| found.or(axis.inertia).unwrap_or(0.0))
        .collect();
    let floors = noise::floors(&study.axes, &all, low_pass, &terms, &inertia);
    let floor: Vec<f64> = floors
        .iter()
        .enumerate()
        .map(|(axis, floor)| floor.rms / held.references.force[axis])
        .collect();
    for (axis, floor) in study.axes.iter().zip(&floors) {
        if !floor.at_rest {
            notes.push(format!(
                "axis {} rests in no record, so its noise floor is taken from high frequencies and may be too low",
                axis.name
            ));
        }
    }

    let found = in_words_found(&rounds, &names);
    // Records learnt from say whether the effects found are the ones that act; other records also ask whether their values
    // hold there. Something unknown shows in both.
    let learnt = Records::new(&study.axes, &training, low_pass);
    let learnt_before = relative_errors(&learnt, first);
    let learnt_after = relative_errors(&learnt, last);
    let left_over = |before: f64, after: f64, floor: f64| {
        let above = |e: f64| (e * e - floor * floor).max(0.0);
        let limit = (ABOVE_FLOOR * floor).max(DISCREPANCY);
        after > limit && above(after) > LEFT_OVER * above(before)
    };
    let unexplained = (0..study.axes.len()).any(|axis| {
        let learnt_floor = floors[axis].rms / learnt.references.force[axis];
        left_over(before[axis], after[axis], floor[axis])
            && left_over(learnt_before[axis], learnt_after[axis], learnt_floor)
    });
    let wrong = data_checks::check(study, &model.filters);
    let verdict = match (unexplained, found.is_empty()) {
        _ if wrong.iter().any(|finding| finding.serious) => Verdict::Data,
        (true, _) => Verdict::Unknown,
        (false, true) => Verdict::None,
        (false, false) => Verdict::Effect,
    };
    let per_axis = |values: &[f64]| -> PerAxis {
        let pairs = names.iter().zip(values);
        pairs.map(|(name, v)| ((*name).to_string(), *v)).collect()
    };
    let comparison = compare::compare_motions(study, model, &prepared.motions)?;
    Ok(Diagnosis {
        verdict,
        relative_error_before: per_axis(&before),
        relative_error_after: per_axis(&after),
        noise_floor: per_axis(&floor),
        found,
        ranked: first
            .ranked
            .iter()
            .map(|j| ranked(j, first, study))
            .collect(),
        places: comparison.places,
        data_problems: wrong.into_iter().map(|finding| finding.sentence).collect(),
        notes,
    })
}

/// Every parameter of every term, SI.
type Values = Vec<Vec<f64>>;

/// The physical terms to search beside, and where they are known from a fit, their values.
fn base_of(
    study: &Study,
    model: &ModelFile,
    notes: &mut Vec<String>,
) -> Result<(Vec<Bound>, Option<Values>)> {
    let names: Vec<&str> = model.axes.iter().map(|a| a.name.as_str()).collect();
    if let Base::None(_) = model.base {
        let terms = model
            .effects
            .iter()
            .map(|e| Bound::parse(&e.name(), &names));
        let values = model.effects_in_si()?.into_iter().map(|e| e.values);
        return Ok((terms.collect::<Result<_>>()?, Some(values.collect())));
    }
    let (terms, proposed) = base_terms(study)?;
    notes.push(format!(
        "a {} takes up most of what a missing effect does, so the effect is named beside the study's physical base instead",
        model.base.name()
    ));
    notes.extend(proposed);
    Ok((terms, None))
}

/// RMS error over RMS force per axis on other records, with the values that a round found.
fn relative_errors(records: &Records<'_>, round: &Round) -> Vec<f64> {
    let mut residual = records.measured.clone();
    let solved = &round.solution.solved;
    let mut take = |column: &[f64], factor: f64| {
        for (r, c) in residual.iter_mut().zip(column) {
            *r -= factor * c;
        }
    };
    for (bound, values) in round.terms.iter().zip(&solved.values) {
        take(&records.force(bound, values), 1.0);
    }
    for (column, inertia) in records.accelerations.iter().zip(&solved.inertia) {
        if let (Some(column), Some(inertia)) = (column, inertia) {
            take(column, *inertia);
        }
    }
    for (bound, values) in round.terms.iter().zip(&solved.values) {
        records.take_out(bound, values, &mut residual);
    }
    let rows = records.rows_per_axis();
    let axes = residual
        .chunks_exact(rows)
        .zip(records.measured.chunks_exact(rows));
    axes.map(|(error, force)| Sums::of(error, force).relative_error())
        .collect()
}

/// Everything that was added, an effect that was added to each axis as one on `both`.
fn in_words_found(rounds: &[Round], axes: &[&str]) -> Vec<Found> {
    let mut added: Vec<Bound> = rounds
        .iter()
        .filter_map(|round| round.ranked.first().filter(|j| j.is_missing()))
        .map(|judged| judged.candidate.bound)
        .collect();
    let mut found = Vec::new();
    while !added.is_empty() {
        let bound = added.remove(0);
        let twin = added.iter().position(|b| b.entry == bound.entry);
        let axis = match twin {
            Some(twin) => {
                added.remove(twin);
                "both"
            }
            None if bound.entry.acts == Acts::BothAxes => "both",
            None => axes[bound.axis],
        };
        found.push(Found {
            effect: bound.entry.about.name.into(),
            axis: axis.into(),
        });
    }
    found
}

fn ranked(judged: &Judged, round: &Round, study: &Study) -> Ranked {
    let bound = judged.candidate.bound;
    let both = bound.entry.acts == Acts::BothAxes;
    let kind = |axis: usize| {
        let axis = study.axes.get(axis).or(study.axes.first());
        axis.map_or(jointwatch_shared::model::axis::AxisKind::Translation, |a| {
            a.kind.into()
        })
    };
    let listed = bound
        .entry
        .parameters()
        .iter()
        .zip(&judged.candidate.values);
    let parameters = listed.map(|(parameter, value)| CandidateParameter {
        name: parameter.name.into(),
        value: *value,
        unit: parameter
            .dimension
            .unit(kind(bound.axis), kind(1 - bound.axis))
            .to_string(),
    });
    let rows = round.solution.solved.residual.len() / study.axes.len();
    let weight = round.solution.weights[bound.axis];
    let force = judged.reference_force;
    let relative = |power: f64| (power.max(0.0) / rows as f64).sqrt() / weight / force;
    let (before, after) = (judged.power_before, judged.power_after);
    let low = before - (judged.gain.sum - 1.96 * judged.gain.error);
    let high = before - (judged.gain.sum + 1.96 * judged.gain.error);
    let drop =
        |after: f64| (before / after.max(1e-3 * judged.power_after.max(f64::MIN_POSITIVE))).sqrt();
    Ranked {
        effect: bound.entry.about.name.into(),
        axis: if both {
            "both".into()
        } else {
            study.axes[bound.axis].name.clone()
        },
        equivalent: judged.equivalent.iter().map(|e| (*e).to_string()).collect(),
        score: judged.gain.sum,
        error_before: relative(before),
        error_after: relative(after),
        error_drop_interval: [drop(low), drop(high)],
        parameters: parameters.collect(),
        separating_experiment: bound.entry.about.separated_by.into(),
    }
}
