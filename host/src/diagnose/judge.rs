//! What every candidate for a missing effect is worth on stretches of the records that it was not fitted to, and in which order they come.

use super::candidates::{Beside, Candidate, REFINED};
use super::held_out::{Gain, HeldOut, Worth, held_out};
use super::tolerances;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::model::effects::Bound;
use crate::study::Axis;
use crate::text::error::Result;

/// What an effect has to take away from the residual's held-out power, and to add to the force of its axis, to be called missing: any model
/// of a real joint is wrong by some thousandths, and that is no missing effect.
pub(super) const MIN_MISSING: Worth = Worth {
    part: 0.02,
    share: 0.0041,
};
/// Beside a model to which nothing was added yet it may add less, down to this, if it explains nearly everything that is left: faults of a
/// model look like this or that effect, but never quite.
const MIN_SHARE_OF_ALL: f64 = 0.002;
/// That is nearly everything; what explains it is missing too if it acts in no more than two blocks.
const NEARLY_ALL: f64 = 0.75;
/// By less than this, RMS beside RMS, one model is not better than another: noise and small faults decide.
pub(super) const WRONG_BY: f64 = 0.006;
/// A law with fewer parameters is preferred when this part of what is explained is lost at most,
pub(super) const PARSIMONY: f64 = 0.01;
/// and what it leaves over is at most so many times as much, as power: a law that is nearly right leaves little more than the
/// right one, but where records have little noise that can be several times as much.
pub(super) const LEAVES_AS_LITTLE: f64 = 1.15;
/// Two laws whose contributions agree to this cannot be told apart by these records.
const LIKENESS: f64 = 0.985;
/// So many candidates of a scan are always held against all rows,
const ALWAYS: usize = 3;
/// and those that explain this part of what the best one does.
const RIVAL: f64 = 0.2;
/// Steps by which candidates of a scan are refined on all rows.
const STEPS_ON_ALL: usize = 3;
/// A candidate with what it is worth.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub(crate) candidate: Candidate,
    /// Held-out Σ (weighted residual)² that it takes away.
    pub(crate) gain: Gain,
    /// Part of the held-out power of the residual that it takes away.
    pub(crate) part: f64,
    /// RMS of what it adds beside the RMS of the force, on the axis where that is most.
    pub(crate) share: f64,
    /// Held-out Σ (weighted residual)² on its axis, without and with it.
    pub(crate) power_before: f64,
    pub(crate) power_after: f64,
    /// RMS force of its axis, N or N·m.
    pub(crate) reference_force: f64,
    /// Whether nothing was added to the model before.
    pub(crate) is_first: bool,
    /// Names of laws that do the same on these records.
    pub(crate) equivalent: Vec<&'static str>,
}

impl Judged {
    /// Whether it is missing, rather than a way to fit noise or a model's small faults.
    pub(crate) fn is_missing(&self) -> bool {
        let nearly_all = self.part >= NEARLY_ALL;
        let all = self.is_first && nearly_all && self.share >= MIN_SHARE_OF_ALL;
        // A stop may be met twice in a record.
        let sure = self.gain.is_sure() || (nearly_all && self.gain.is_repeated());
        (self.share >= MIN_MISSING.share || all) && self.part >= MIN_MISSING.part && sure
    }
}

