//! What a search found, in the words of the answer.

use super::answer::{Found, LookedAt, Ranked, Remainder};
use super::criteria;
use super::decide::{Decision, drop_interval};
use super::errors::shapes_of;
use super::learner::Knows;
use super::search::rank::ScoredHypothesis;
use super::search::zeros::Zeros;
use super::search::{Model, Search};
use crate::fit::effects::columns::Records;
use crate::fit::effects::{FittedEffect, assemble, solved_at};
use crate::model::ParameterValue;
use crate::model::effects::AxisEffect;
use crate::study::series::mean;
use crate::study::{Study, quasi_static};
use crate::text::error::Result;
use jointwatch_shared::effect::Acts;
use std::collections::BTreeMap;

/// Everything that was added, an effect that was added to each axis as one on `both`.
pub(super) fn found(added: &[AxisEffect], axes: &[&str]) -> Vec<Found> {
    let mut added = added.to_vec();
    let mut found = Vec::new();
    while !added.is_empty() {
        let bound = added.remove(0);
        let is_twin = |b: &AxisEffect| {
            b.entry == bound.entry && b.input == bound.input && b.axis != bound.axis
        };
        let twin = added.iter().position(is_twin);
        let axis = match twin {
            Some(twin) => {
                added.remove(twin);
                "both"
            }
            None if bound.entry.acts == Acts::BothAxes => "both",
            None => axes[bound.axis],
        };
        found.push(Found {
            effect: bound.effect(),
            axis: axis.into(),
        });
    }
    found
}

