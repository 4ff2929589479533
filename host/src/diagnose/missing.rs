//! Which physical effects a model lacks: search, add, search again, until nothing is missing.

use super::held_out::{MIN_BLOCKS, blocks};
use super::judge::{Judged, PARSIMONY, judge};
use super::patterns::{self, LeftOver, Pattern};
use super::rivals::Arena;
use super::tolerances;
use crate::assess::noise_floor::{floors, rested};
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::{Solved, cost};
use crate::fit::effects::unknowns::{is_physical, shapes};
use crate::fit::effects::{Solution, solve};
use crate::fit::errors::Sums;
use crate::model::effects::Bound;
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::text::error::{Error, Result};

/// Rows of all records together on which every effect's starting values are scanned; the promising ones see all rows.
const MAX_SCANNED: usize = 36_000;
/// Rows that the band leaves out of so many are not needed for a scan either, but for every second one: the excerpt then has
/// twice the rows that the band needs.
const MIN_THINNED: usize = 4;
/// The most effects that are added.
const MAX_ADDED: usize = 4;
/// The most models that are looked at on the way.
const MAX_ROUNDS: usize = 8;
/// Candidates that gain this part of what the first one does are its rivals,
const CLOSE: f64 = 0.75;
/// and so many of them are fitted with the whole model.
const REFITTED: usize = 4;
/// Where nobody knows how loud the noise is, an effect has to explain this part of what was left in the beginning: every model of a
/// real joint leaves something, and without a floor nothing says where to stop.
const LATER: f64 = 0.01;
/// An effect may make the error on unseen records larger by this part: its values have errors too.
const WORSE: f64 = 0.02;
/// Another effect takes an added one's place when what is left over falls by this factor at least, as power.
const SWAPPED: f64 = 1.1;

/// A model on the way to one that lacks nothing.
pub(crate) struct Round {
    /// The terms of the model.
    pub(crate) terms: Vec<Bound>,
    /// Their best values.
    pub(crate) solution: Solution,
    /// Candidates, best first; the first is missing if anything is.
    pub(crate) ranked: Vec<Judged>,
    /// What instruments do wrong within their tolerances.
    pub(crate) within: Vec<Bound>,
}

/// How a search went.
pub(crate) struct Search {
    /// The models, from the one that was brought to the one that lacks nothing more.
    pub(crate) rounds: Vec<Round>,
    /// What seemed to be missing last, but made the error on records that were not learnt from larger.
    pub(crate) refuted: Option<Refuted>,
    /// How what the last model leaves over follows the motion, one per axis on which it does.
    pub(crate) patterns: Vec<Pattern>,
}

/// An effect that other records speak against.
pub(crate) struct Refuted {
    pub(crate) bound: Bound,
    /// The axis on which it makes the error larger.
    pub(crate) axis: usize,
    /// RMS error over RMS force there in the records that were not learnt from, without and with it.
    pub(crate) errors: [f64; 2],
}

/// What became of the best candidate.
enum Chosen {
    /// The terms with it, and their best values.
    Added(Vec<Bound>, Box<Solution>),
    Refuted(Refuted),
    /// There was none.
    Nobody,
}

/// The records that a search learns from, and those by which it is held to account.
struct Searcher<'a> {
    axes: &'a [Axis],
    records: Records<'a>,
    /// Every second row of the middle of the records, for a first look.
    excerpt: Records<'a>,
    unseen: Option<&'a Records<'a>>,
    motions: &'a [&'a Motion],
    low_pass: &'a [f64],
    base: usize,
}