/// Candidates with what they are worth on held-out blocks, best first; and what instruments do wrong within their tolerances.
pub(super) fn judge(
    records: &Records<'_>,
    excerpt: &Records<'_>,
    terms: &[Bound],
    solution: &Solution,
    axes: &[Axis],
    is_first: bool,
) -> Result<(Vec<Judged>, Vec<Bound>)> {
    let within = tolerances::within(records, axes, terms, solution);
    let columns = |records: &Records<'_>| tolerances::columns(records, &within);
    let Some(beside) = Beside::new(records, terms, solution, columns(records)) else {
        return Ok((Vec::new(), within));
    };
    let Some(without) = held_out(records, &beside, None, axes.len()) else {
        return Ok((Vec::new(), within));
    };
    let on_excerpt = Solution {
        shapes: solution.shapes.clone(),
        weights: solution.weights.clone(),
        solved: {
            let problem = solution.problem(excerpt, terms);
            problem.solve(&problem.shapes_of(&solution.solved), None)?
        },
        stopped: solution.stopped,
    };
    let candidates = match Beside::new(excerpt, terms, &on_excerpt, columns(excerpt)) {
        Some(coarse) => {
            let mut found = coarse.search(axes.len());
            let best = found.first().map_or(0.0, |best| best.gain);
            let mut rank = 0;
            found.retain(|candidate| {
                rank += 1;
                rank <= ALWAYS || candidate.gain > RIVAL * best
            });
            beside.refined(found, STEPS_ON_ALL)
        }
        None => beside.search(axes.len()),
    };
    let mut judged: Vec<(Judged, HeldOut)> = candidates
        .into_iter()
        .take(REFINED)
        .filter_map(|candidate| {
            let columns = beside.columns_of(&candidate);
            let with = held_out(records, &beside, Some(&columns), axes.len())?;
            let judged = worth(records, solution, candidate, &with, &without, is_first);
            Some((judged, with))
        })
        .collect();
    // What is not missing may explain more than what is: a model's small faults grow with the records' length.
    let order = |j: &Judged| (j.is_missing(), j.gain.sum);
    judged.sort_by(|a, b| {
        let (a, b) = (order(&a.0), order(&b.0));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    prefer_fewer_parameters(&mut judged);
    let mut ranked: Vec<Judged> = judged.into_iter().map(|(judged, _)| judged).collect();
    name_equivalents(&mut ranked);
    Ok((ranked, within))
}

fn worth(
    records: &Records<'_>,
    solution: &Solution,
    candidate: Candidate,
    with: &HeldOut,
    without: &HeldOut,
    is_first: bool,
) -> Judged {
    let axes = solution.weights.len();
    // What matters happens on one axis; an effect on both is judged where it does most.
    let own = (0..axes).filter(|&axis| candidate.bound.acts_on(axis));
    let most = own.map(|axis| with.worth(without, axis, records, solution));
    let most = most.fold(Worth::default(), |most, worth| Worth {
        part: most.part.max(worth.part),
        share: most.share.max(worth.share),
    });
    let axis = candidate.bound.axis;
    Judged {
        power_before: without.per_axis()[axis],
        power_after: with.per_axis()[axis],
        reference_force: records.references.force[axis],
        part: most.part,
        share: most.share,
        candidate,
        is_first,
        gain: with.better_than(without),
        equivalent: Vec::new(),
    }
}

/// Among laws that explain nearly as much as the best, the one with the fewest parameters comes first.
fn prefer_fewer_parameters(judged: &mut [(Judged, HeldOut)]) {
    let Some(best) = judged.first() else { return };
    let parameters = |j: &Judged| j.candidate.bound.entry.parameters().len();
    let as_good = |(other, held): &(Judged, HeldOut)| {
        let lost = best.1.better_than(held);
        let as_much = other.gain.sum >= (1.0 - PARSIMONY) * best.0.gain.sum
            && other.power_after <= LEAVES_AS_LITTLE * best.0.power_after;
        other.is_missing() == best.0.is_missing() && (as_much || lost.sum < lost.error)
    };
    let chosen = judged
        .iter()
        .enumerate()
        .filter(|(_, j)| as_good(j))
        .min_by_key(|(at, j)| (parameters(&j.0), *at))
        .map(|(at, _)| at);
    if let Some(chosen) = chosen {
        judged[..=chosen].rotate_right(1);
    }
}

/// Notes for every candidate which others do the same on these records.
fn name_equivalents(ranked: &mut [Judged]) {
    let likeness = |a: &[f64], b: &[f64]| {
        let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let length = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        dot / (length(a) * length(b)).max(f64::MIN_POSITIVE)
    };
    for at in 0..ranked.len() {
        let mine = &ranked[at].candidate;
        let same = ranked.iter().enumerate().filter(|(other, judged)| {
            *other != at
                && judged.candidate.bound.axis == mine.bound.axis
                && likeness(&mine.explained, &judged.candidate.explained) > LIKENESS
        });
        let names = same.map(|(_, judged)| judged.candidate.bound.entry.about.name);
        ranked[at].equivalent = names.collect();
    }
}
