//! What a diagnosis answers, as it is printed and as scripts read it (`diagnose --json`).

use super::criteria;
use crate::assess::where_it_fails::FailingRegion;
use crate::model::file::{JudgedOn, PerAxis};
use crate::model::{ModelEffect, ParameterValue};
use serde::Serialize;
use std::collections::BTreeMap;

/// What a diagnosis comes to, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One or more effects of the library are missing.
    Effect,
    /// Nothing is missing that these records could tell.
    None,
    /// Something is missing that is not in the library.
    Unknown,
    /// The data are at fault.
    Data,
}

/// An effect that is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// The effect's name in the library, `coulomb`; with its input where it follows one.
    pub effect: String,
    /// The axis, or `both`.
    pub axis: String,
}

impl Found {
    /// As people write it: `effect@axis`.
    pub fn name(&self) -> String {
        format!("{}@{}", self.effect, self.axis)
    }
}

/// A candidate for the first missing effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// The effect's name, as in [`Found::effect`].
    pub effect: String,
    /// The axis, or `both`.
    pub axis: String,
    /// Effects that explain nearly the same force; [`Diagnosis::equivalents`] says which of them
    /// these records cannot tell from it.
    pub equivalent: Vec<String>,
    /// How likely it is that it acts, by the records: 0 to 1.
    pub probability: f64,
    /// How likely it is that it or one of its equivalents acts: 0 to 1.
    pub group_probability: f64,
    /// Held-out drop of the squared residual, in units of its variance.
    pub score: f64,
    /// Relative error on its axis without it, on held-out blocks.
    pub error_before: f64,
    /// Relative error on its axis with it, on held-out blocks.
    pub error_after: f64,
    /// 95 % interval of error_before/error_after.
    pub error_drop_interval: [f64; 2],
    /// Its parameters beside the model.
    pub parameters: Vec<ParameterValue>,
    /// The experiment that tells it from its look-alikes.
    pub separating_experiment: String,
}

impl Ranked {
    /// The candidate as a model would hold it.
    pub fn as_a_term(&self) -> ModelEffect {
        ModelEffect {
            effect: self.effect.clone(),
            axis: (self.axis != "both").then(|| self.axis.clone()),
            parameters: self.parameters.clone(),
        }
    }
}

/// How much of a missing effect a polynomial or a network makes up for without naming it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// The effect's name, as in [`Found::effect`].
    pub effect: String,
    /// The axis on which its force is looked at.
    pub axis: String,
    /// Part of the power of its force, about the mean and in the common band, on the training
    /// records; 0 to 1.
    pub share: f64,
}

/// What is left beside what was found, and what it follows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// Name of the axis.
    pub axis: String,
    /// RMS of what the effects found leave, over the RMS force; on blocks of the training records
    /// that were not learnt from.
    pub relative_error: f64,
    /// Part of its power that a learner without physics still takes away; 0 to 1.
    pub explainable: f64,
    /// What it follows: `states`, `memory`, `delays`, `inputs`, `time` or `record`.
    pub follows: String,
}

/// A set of effects that was looked at (`--explain`).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LookedAt {
    /// Name of the axis.
    pub axis: String,
    /// The effects beside the base.
    pub effects: Vec<String>,
    /// Mean log error power on blocks that were not learnt from.
    pub mean_log_error: f64,
    /// RMS error over RMS force on the same blocks.
    pub error: f64,
    /// Strengths and shapes that it chooses.
    pub numbers: usize,
    /// What became of it.
    pub outcome: String,
}

/// All that a diagnosis says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// What it comes to, in a word.
    pub verdict: Verdict,
    /// What the errors per axis are measured on: validation records, or held-out blocks where the
    /// study has none.
    pub judged_on: JudgedOn,
    /// RMS error over RMS force of the model that was brought, per axis.
    pub relative_error_before: PerAxis,
    /// The same with everything that was found added to it.
    pub relative_error_after: PerAxis,
    /// What no model can go below.
    pub noise_floor: PerAxis,
    /// Mean square of the force about its mean, beside its mean square.
    #[serde(skip)]
    pub(crate) moving: PerAxis,
    /// Everything that is missing, in the order in which it was added.
    pub found: Vec<Found>,
    /// Candidates for the first of them, best first.
    pub ranked: Vec<Ranked>,
    /// How likely it is that nothing is missing (`none`), something without a name (`unknown`),
    /// that the data are at fault (`data`), and that each effect acts.
    pub probabilities: BTreeMap<String, f64>,
    /// What is left beside what was found, where a learner without physics could still take some
    /// of it away.
    pub remainder: Vec<Remainder>,
    /// Every set of effects that was looked at, when asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub looked_at: Vec<LookedAt>,
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

