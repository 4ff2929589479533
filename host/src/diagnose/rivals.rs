//! Which of several candidates that explain nearly as much is the one that is missing.
//!
//! Candidates are judged beside the model as it stands. What a law is worth shows when the whole model is fitted anew with it: so the
//! rivals for the first place are. Where all of them leave much more than noise, the model itself may stand in a wrong valley, as a
//! clearance does that has taken over what a stop should do; then the fits begin anew from every law's own starting values.

use super::judge::{LEAVES_AS_LITTLE, PARSIMONY, WRONG_BY};
use super::missing::{Round, relative_errors};
use super::verdict::DISCREPANCY;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::{Problem, cost};
use crate::fit::effects::starts::starts;
use crate::fit::effects::unknowns::{is_physical, shapes};
use crate::fit::effects::{Solution, solve};
use crate::model::effects::Bound;
use crate::study::Axis;
use crate::text::error::{Result, in_order};
use rayon::prelude::*;

/// Steps of a fit that is to tell rivals apart,
const STEPS: usize = 5;
/// and of one that begins anew.
const STEPS_ANEW: usize = 12;
/// So many times the power of the noise is much to leave.
const MUCH: f64 = 2.0;
/// By this part of what is left a law with more parameters is better without being right.
const NOISE: f64 = 0.01;
/// One that leaves less all the same, by this part of what is left,
const LEAVES_LESS: f64 = 0.0025;
/// and explains more, by this part of what it explains, is right where unseen records
const EXPLAINS_MORE: f64 = 0.001;
/// say so too: by this part of the power that is left there.
const BORNE_OUT: f64 = 0.007;
/// Only a law that leaves next to nothing but noise, this many times its RMS, is right: where all leave more, the simplest will do.
const NEAR_NOISE: f64 = 1.3;
/// Of laws that all leave much, one that leaves this part more power on unseen records than another is no worse.
const AS_WRONG: f64 = 0.05;

/// A candidate: its place in the ranking, the model's terms with it, and the shapes from which a fit of them starts.
pub(super) type Rival = (usize, Vec<Bound>, Vec<f64>);

/// Where rivals meet.
pub(super) struct Arena<'a> {
    pub(super) axes: &'a [Axis],
    /// What is learnt from, with the forces that were logged.
    pub(super) records: &'a Records<'a>,
    /// The same, every second row of their middle.
    pub(super) excerpt: &'a Records<'a>,
    /// Other records, where there are any.
    pub(super) unseen: Option<&'a Records<'a>>,
    /// The model as it stands.
    pub(super) round: &'a Round,
    /// Weights of the axes on which rivals act; 0 for the others: beside what another axis leaves everything looks alike.
    pub(super) own: Vec<f64>,
    /// Σ (weighted noise)², as far as the model shows it.
    pub(super) noise: f64,
}

/// What a model with a candidate leaves over where the candidate acts.
struct Left {
    /// Place in the ranking.
    at: usize,
    /// Σ (residual·weight)² on the records that were learnt from.
    learnt: f64,
    /// Σ of the squared relative errors on other records, where there are any.
    unseen: Option<f64>,
    /// Shapes of the model with it.
    shapes: Vec<f64>,
    /// Whether it is the law that it is called, and not another one in disguise.
    is_physical: bool,
}

impl Left {
    /// Whether other records speak for it rather than for another.
    fn holds_better_than(&self, other: &Self) -> bool {
        matches!((self.unseen, other.unseen), (Some(own), Some(others)) if own < others)
    }
}

