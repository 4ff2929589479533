//! The search over sets of effects: a beam that adds, replaces and drops. An effect that does not
//! help ends nothing, and one that was found early may leave again.

use super::bench::Bench;
use super::collect::Library;
use super::hypothesis::{Hypothesis, Key, Part};
use super::score::Score;
use crate::diagnose::criteria;
use crate::model::effects::AxisEffect;
use crate::text::work;
use jointwatch_shared::effect::{Acts, Subsystem};
use rayon::prelude::*;
use std::collections::HashSet;

/// Effects that are tried beside each hypothesis, those that promise most first.
const TRIED: usize = 8;
/// So many always beside the base, and the others where they promise this part of what the first
/// does.
const ALWAYS: usize = 4;
const RIVAL: f64 = 0.1;
/// An effect takes away no more than this times what it promises before its shapes are found.
const MORE: f64 = 4.0;
/// Of those, so many beside each effect that was tried beside the base.
const BESIDE: usize = 2;
/// Steps of the first refinement of an effect's shapes, and of all shapes together.
const STEPS: [usize; 2] = [6, 10];
/// Of the best, this many times the width are tried with squares of inputs, and have all their
/// shapes found anew.
const SETTLED: usize = 2;
/// Two effects of which neither helps by itself have to take away half of the error power: there
/// are many pairs, and chance likes one.
const TOGETHER: f64 = std::f64::consts::LN_2;
/// No hypothesis overtakes one that is ahead by so much mean log error power.
const NEAR: f64 = 1.5;

/// A hypothesis that was looked at.
#[derive(Clone)]
pub(crate) struct ScoredHypothesis {
    /// The effects with the values that fit best.
    pub(crate) hypothesis: Hypothesis,
    pub(crate) parts: Vec<Part>,
    pub(crate) score: Score,
    /// Whether its values are physics.
    pub(crate) sound: bool,
}

/// The rows that are searched on, and those that are judged.
pub(crate) struct Field<'a, 'b> {
    pub(crate) full: &'a Bench<'b>,
    pub(crate) excerpt: &'a Bench<'b>,
    pub(crate) library: &'a Library,
    /// How forces may follow inputs.
    pub(crate) inputs: &'a [&'static str],
}

/// Looks at a hypothesis with the shapes that it has; columns of `known` parts are taken over.
pub(crate) fn look(bench: &Bench<'_>, hypothesis: &Hypothesis, known: &[Part]) -> ScoredHypothesis {
    work::step();
    let parts = bench.parts(hypothesis, known);
    let design = bench.design(hypothesis, &parts);
    let judged = bench.judged(&design);
    let score = bench.score(hypothesis, &parts, &judged);
    let hypothesis = bench.valued(hypothesis, &parts, &judged.all);
    ScoredHypothesis {
        sound: bench.is_sound(&hypothesis, &parts, &judged.all),
        hypothesis,
        parts,
        score,
    }
}

/// Every hypothesis that was looked at, the base first.
pub(crate) fn rank(field: &Field<'_, '_>, base: ScoredHypothesis) -> Vec<ScoredHypothesis> {
    let mut seen = HashSet::from([base.hypothesis.key()]);
    let mut beam = vec![base.clone()];
    let mut all = vec![base];
    // How many were looked at in a first step that brought nothing.
    let mut alone: Option<usize> = None;
    for step in 0..criteria::DEPTH {
        let before = best_rank(&all);
        let mut moves: Vec<(Hypothesis, &[Part])> = Vec::new();
        for (place, from) in beam.iter().enumerate() {
            let wider = added(field, &from.hypothesis, TRIED, None).into_iter();
            moves.extend(wider.map(|h| (h, &*from.parts)));
            for bound in from.hypothesis.added() {
                let hypothesis = from.hypothesis.without(bound);
                let alone = hypothesis.members.len() == hypothesis.base;
                // What else would do in the place of an effect that was found earlier: beside the
                // base all others were tried.
                let most = if alone || place > 0 { 0 } else { TRIED / 2 };
                let others = added(field, &hypothesis, most, Some(bound)).into_iter();
                moves.extend(others.map(|h| (h, &*from.parts)));
                if !alone {
                    moves.push((hypothesis, &from.parts));
                }
            }
        }
        let mut tried = tried(field, moves, &mut seen);
        let sound = || all[1..].iter().filter(|looked| looked.sound);
        let is_better =
            |looked: &ScoredHypothesis| all[0].score.rank - looked.score.rank > criteria::PRICE;
        if step == 1 && !sound().any(is_better) {
            // What does nothing by itself may do much beside what promises most there.
            let beside = sound().flat_map(|from| {
                let wider = added(field, &from.hypothesis, TRIED, None).into_iter();
                wider.take(BESIDE).map(|h| (h, &*from.parts))
            });
            tried.extend(self::tried(field, beside.collect(), &mut seen));
            tried.sort_by(|a, b| order(a).total_cmp(&order(b)));
        }
        beam = tried.iter().take(criteria::WIDTH).cloned().collect();
        all.extend(tried);
        let gained = before - best_rank(&all);
        match (step, alone) {
            // Of two that help only together neither does by itself, so the first step ends
            // nothing.
            (0, _) => alone = (gained < criteria::PRICE).then_some(all.len()),
            (1, Some(first)) if gained < TOGETHER => {
                all.truncate(first);
                break;
            }
            _ if gained < criteria::PRICE => break,
            _ => {}
        }
    }
    all
}