/// A candidate that is likelier to act than not has a part in what is missing; what is less likely
/// may only look like it.
const LIKELY: f64 = 0.5;

/// A probability below this one is told as 0.00.
const NO_CHANCE: f64 = 0.005;

impl Diagnosis {
    /// The candidates that were found, in the order of [`Diagnosis::ranked`].
    pub fn found_candidates(&self) -> impl Iterator<Item = &Ranked> {
        self.ranked.iter().filter(|r| self.has_found(r))
    }

    /// Whether a candidate was found.
    pub fn has_found(&self, candidate: &Ranked) -> bool {
        let mut found = self.found.iter();
        found.any(|f| f.effect == candidate.effect && f.axis == candidate.axis)
    }

    /// The equivalents of a candidate that are likely themselves, so that these records cannot tell
    /// them from it, and those that predict worse.
    pub fn equivalents<'a>(&self, candidate: &'a Ranked) -> (Vec<&'a str>, Vec<&'a str>) {
        // On both axes it is the likelier of them.
        let chance = |effect: &str| {
            let is_it = |name: &String| match name.split_once('@') {
                Some((own, axis)) => own == effect && [axis, "both"].contains(&&*candidate.axis),
                None => name == effect,
            };
            let own = self.probabilities.iter().filter(|(name, _)| is_it(name));
            own.map(|(_, chance)| *chance).fold(0.0, f64::max)
        };
        let all = candidate.equivalent.iter().map(String::as_str);
        all.partition(|effect| chance(effect) >= NO_CHANCE)
    }

    /// What is said beside "nothing is missing" where an error stands above its noise floor by more
    /// than instruments' tolerances; nothing elsewhere.
    pub(crate) fn but_above_noise(&self) -> String {
        let axes = self.relative_error_after.iter();
        let axes = axes.map(|(axis, error)| (axis, *error, self.noise_floor[axis]));
        let axes = axes.filter(|(_, error, floor)| {
            criteria::stands_out(*error, *floor, criteria::tolerance())
        });
        let left: Vec<String> = axes
            .map(|(axis, error, floor)| {
                format!(
                    "relative error {error:.4} beside a noise floor of {floor:.4} on axis {axis}"
                )
            })
            .collect();
        if left.is_empty() {
            return String::new();
        }
        let cause = match self.judged_on {
            JudgedOn::Validation => "the records differ from each other",
            _ => "the joint changes along the records",
        };
        format!(
            " that follows the motion; left on the {} is {}: {cause}, or their noise is larger than it looked",
            self.judged_on.words(),
            left.join(" and ")
        )
    }

    /// What is said where most of what is missing has no name, in one or two sentences.
    pub fn unknown_in_words(&self) -> String {
        let chance = |found: &Found| {
            let mut candidates = self.found_candidates();
            let own = candidates.find(|r| r.effect == found.effect && r.axis == found.axis);
            own.map_or(0.0, |r| r.group_probability)
        };
        let found = self.found.iter();
        unknown_in_words(found.map(|found| (found.name(), chance(found))))
    }
}

/// The same of effects that were found, each with how likely it is that it or one of its
/// equivalents acts.
fn unknown_in_words(found: impl Iterator<Item = (String, f64)>) -> String {
    let (likely, others): (Vec<_>, Vec<_>) = found.partition(|(_, chance)| *chance >= LIKELY);
    let [likely, others] = [likely, others].map(|found| {
        let names: Vec<String> = found.into_iter().map(|(name, _)| name).collect();
        names.join(", ")
    });
    let part = match likely.as_str() {
        "" if others.is_empty() => {
            return "Something is missing that is not in the library.".into();
        }
        "" => "What is missing has no name yet.".into(),
        likely => {
            format!("Most of what is missing has no name yet. A part of it has: {likely}.")
        }
    };
    match others.as_str() {
        "" => part,
        others => format!("{part} {others} may only look like a part of it."),
    }
}

#[cfg(test)]
mod tests {
    use super::unknown_in_words;

    #[test]
    fn what_is_likelier_to_imitate_than_to_act_is_no_part_of_what_is_missing() {
        let said = |found: &[(&str, f64)]| {
            unknown_in_words(found.iter().map(|(name, chance)| ((*name).into(), *chance)))
        };
        assert!(said(&[]).contains("not in the library"));
        assert_eq!(
            said(&[("dahl@x", 0.8), ("cogging@x", 0.2)]),
            "Most of what is missing has no name yet. A part of it has: dahl@x. cogging@x may only look like a part of it."
        );
        assert!(!said(&[("cogging@x", 0.2)]).contains("A part of it has"));
    }
}
