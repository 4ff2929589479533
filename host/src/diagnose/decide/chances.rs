//! How likely each effect is.
//!
//! Blocks are drawn with replacement, and with each draw every set that loses to the best by no
//! more than chance has a part in it.

use super::gains::DRAWS;
use super::rivals::{Judged, Rivals};
use crate::diagnose::criteria;
use crate::diagnose::learner::Taken;
use crate::diagnose::search::rank::ScoredHypothesis;
use crate::model::effects::AxisEffect;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// What a named law leaves differs from joint to joint: the bound on it is drawn, within this
/// factor either way in two of three draws.
const BOUND: f64 = 3.0;
/// Part of the effects that are named in a draw in which more has no name than may have none: they
/// may imitate it.
const IMITATES: f64 = 0.2;

/// What is how likely, as shares of all draws.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chances {
    /// Sets of missing effects, each with its share of the draws.
    votes: Vec<(Vec<AxisEffect>, f64)>,
    /// That nothing is missing.
    pub(crate) nothing: f64,
    /// That something is missing that has no name.
    pub(crate) unknown: f64,
}

impl Chances {
    /// Draws; `blocks` are the block that each log error belongs to, and how many blocks there are.
    /// `weak` are effects that were taken out again, for they explain next to nothing.
    pub(crate) fn draw(
        rivals: &Rivals<'_>,
        (block_of, count): (&[usize], usize),
        taken: &Taken,
        [base, decided, laws]: [&ScoredHypothesis; 3],
        weak: &[AxisEffect],
    ) -> Self {
        let mut chances = Self::default();
        let mut rng = StdRng::seed_from_u64(0);
        let gains = taken.gains();
        let each = 1.0 / DRAWS as f64;
        let named = |at: usize| -> Vec<AxisEffect> {
            let set = rivals.all[at].added.iter();
            set.filter(|bound| !weak.contains(bound)).copied().collect()
        };
        let decided_set = decided.hypothesis.added();
        let is_decided = |set: Vec<AxisEffect>| {
            set.len() == decided_set.len() && set.iter().all(|b| decided_set.contains(b))
        };
        // Where what is as good as the best is all pieces of a shape without a name, what was
        // decided is held against no more than its own like.
        let alike = vec![1.0; block_of.len()];
        let stands = rivals
            .good(&alike)
            .into_iter()
            .any(|at| is_decided(named(at)));
        let good = |weights: &[f64]| match stands {
            true => rivals.good(weights),
            false => rivals.as_good_as(Judged::of(decided), weights),
        };
        for _ in 0..DRAWS {
            let mut drawn = vec![0.0; count];
            for _ in 0..count {
                drawn[rng.random_range(0..count)] += 1.0;
            }
            // Twelve even numbers make a normal one.
            let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            let bound = criteria::UNKNOWN * BOUND.powf(normal);
            let weights: Vec<f64> = block_of.iter().map(|&block| drawn[block]).collect();
            let power = |values: &mut dyn Iterator<Item = f64>| {
                let [sum, whole] = values
                    .zip(&weights)
                    .fold([0.0; 2], |[sum, whole], (v, w)| [sum + v * w, whole + w]);
                sum / whole
            };
            let gain = power(&mut gains.iter().copied());
            let of = |looked: &ScoredHypothesis| {
                power(&mut looked.score.log_errors.iter().map(|e| e.exp()))
            };
            let explained = (of(base) - of(laws)).max(0.0);
            let pieces = (of(laws) - of(decided)).max(0.0);
            let left = taken.before.iter().zip(&taken.after);
            let unnamed = pieces + power(&mut left.map(|(a, b)| a - b)).max(0.0);
            let unknown = gain > criteria::LEAST_DIFFERENCE
                && unnamed.sqrt() > rivals.least_share
                && unnamed > bound * explained;
            chances.unknown += if unknown { each } else { 0.0 };
            for (at, part) in rivals.parts(&good(&weights)) {
                let set = named(at);
                if set.is_empty() && !unknown {
                    chances.nothing += part * each;
                }
                let part = part * each * if unknown { IMITATES } else { 1.0 };
                match chances.votes.iter_mut().find(|(known, _)| *known == set) {
                    Some((_, votes)) => *votes += part,
                    None => chances.votes.push((set, part)),
                }
            }
        }
        chances
    }

    /// Unseen rows speak against an effect: what it explains may be an imitation, and is otherwise
    /// explained by what stands beside it, if anything does.
    pub(crate) fn refute(&mut self, bound: &AxisEffect) {
        for (set, part) in std::mem::take(&mut self.votes) {
            if !set.contains(bound) {
                self.votes.push((set, part));
                continue;
            }
            let mut others = set.clone();
            others.retain(|other| other != bound);
            let rest = part * (1.0 - IMITATES);
            if others.is_empty() {
                self.nothing = (self.nothing + rest).min(1.0 - self.unknown);
            }
            self.votes.extend([(set, part * IMITATES), (others, rest)]);
        }
    }

    /// That one of some effects acts.
    pub(crate) fn any_of(&self, bounds: &[AxisEffect]) -> f64 {
        let votes = self.votes.iter();
        let with = votes.filter(|(set, _)| set.iter().any(|bound| bounds.contains(bound)));
        with.fold(0.0, |sum, (_, part)| sum + part).min(1.0)
    }

    /// Every effect that has a chance, with it.
    pub(crate) fn each(&self) -> Vec<(AxisEffect, f64)> {
        let mut all: Vec<AxisEffect> = Vec::new();
        for bound in self.votes.iter().flat_map(|(set, _)| set) {
            if !all.contains(bound) {
                all.push(*bound);
            }
        }
        let each = all.into_iter();
        each.map(|bound| (bound, self.any_of(&[bound]))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Chances;
    use crate::model::effects::AxisEffect;

    #[test]
    fn what_unseen_rows_refute_is_an_imitation_at_most() {
        let named = |name| AxisEffect::parse(name, &["x"]).unwrap();
        let [dahl, drag] = ["dahl@x", "quadratic_drag@x"].map(named);
        let mut chances = Chances {
            votes: vec![(vec![dahl], 0.5), (vec![dahl, drag], 0.4)],
            nothing: 0.1,
            unknown: 0.0,
        };
        chances.refute(&dahl);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(chances.any_of(&[dahl]), 0.18));
        assert!(near(chances.any_of(&[drag]), 0.4));
        assert!(near(chances.nothing, 0.5));
    }
}