/// Hypotheses of which none was `seen` before, with the values of those parts at first, the best
/// first.
fn tried(
    field: &Field<'_, '_>,
    mut moves: Vec<(Hypothesis, &[Part])>,
    seen: &mut HashSet<Key>,
) -> Vec<ScoredHypothesis> {
    moves.retain(|(hypothesis, _)| seen.insert(hypothesis.key()));
    let look_at = |(hypothesis, known): (Hypothesis, &[Part])| {
        let mut refined = field.excerpt.refined(&hypothesis, false, STEPS[0]);
        // The frequency of a line is known as finely as the records are long.
        if refined.added().iter().any(|b| b.entry.is_line()) {
            refined = field.full.refined(&refined, false, STEPS[0]);
        }
        look(field.full, &refined, known)
    };
    let mut tried: Vec<ScoredHypothesis> = moves.into_par_iter().map(look_at).collect();
    tried.sort_by(|a, b| order(a).total_cmp(&order(b)));
    let best = tried.iter().take(SETTLED * criteria::WIDTH);
    let mut moves: Vec<(Hypothesis, &[Part])> = best
        .flat_map(|looked| {
            let squared = with_squares(field, &looked.hypothesis);
            squared.map(|hypothesis| (hypothesis, &*looked.parts))
        })
        .collect();
    moves.retain(|(hypothesis, _)| seen.insert(hypothesis.key()));
    let squared: Vec<ScoredHypothesis> = moves.into_par_iter().map(look_at).collect();
    tried.extend(squared);
    tried.sort_by(|a, b| order(a).total_cmp(&order(b)));
    let near = tried.first().map_or(0.0, |best| best.score.rank) + NEAR;
    let most = SETTLED * criteria::WIDTH;
    let rivals = tried.par_iter_mut().take(most);
    rivals.filter(|l| l.score.rank < near).for_each(|looked| {
        let refined = field.excerpt.refined(&looked.hypothesis, true, STEPS[1]);
        let again = look(field.full, &refined, &looked.parts);
        if order(&again) < order(looked) {
            *looked = again;
        }
    });
    tried.sort_by(|a, b| order(a).total_cmp(&order(b)));
    tried
}

/// A hypothesis with the square of an input for each effect in it that follows the input alone: a
/// force that rises and falls with an input shows by neither power alone.
fn with_squares(
    field: &Field<'_, '_>,
    hypothesis: &Hypothesis,
) -> impl Iterator<Item = Hypothesis> {
    let members = hypothesis
        .added()
        .iter()
        .zip(&hypothesis.values[hypothesis.base..]);
    members.filter_map(|(bound, values)| {
        let square = bound.squared()?;
        let offered = square.input.is_some_and(|i| field.inputs.contains(&i));
        let news = offered && !hypothesis.members.contains(&square);
        let wider = news.then(|| hypothesis.with(square, values.clone()));
        wider.filter(|wider| field.full.is_long_enough(wider))
    })
}

/// A hypothesis with each of so many effects that promise most beside it; in the place of a
/// `former` one also with each that generalises it, whose promise counts for little: where its
/// shapes start it may be far from its special case.
fn added(
    field: &Field<'_, '_>,
    hypothesis: &Hypothesis,
    most: usize,
    former: Option<&AxisEffect>,
) -> Vec<Hypothesis> {
    let wider = |bound: &AxisEffect| former.is_some_and(|former| generalises(bound, former));
    if most == 0 && !field.library.has(wider) {
        return Vec::new();
    }
    let excerpt = field.excerpt;
    let parts = excerpt.parts(hypothesis, &[]);
    let design = excerpt.design(hypothesis, &parts);
    let promises = field.library.scan(excerpt, hypothesis, &design);
    let best = promises.first().map_or(0.0, |best| best.gain);
    let worth = field.full.least_share.powi(2) / MORE;
    let told = hypothesis.added().is_empty() && former.is_none();
    promises
        .into_iter()
        .enumerate()
        .filter(|(place, promise)| {
            let rival = *place < ALWAYS || promise.gain > RIVAL * best;
            // What has no shape costs next to nothing to try, and may count only beside others: a
            // spring beside a damper's law.
            let plain = most > 0 && is_plain(&promise.bound);
            let tried = (*place < most && rival) || plain || wider(&promise.bound);
            (told && *place < ALWAYS) || (tried && promise.gain > worth)
        })
        .map(|(_, promise)| promise)
        .map(|promise| hypothesis.with(promise.bound, promise.values))
        .filter(|wider| field.full.is_long_enough(wider))
        .collect()
}

/// Whether an effect has another, or one that the other may be taken for, as a special case.
fn generalises(bound: &AxisEffect, former: &AxisEffect) -> bool {
    let special = |name: &str| bound.entry.replaces.contains(&name);
    let same = bound.axis == former.axis && bound.input == former.input;
    let mut alike = former.entry.looks_like.iter();
    same && (special(former.entry.about.name) || alike.any(|name| special(name)))
}

/// Whether it is one strength of the joint and no shape: a spring, a damper, a constant force.
fn is_plain(bound: &AxisEffect) -> bool {
    let of_joint = bound.entry.subsystem == Subsystem::Plant && bound.entry.acts == Acts::OwnAxis;
    of_joint && bound.input.is_none() && bound.entry.parameters().len() == 1
}

/// What is not physics comes after what is.
fn order(looked: &ScoredHypothesis) -> f64 {
    looked.score.rank
        + if looked.sound {
            0.0
        } else {
            criteria::LEAST_DIFFERENCE
        }
}

fn best_rank(all: &[ScoredHypothesis]) -> f64 {
    all.iter()
        .map(|l| l.score.rank)
        .fold(f64::INFINITY, f64::min)
}