impl Arena<'_> {
    /// The best of several candidates: its place in the ranking, the model's terms with it, and shapes from which a fit is to start. Each
    /// comes with the same. Nothing where there is none.
    pub(super) fn best_of(&self, mut rivals: Vec<Rival>) -> Result<Option<Rival>> {
        if rivals.len() < 2 {
            return Ok(rivals.pop());
        }
        let all = rivals
            .par_iter()
            .map(|(at, terms, from)| self.left(*at, terms, from, STEPS));
        let mut all = in_order(all)?;
        if all.iter().all(|left| self.is_much(left.learnt)) {
            let anew = rivals
                .par_iter()
                .map(|(at, terms, _)| match self.anew(terms)? {
                    Some(from) => self.left(*at, terms, &from, STEPS).map(Some),
                    None => Ok(None),
                });
            let anew = in_order(anew)?;
            for (left, found) in all.iter_mut().zip(anew) {
                match found {
                    Some(found) if found.learnt < left.learnt => *left = found,
                    _ => {}
                }
            }
        }
        all.retain(|left| left.is_physical);
        if all.is_empty() {
            return Ok(None);
        }
        let before = cost(
            self.records,
            &self.round.solution.solved.residual,
            &self.own,
        );
        let chosen = self.simplest(before, all);
        let place = rivals.iter().position(|(at, ..)| *at == chosen.at);
        Ok(place.map(|place| {
            let (at, terms, _) = rivals.swap_remove(place);
            (at, terms, chosen.shapes)
        }))
    }

    /// The shapes from which terms leave least of the excerpt, among every start that their laws have.
    fn anew(&self, terms: &[Bound]) -> Result<Option<Vec<f64>>> {
        if terms.iter().any(|term| term.entry.is_per_record()) {
            return Ok(None);
        }
        let unknowns = shapes(terms, &self.excerpt.references);
        let problem = Problem {
            records: self.excerpt,
            shapes: &unknowns,
            terms,
            weights: self.round.solution.weights.clone(),
        };
        let from = starts(self.excerpt, terms, &unknowns, self.axes.len());
        let all = from
            .par_iter()
            .map(|from| Ok(problem.descend(from, STEPS_ANEW)?.0));
        let all = in_order(all)?;
        let best = all.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(best.map(|best| problem.shapes_of(best)))
    }

    /// The model with one more term, solved from some shapes, and anew where that leaves much.
    pub(super) fn solved(&self, terms: &[Bound], from: Vec<f64>) -> Result<Solution> {
        let solve = |from| solve(self.records, self.axes, terms, Some(from));
        let solution = solve(from)?;
        let power = |s: &Solution| cost(self.records, &s.solved.residual, &self.own);
        if self.is_much(power(&solution))
            && let Some(from) = self.anew(terms)?
        {
            let anew = solve(from)?;
            if power(&anew) < power(&solution) {
                return Ok(anew);
            }
        }
        Ok(solution)
    }

    /// Whether what is left is much more than noise, and than what any model of a real joint is wrong by.
    fn is_much(&self, left: f64) -> bool {
        let rows = self.records.rows_per_axis() as f64;
        let forces = self.own.iter().zip(&self.records.references.force);
        let wrong: f64 = forces
            .map(|(weight, force)| rows * (weight * DISCREPANCY * force).powi(2))
            .sum();
        left > MUCH * self.noise + wrong
    }

    /// What terms leave over after so many steps from some shapes.
    fn left(&self, at: usize, own_terms: &[Bound], from: &[f64], steps: usize) -> Result<Left> {
        let round = self.round;
        let mut terms = own_terms.to_vec();
        terms.extend(&round.within);
        let problem = Problem {
            records: self.records,
            shapes: &shapes(&terms, &self.records.references),
            terms: &terms,
            weights: round.solution.weights.clone(),
        };
        let (solved, _) = problem.descend(from, steps)?;
        let unseen = self.unseen.map(|unseen| {
            let errors = relative_errors(unseen, own_terms, &solved, &round.within);
            let own = errors.iter().zip(&self.own);
            let own = own.filter(|(_, weight)| **weight > 0.0);
            own.map(|(error, _)| error * error).sum()
        });
        let last = own_terms.iter().zip(&solved.values).next_back();
        Ok(Left {
            at,
            is_physical: last
                .is_some_and(|(bound, values)| is_physical(bound, values, self.records)),
            learnt: cost(self.records, &solved.residual, &self.own),
            unseen,
            shapes: problem.shapes_of(&solved),
        })
    }

    /// Of candidates that leave little the one with the fewest parameters.
    ///
    /// A law with fewer parameters may leave more on the records that were learnt from when it leaves less on others: what
    /// bends a few more ways follows the small faults of a model, and goes astray where it was not fitted. One that leaves
    /// more there than models of real joints are wrong by is out, unless the others leave nearly as much. The other way round, a law with
    /// more parameters is worth them where it is a little better on both and leaves little but noise.
    fn simplest(&self, before: f64, mut left: Vec<Left>) -> Left {
        let unseen = left.iter().filter_map(|left| left.unseen);
        let least_unseen = unseen.fold(f64::INFINITY, f64::min);
        left.retain(|left| {
            left.unseen.is_none_or(|unseen| {
                let more = unseen - least_unseen;
                more <= WRONG_BY * WRONG_BY || more <= AS_WRONG * least_unseen
            })
        });
        left.sort_by(|a, b| a.learnt.total_cmp(&b.learnt));
        let best = &left[0];
        let least = best.learnt;
        let as_good = |left: &Left| {
            let as_much = before - left.learnt >= (1.0 - PARSIMONY) * (before - least);
            let as_little = left.learnt <= LEAVES_AS_LITTLE * least || left.holds_better_than(best);
            let nearly = (as_much && as_little) || left.learnt <= (1.0 + NOISE) * least;
            let unseen = matches!((left.unseen, best.unseen), (Some(own), Some(least)) if own > (1.0 + BORNE_OUT) * least);
            let outdone = unseen
                && least <= NEAR_NOISE * NEAR_NOISE * self.noise
                && left.learnt > (1.0 + LEAVES_LESS) * least
                && before - left.learnt < (1.0 - EXPLAINS_MORE) * (before - least);
            nearly && !outdone
        };
        let parameters = |left: &Left| {
            let bound = &self.round.ranked[left.at].candidate.bound;
            bound.entry.parameters().len()
        };
        let good = (0..left.len()).filter(|&place| as_good(&left[place]));
        let chosen = good.min_by_key(|&place| parameters(&left[place]));
        left.swap_remove(chosen.unwrap_or(0))
    }
}