/// Searches for missing effects beside a base, whose fit starts from `values` where they are known.
///
/// Effects are added one at a time, the one that explains most first. Each time, those that were added before are asked
/// whether they are still needed beside the newer ones, and whether another one would now do better in their place: of two effects
/// that are missing the first to be named is sometimes one that does a little of both. `unseen` are records that are not learnt from;
/// an effect that makes the error there larger is not added.
///
/// # Errors
/// As the fit of the terms; records too short to hold out blocks.
pub(crate) fn search(
    axes: &[Axis],
    motions: &[&Motion],
    unseen: Option<&Records<'_>>,
    low_pass: &[f64],
    base: &[Bound],
    values: Option<Vec<Vec<f64>>>,
) -> Result<Search> {
    let records = Records::new(axes, motions, low_pass);
    let each = MAX_SCANNED / motions.len().max(1);
    let step = if records.every >= MIN_THINNED { 2 } else { 1 };
    let thinned_taps = thinned(low_pass, step);
    let excerpts: Vec<Motion> = motions.iter().map(|m| m.middle(each).every(step)).collect();
    let excerpts: Vec<&Motion> = excerpts.iter().collect();
    let count = blocks(&records).len();
    if count < MIN_BLOCKS {
        return Err(Error::data(format!(
            "the training records make {count} blocks of a second where {MIN_BLOCKS} are needed to tell an effect from chance: \
             record longer"
        )));
    }
    let from = values.map(|values| shapes_of(&records, base, &values));
    let solution = solve(&records, axes, base, from)?;
    let mut searcher = Searcher {
        axes,
        excerpt: Records::new(axes, &excerpts, &thinned_taps),
        records,
        unseen,
        motions,
        low_pass,
        base: base.len(),
    };
    let mut round = searcher.judged(base.to_vec(), solution)?;
    let mut rounds: Vec<Round> = Vec::new();
    let mut refuted = None;
    let rested = rested(axes.len(), motions);
    while rounds.len() < MAX_ROUNDS {
        let added = round.terms.len() - searcher.base;
        let before = rounds.first().unwrap_or(&round).solution.solved.cost;
        let worth_it = |best: &Judged| {
            let next = round.solution.weights.iter();
            let first = rounds.first().unwrap_or(&round).solution.weights.iter();
            let axis = best.candidate.bound.axis;
            let scale = first
                .zip(next)
                .nth(axis)
                .map_or(1.0, |(a, b)| (a / b).powi(2));
            rested[axis] || scale * best.gain.sum >= LATER * before
        };
        let first = round.ranked.first().filter(|best| best.is_missing());
        if added >= MAX_ADDED || !first.is_some_and(worth_it) {
            break;
        }
        let mut next = match searcher.chosen(&mut round)? {
            Chosen::Added(terms, solution) => searcher.judged(terms, *solution)?,
            Chosen::Refuted(by) => {
                refuted = Some(by);
                break;
            }
            Chosen::Nobody => break,
        };
        for _ in 0..added {
            match searcher.reconsidered(&next)? {
                Some(better) => next = better,
                None => break,
            }
        }
        rounds.push(std::mem::replace(&mut round, next));
    }
    let Round {
        terms,
        solution,
        within,
        ..
    } = &round;
    let left = LeftOver::new(&searcher.records, terms, solution, within);
    let explained = searcher.explained(rounds.first().unwrap_or(&round), &round);
    let patterns = match left {
        Some(left) => patterns::found_in(&left, &terms[searcher.base..], &explained),
        None => Vec::new(),
    };
    rounds.push(round);
    Ok(Search {
        rounds,
        refuted,
        patterns,
    })
}