/// Candidates for the first missing effect, best first; one that is missing on each axis stands
/// once, for both. What was found has its values beside everything else that was: alone it may have
/// next to none.
pub(super) fn candidates(
    search: &Search,
    found: &[Found],
    (records, base): (&Records<'_>, &[AxisEffect]),
    study: &Study,
) -> Result<Vec<Ranked>> {
    let together = together(&search.found, &search.last, records, study)?;
    let zeros = of_zeros(&search.zeros_found(), &together, records, study);
    let mut all: Vec<(f64, Ranked)> = zeros.into_iter().map(|zero| (0.0, zero)).collect();
    let values = &search.first.solution.solved.values;
    for decision in &search.decisions {
        for (looked, equivalent) in &decision.singles {
            let bound = looked.hypothesis.added()[0];
            let own = &looked.hypothesis.values[looked.hypothesis.base];
            let parameters = match together.iter().find(|term| term.bound == bound) {
                Some(term) => parameters(&bound, &term.values, &term.intervals, study),
                None => {
                    let intervals = intervals(records, base, values, (&bound, own), study);
                    parameters(&bound, own, &intervals, study)
                }
            };
            let ranked = ranked(decision, looked, equivalent, parameters, study);
            all.push((looked.score.rank - decision.base_rank, ranked));
        }
    }
    let place = |r: &Ranked| {
        let same = |f: &Found| f.effect == r.effect && (f.axis == r.axis || f.axis == "both");
        found.iter().position(same).unwrap_or(found.len())
    };
    all.sort_by(|a, b| place(&a.1).cmp(&place(&b.1)).then(a.0.total_cmp(&b.0)));
    let mut all: Vec<Ranked> = all.into_iter().map(|(_, ranked)| ranked).collect();
    let mut seen: Vec<(String, String)> = Vec::new();
    all.retain_mut(|candidate| {
        if found
            .iter()
            .any(|f| f.axis == "both" && f.effect == candidate.effect)
        {
            candidate.axis = "both".into();
        }
        let name = (candidate.effect.clone(), candidate.axis.clone());
        let new = !seen.contains(&name);
        seen.push(name);
        new
    });
    Ok(all)
}

/// A candidate in words and relative figures.
fn ranked(
    decision: &Decision,
    looked: &ScoredHypothesis,
    equivalent: &[String],
    parameters: Vec<ParameterValue>,
    study: &Study,
) -> Ranked {
    let bound = looked.hypothesis.added()[0];
    let both = bound.entry.acts == Acts::BothAxes;
    let (before, after) = (decision.errors[0], looked.score.error);
    let like =
        |other: &&ScoredHypothesis| equivalent.contains(&other.hypothesis.added()[0].effect());
    let singles = decision.singles.iter().map(|(single, _)| single);
    let group: Vec<AxisEffect> = singles
        .filter(like)
        .map(|other| other.hypothesis.added()[0])
        .chain([bound])
        .collect();
    Ranked {
        effect: bound.effect(),
        axis: if both {
            "both".into()
        } else {
            study.axes[bound.axis].name.clone()
        },
        equivalent: equivalent.to_vec(),
        probability: decision.chances.any_of(&[bound]),
        group_probability: decision.chances.any_of(&group),
        score: decision.rows as f64 * (1.0 - (after / before).powi(2)),
        error_before: before,
        error_after: after,
        error_drop_interval: decision.drop_interval(looked),
        parameters,
        separating_experiment: bound.entry.about.separated_by.into(),
    }
}

/// A candidate's parameters in words.
fn parameters(
    bound: &AxisEffect,
    values: &[f64],
    intervals: &[Option<[f64; 2]>],
    study: &Study,
) -> Vec<ParameterValue> {
    let kind = |axis: usize| {
        let axis = study.axes.get(axis).or(study.axes.first());
        axis.map_or(jointwatch_shared::base::axis::AxisKind::Translation, |a| {
            a.kind.into()
        })
    };
    let listed = bound.entry.parameters().iter().zip(values).enumerate();
    let says_something =
        |name: &str| !(study.quasi_static && quasi_static::is_without_meaning(name));
    let listed = listed.filter(|(_, (parameter, _))| says_something(parameter.name));
    let parameters = listed.map(|(index, (parameter, value))| ParameterValue {
        name: parameter.name.into(),
        value: *value,
        unit: bound.unit(parameter, kind(bound.axis), kind(1 - bound.axis)),
        interval: intervals.get(index).copied().flatten(),
    });
    parameters.collect()
}

/// The effects that were found, with their values beside everything else of the last model.
fn together(
    found: &[AxisEffect],
    last: &Model,
    records: &Records<'_>,
    study: &Study,
) -> Result<Vec<FittedEffect>> {
    if found.is_empty() {
        return Ok(Vec::new());
    }
    let solution = &last.solution;
    let problem = solution.problem(records, &last.terms);
    let fit = assemble(
        &study.axes,
        &problem,
        solution.solved.clone(),
        solution.stopped,
    )?;
    let terms = fit.terms.into_iter();
    Ok(terms.filter(|term| found.contains(&term.bound)).collect())
}

/// Zeros of force that were found.
fn of_zeros(
    zeros: &[&Zeros],
    together: &[FittedEffect],
    records: &Records<'_>,
    study: &Study,
) -> Vec<Ranked> {
    let rows = records.rows_per_axis() as f64;
    let of = |zeros: &&Zeros| {
        let term = together.iter().find(|term| term.bound == zeros.own)?;
        let [before, after] = zeros.errors;
        Some(Ranked {
            effect: zeros.own.effect(),
            axis: study.axes[zeros.own.axis].name.clone(),
            equivalent: Vec::new(),
            probability: zeros.chance(),
            group_probability: zeros.chance(),
            score: rows * (1.0 - (after / before).powi(2)),
            error_before: before,
            error_after: after,
            error_drop_interval: drop_interval(&zeros.gains),
            parameters: parameters(&zeros.own, &term.values, &term.intervals, study),
            separating_experiment: zeros.own.entry.about.separated_by.into(),
        })
    };
    zeros.iter().filter_map(of).collect()
}

/// Intervals of a candidate's parameters beside the base.
fn intervals(
    records: &Records<'_>,
    base: &[AxisEffect],
    values: &[Vec<f64>],
    (bound, own): (&AxisEffect, &[f64]),
    study: &Study,
) -> Vec<Option<[f64; 2]>> {
    let (mut terms, mut values) = (base.to_vec(), values.to_vec());
    terms.push(*bound);
    values.push(own.to_vec());
    let found = solved_at(records, &terms, &shapes_of(records, &terms, &values));
    let fit = found.and_then(|solution| {
        let problem = solution.problem(records, &terms);
        assemble(
            &study.axes,
            &problem,
            solution.solved.clone(),
            solution.stopped,
        )
    });
    let fit = fit.ok().and_then(|fit| fit.terms.into_iter().next_back());
    fit.map_or_else(Vec::new, |term| term.intervals)
}

/// What is left on every axis where motion explains some of it.
pub(super) fn remainder(decisions: &[Decision], axes: &[&str]) -> Vec<Remainder> {
    let left = decisions.iter().filter(|d| d.unnamed() > 0.0);
    left.map(|decision| {
        let [before, _] = decision.taken.power;
        Remainder {
            axis: axes[decision.axis].into(),
            relative_error: decision.errors[1],
            explainable: (decision.unnamed() / before.max(f64::MIN_POSITIVE)).min(1.0),
            follows: decision.follows.map_or("states", Knows::word).into(),
        }
    })
    .collect()
}

/// Probabilities of all axes together; `zeros` are those that were found.
pub(super) fn probabilities(
    decisions: &[Decision],
    zeros: &[&Zeros],
    axes: &[&str],
    at_fault: bool,
) -> BTreeMap<String, f64> {
    let data = f64::from(u8::from(at_fault));
    let mut out = BTreeMap::new();
    let nothing: f64 = decisions.iter().map(|d| d.chances.nothing).product();
    let no_zero: f64 = zeros.iter().map(|zeros| 1.0 - zeros.chance()).product();
    let known: f64 = decisions.iter().map(|d| 1.0 - d.chances.unknown).product();
    out.insert("none".into(), nothing * no_zero * (1.0 - data));
    out.insert("unknown".into(), (1.0 - known) * (1.0 - data));
    out.insert("data".into(), data);
    let of_zeros = zeros.iter().map(|zeros| (zeros.own, zeros.chance()));
    let each = decisions.iter().flat_map(|d| d.chances.each());
    for (bound, chance) in each.chain(of_zeros) {
        let other: &mut f64 = out.entry(bound.name(axes)).or_insert(0.0);
        *other = other.max(chance);
    }
    out
}

/// Everything that was looked at, the best first, and what became of it.
pub(super) fn looked_at(decisions: &[Decision], axes: &[&str]) -> Vec<LookedAt> {
    let mut all = Vec::new();
    for decision in decisions {
        let mut looked: Vec<&ScoredHypothesis> = decision.looked.iter().collect();
        looked.sort_by(|a, b| a.score.rank.total_cmp(&b.score.rank));
        let best = looked.first().map_or(f64::NAN, |l| l.score.rank);
        let is_chosen = |l: &ScoredHypothesis| l.hypothesis.key() == decision.hypothesis.key();
        let chosen = looked.iter().find(|l| is_chosen(l)).map(|l| l.score.rank);
        all.extend(looked.into_iter().map(|l| {
            let added = l.hypothesis.added();
            LookedAt {
                axis: axes[decision.axis].into(),
                effects: added.iter().map(|b| b.name(axes)).collect(),
                mean_log_error: mean(&l.score.log_errors),
                error: l.score.error,
                numbers: l.score.numbers,
                outcome: if is_chosen(l) {
                    "chosen".into()
                } else if !l.sound && !added.is_empty() {
                    "a value that is not physical, or at the edge of what was searched".into()
                } else if let Some(chosen) = chosen
                    && l.score.rank < chosen
                {
                    let more = (decision.errors[1].powi(2) - l.score.error.powi(2))
                        .max(0.0)
                        .sqrt();
                    let counts = criteria::LEAST_SHARE * decision.moving.sqrt();
                    let why = match more < counts {
                        true => format!(
                            "explains {:.2} % of the force more, too little to count",
                            100.0 * more
                        ),
                        false => "within the scatter of the blocks".into(),
                    };
                    format!(
                        "ahead of the chosen one by {:.3}: {why}",
                        chosen - l.score.rank
                    )
                } else {
                    format!("behind the best by {:.3}", l.score.rank - best)
                },
            }
        }));
    }
    all
}
