//! What a diagnosis answers, as it is printed and as scripts read it (`diagnose --json`).

use super::judge::Judged;
use super::missing::Round;
use crate::assess::where_it_fails::FailingRegion;
use crate::model::effects::Bound;
use crate::model::file::JudgedOn;
use crate::study::Study;
use jointwatch_shared::effect::Acts;
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

/// How much of a missing effect a polynomial or a network makes up for without naming it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// The effect.
    pub effect: String,
    /// The axis on which its force is looked at.
    pub axis: String,
    /// Part of the power of its force, about the mean and in the common band, on the training records; 0 to 1.
    pub share: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// What the errors per axis are measured on: validation records, or held-out blocks where the study has none.
    pub judged_on: JudgedOn,
    /// RMS error over RMS force of the model that was brought, per axis.
    pub relative_error_before: PerAxis,
    /// The same with everything that was found added to it.
    pub relative_error_after: PerAxis,
    /// What no model can go below.
    pub noise_floor: PerAxis,
    /// Everything that is missing, in the order in which it was added.
    pub found: Vec<Found>,
    /// Candidates for the first of them, best first.
    pub ranked: Vec<Ranked>,
    /// How much of what was found the polynomial or network that was brought follows already.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub absorbed: Vec<Absorbed>,
    /// Where the model that was brought fails.
    #[serde(rename = "where")]
    pub places: Vec<FailingRegion>,
    /// What is wrong with the data.
    pub data_problems: Vec<String>,
    /// What else is to be said, one sentence each.
    pub notes: Vec<String>,
}

/// Everything that was added, an effect that was added to each axis as one on `both`.
pub(super) fn in_words_found(added: &[Bound], axes: &[&str]) -> Vec<Found> {
    let mut added = added.to_vec();
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

/// Candidates for the first missing effect, best first; one that is missing on each axis stands once, for both.
pub(super) fn in_words_ranked(first: &Round, found: &[Found], study: &Study) -> Vec<Ranked> {
    let judged = first.ranked.iter();
    let mut all: Vec<Ranked> = judged.map(|judged| ranked(judged, first, study)).collect();
    // What was kept in the end knows more than what came first.
    let kept = |r: &Ranked| {
        let same = found
            .iter()
            .any(|f| f.effect == r.effect && (f.axis == r.axis || f.axis == "both"));
        !same
    };
    all.sort_by_key(kept);
    for twin in found.iter().filter(|f| f.axis == "both") {
        let mut seen = false;
        all.retain_mut(|candidate| {
            if candidate.effect != twin.effect {
                return true;
            }
            candidate.axis = "both".into();
            !std::mem::replace(&mut seen, true)
        });
    }
    all
}

/// A candidate in words and relative figures.
fn ranked(judged: &Judged, round: &Round, study: &Study) -> Ranked {
    let bound = judged.candidate.bound;
    let both = bound.entry.acts == Acts::BothAxes;
    let kind = |axis: usize| {
        let axis = study.axes.get(axis).or(study.axes.first());
        axis.map_or(jointwatch_shared::base::axis::AxisKind::Translation, |a| {
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
