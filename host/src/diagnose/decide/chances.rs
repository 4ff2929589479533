//! What is more than chance on blocks, and how likely each effect is.
//!
//! Blocks are drawn with replacement, and with each draw every set that loses to the best by no
//! more than chance has a part in it.

use super::rivals::{Judged, Rivals};
use crate::diagnose::criteria;
use crate::diagnose::learner::Taken;
use crate::diagnose::search::rank::ScoredHypothesis;
use crate::model::effects::AxisEffect;
use crate::study::series::mean;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// How often the blocks are drawn anew, with replacement.
const DRAWS: usize = 300;
/// What a named law leaves differs from joint to joint: the bound on it is drawn, within this
/// factor either way in two of three draws.
const BOUND: f64 = 3.0;
/// Part of the effects that are named in a draw in which more has no name than may have none: they
/// may imitate it.
const IMITATES: f64 = 0.2;

/// Mean and its standard error.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = mean(values);
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (square / (count - 1.0).max(1.0) / count).sqrt())
}

/// By how much each log error power falls from one list of blocks to another.
pub(crate) fn falls(from: &[f64], to: &[f64]) -> Vec<f64> {
    let pairs = from.iter().zip(to);
    pairs.map(|(from, to)| from - to).collect()
}

/// Whether log error power is gained by more than chance, from the gain of each block.
pub(crate) fn is_gained(gains: &[f64]) -> bool {
    is_more_than_chance(mean_and_error(gains))
}

/// The same from their mean and its standard error.
fn is_more_than_chance((mean, error): (f64, f64)) -> bool {
    mean > error.max(criteria::LEAST_DIFFERENCE)
}

/// Whether unseen blocks speak against an effect, from the gain of each block that let it in and of
/// each unseen one.
///
/// Blocks of the training records have let an effect in, by more than chance, so a difference
/// within the scatter of the unseen blocks is no reason to take it out. But it was also the best of
/// many that were tried on those blocks, and the unseen ones were not chosen by: what just
/// beat chance there has to be confirmed here. So an effect goes where the unseen blocks gain
/// without it by more than chance, and where both together, each with half the say whatever the
/// number of its blocks, no longer gain with it by more than chance.
pub(crate) fn is_refuted(seen: &[f64], unseen: &[f64]) -> bool {
    let ((mean, error), (of_unseen, error_of_unseen)) =
        (mean_and_error(seen), mean_and_error(unseen));
    let both = (0.5 * (mean + of_unseen), 0.5 * error.hypot(error_of_unseen));
    is_more_than_chance((-of_unseen, error_of_unseen)) || !is_more_than_chance(both)
}

/// Whether the error power of all blocks together rises from one list of their logs to another:
/// what a user sees of an effect that halves small errors in most blocks and doubles large ones in
/// a few.
pub(crate) fn is_raised(from: &[f64], to: &[f64]) -> bool {
    let power = |logs: &[f64]| logs.iter().map(|log| log.exp()).sum::<f64>();
    (power(to) / power(from)).ln() > criteria::LEAST_DIFFERENCE
}

/// How likely it is that blocks gain, from the gain of each: the share of draws in which they do.
pub(crate) fn chance_of_gain(gains: &[f64]) -> f64 {
    let mut rng = StdRng::seed_from_u64(0);
    let mut drawn = || {
        let draws = (0..gains.len()).map(|_| gains[rng.random_range(0..gains.len())]);
        draws.sum::<f64>() / gains.len() as f64
    };
    let gained = (0..DRAWS).filter(|_| drawn() > criteria::LEAST_DIFFERENCE);
    gained.count() as f64 / DRAWS as f64
}

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
    use super::{Chances, is_gained, is_raised, is_refuted};
    use crate::model::effects::AxisEffect;
    use jointwatch_shared::effect::Entry;

    fn bound(name: &str) -> AxisEffect {
        AxisEffect {
            input: None,
            entry: Entry::named(name).expect("an effect of the library"),
            axis: 0,
        }
    }

    #[test]
    fn unseen_blocks_speak_against_an_effect_by_more_than_their_scatter() {
        let blocks = |mean: f64, scatter: f64| -> Vec<f64> {
            let signs = (0..24).map(|b| [1.0, -1.0][b % 2]);
            signs.map(|sign| mean + scatter * sign).collect()
        };
        let clear = blocks(1.0, 0.5);
        // Larger errors without a meaning: the standard error is 0.1.
        assert!(!is_refuted(&clear, &blocks(-0.05, 0.5)));
        assert!(is_refuted(&clear, &blocks(-0.2, 0.5)));
        // What just beat chance among many is confirmed or goes.
        let faint = blocks(0.05, 0.2);
        assert!(is_gained(&faint));
        assert!(is_refuted(&faint, &blocks(0.0, 0.2)));
        assert!(!is_refuted(&faint, &blocks(0.05, 0.2)));
    }

    #[test]
    fn what_doubles_a_few_large_errors_raises_them_though_most_blocks_gain() {
        let of = |quiet: f64, loud: f64| [vec![quiet; 20], vec![loud; 2]].concat();
        let (without, with) = (of(-12.0, -4.0), of(-13.4, -2.6));
        let gains: Vec<f64> = without.iter().zip(&with).map(|(b, a)| b - a).collect();
        assert!(is_gained(&gains) && !is_refuted(&gains, &gains));
        assert!(is_raised(&without, &with) && !is_raised(&with, &without));
        assert!(!is_raised(&without, &without));
    }

    #[test]
    fn what_unseen_rows_refute_is_an_imitation_at_most() {
        let [dahl, drag] = ["dahl", "quadratic_drag"].map(bound);
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