impl Searcher<'_> {
    /// What the effects explain by which a round's model is wider than another's, RMS beside the RMS force of each axis.
    fn explained(&self, before: &Round, after: &Round) -> Vec<f64> {
        let rows = self.records.rows_per_axis();
        let power = |round: &Round| -> Vec<f64> {
            let axes = round.solution.solved.residual.chunks_exact(rows);
            axes.map(|left| left.iter().map(|e| e * e).sum::<f64>() / rows as f64)
                .collect()
        };
        let forces = self.records.references.force.iter();
        let fell = power(before).into_iter().zip(power(after)).zip(forces);
        fell.map(|((before, after), force)| (before - after).max(0.0).sqrt() / force)
            .collect()
    }

    /// A solved model with its candidates.
    fn judged(&mut self, terms: Vec<Bound>, solution: Solution) -> Result<Round> {
        let (model, inertia) = solution.in_si(&terms, self.axes);
        self.records.predict(&model, &inertia);
        self.excerpt.predict(&model, &inertia);
        let is_first = terms.len() == self.base;
        let (records, excerpt) = (&self.records, &self.excerpt);
        let (ranked, within) = judge(records, excerpt, &terms, &solution, self.axes, is_first)?;
        Ok(Round {
            terms,
            solution,
            ranked,
            within,
        })
    }

    /// A round's model with the best of its candidates, unless that makes the error on unseen records larger.
    ///
    /// Candidates were judged beside the model as it stood. What a law is worth shows when the whole model is fitted anew with
    /// it, so the rivals for the first place are; the one that is chosen comes first in the round's ranking from then on.
    fn chosen(&mut self, round: &mut Round) -> Result<Chosen> {
        let Some(first) = round.ranked.first() else {
            return Ok(Chosen::Nobody);
        };
        let best = first.gain.sum;
        // Only where the first of them acts: beside what another axis leaves everything looks alike.
        let acts = |j: &Judged, axis: usize| j.candidate.bound.acts_on(axis);
        let weights = round.solution.weights.iter().enumerate();
        let own: Vec<f64> = weights
            .map(|(axis, weight)| if acts(first, axis) { *weight } else { 0.0 })
            .collect();
        let rivals = round.ranked.iter().enumerate();
        let meets = |j: &Judged| (0..self.axes.len()).any(|a| acts(j, a) && acts(first, a));
        let rivals =
            rivals.filter(|(_, j)| j.is_missing() && j.gain.sum >= CLOSE * best && meets(j));
        let rivals: Vec<(usize, Bound, &Vec<f64>)> = rivals
            .take(REFITTED)
            .map(|(at, j)| (at, j.candidate.bound, &j.candidate.values))
            .collect();
        // The search looks at what is predicted; a fit corrects what was logged.
        self.records.as_logged();
        self.excerpt.as_logged();
        let wider = |bound: Bound, values: &[f64]| {
            let mut terms = round.terms.clone();
            terms.push(bound);
            let mut all = round.solution.solved.values.clone();
            all.push(values.to_vec());
            let from = shapes_of(&self.records, &terms, &all);
            (terms, from)
        };
        let rivals = rivals.iter().map(|(at, bound, values)| {
            let (terms, from) = wider(*bound, values);
            (*at, terms, from)
        });
        let rivals: Vec<(usize, Vec<Bound>, Vec<f64>)> = rivals.collect();
        let arena = Arena {
            axes: self.axes,
            records: &self.records,
            excerpt: &self.excerpt,
            unseen: self.unseen,
            noise: self.noise(round, &own),
            round,
            own,
        };
        let Some((at, terms, from)) = arena.best_of(rivals)? else {
            return Ok(Chosen::Nobody);
        };
        let solution = arena.solved(&terms, from)?;
        // A law that only fits with values that it cannot have is not what acts.
        let mut own = terms.iter().zip(&solution.solved.values);
        let own = own.next_back();
        if !own.is_some_and(|(bound, values)| is_physical(bound, values, &self.records)) {
            return Ok(Chosen::Nobody);
        }
        round.ranked[..=at].rotate_right(1);
        let bound = round.ranked[0].candidate.bound;
        let worse = self.unseen.and_then(|unseen| {
            let within = &round.within;
            let before = relative_errors(unseen, &round.terms, &round.solution.solved, within);
            let after = relative_errors(unseen, &terms, &solution.solved, within);
            let own = before.into_iter().zip(after).enumerate();
            let mut own = own.filter(|(axis, _)| bound.acts_on(*axis));
            own.find(|(_, (before, after))| *after > (1.0 + WORSE) * before)
        });
        Ok(match worse {
            Some((axis, (before, after))) => Chosen::Refuted(Refuted {
                bound,
                axis,
                errors: [before, after],
            }),
            None => Chosen::Added(terms, solution.into()),
        })
    }

    /// Σ (weighted noise)², as far as a round's model shows it.
    fn noise(&self, round: &Round, weights: &[f64]) -> f64 {
        let (terms, inertia) = round.solution.in_si(&round.terms, self.axes);
        let floors = floors(self.axes, self.motions, self.low_pass, &terms, &inertia);
        let rows = self.records.rows_per_axis() as f64;
        let floors = floors.iter().zip(weights);
        floors
            .map(|(floor, w)| rows * (w * floor.rms).powi(2))
            .sum()
    }

    /// The model without one of the effects that were added, or with another in its place, if the model is as good or better for it.
    fn reconsidered(&mut self, round: &Round) -> Result<Option<Round>> {
        let power = |records: &Records<'_>, solution: &Solution| {
            cost(records, &solution.solved.residual, &round.solution.weights)
        };
        let present = power(&self.records, &round.solution);
        for index in self.base..round.terms.len() - 1 {
            let mut terms = round.terms.clone();
            let removed = terms.remove(index);
            let mut values = round.solution.solved.values.clone();
            values.remove(index);
            let from = shapes_of(&self.records, &terms, &values);
            let solution = solve(&self.records, self.axes, &terms, Some(from))?;
            let mut without = self.judged(terms, solution)?;
            if !without.ranked.first().is_some_and(Judged::is_missing) {
                return Ok(Some(without));
            }
            let Chosen::Added(terms, solution) = self.chosen(&mut without)? else {
                continue;
            };
            if terms.last() == Some(&removed) {
                continue;
            }
            let left = power(&self.records, &solution);
            let without = power(&self.records, &without.solution);
            if without - left > (without - present) * (1.0 + PARSIMONY) && left * SWAPPED < present
            {
                return Ok(Some(self.judged(terms, *solution)?));
            }
        }
        Ok(None)
    }
}

/// RMS error over RMS force per axis on other records than a model's terms were solved for; without what instruments that do
/// something wrong `within` their tolerances make of it.
pub(super) fn relative_errors(
    records: &Records<'_>,
    terms: &[Bound],
    solved: &Solved,
    within: &[Bound],
) -> Vec<f64> {
    let mut residual = records.measured.clone();
    let mut take = |column: &[f64], factor: f64| {
        for (r, c) in residual.iter_mut().zip(column) {
            *r -= factor * c;
        }
    };
    for (bound, values) in terms.iter().zip(&solved.values) {
        take(&records.force(bound, values), 1.0);
    }
    for (column, inertia) in records.accelerations.iter().zip(&solved.inertia) {
        if let (Some(column), Some(inertia)) = (column, inertia) {
            take(column, *inertia);
        }
    }
    for (bound, values) in terms.iter().zip(&solved.values) {
        records.take_out(bound, values, &mut residual);
    }
    tolerances::take_out(records, within, &mut residual);
    let rows = records.rows_per_axis();
    let axes = residual
        .chunks_exact(rows)
        .zip(records.measured.chunks_exact(rows));
    axes.map(|(error, force)| Sums::of(error, force).relative_error())
        .collect()
}

/// A symmetric low-pass for every `step`-th row, with the same gain where it lets everything through.
fn thinned(taps: &[f64], step: usize) -> Vec<f64> {
    let first = (taps.len() / 2) % step;
    let kept: Vec<f64> = taps.iter().skip(first).step_by(step).copied().collect();
    let gain = taps.iter().sum::<f64>() / kept.iter().sum::<f64>();
    kept.into_iter().map(|tap| tap * gain).collect()
}

/// The shape unknowns of terms, read from their parameters.
pub(super) fn shapes_of(records: &Records<'_>, terms: &[Bound], values: &[Vec<f64>]) -> Vec<f64> {
    let unknowns = shapes(terms, &records.references);
    let owners = unknowns.iter().map(|u| u.places[0]);
    owners.map(|(term, index)| values[term][index]).collect()
}
