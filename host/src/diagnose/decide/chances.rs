//! Which sets of effects the blocks cannot tell apart, which of them is taken, and how likely each
//! effect is.
//!
//! Blocks are drawn with replacement, and with each draw every set that loses to the best by no
//! more than chance has a part in it: of two such sets the one with a number more has half the
//! part. A set that holds another one of them has none, for it says nothing new.

use crate::diagnose::criteria;
use crate::diagnose::learner::Taken;
use crate::diagnose::search::bench::Bench;
use crate::diagnose::search::rank::ScoredHypothesis;
use crate::model::effects::AxisEffect;
use crate::study::series::{dot, mean};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::cmp::Ordering;

/// How often the blocks are drawn anew, with replacement.
const DRAWS: usize = 300;
/// Part of a set that has a number more than another one that is as good.
const PER_NUMBER: f64 = 0.5;
/// What a named law leaves differs from joint to joint: the bound on it is drawn, within this
/// factor either way in two of three draws.
const BOUND: f64 = 3.0;
/// Part of the effects that are named in a draw in which more has no name than may have none: they
/// may imitate it.
const IMITATES: f64 = 0.2;

/// Mean log error power by which a law is better than another in its place, however little it
/// explains: it leaves half of the error power. That is less than what it takes to add one: a
/// second effect imitates whatever the first is wrong by.
const IN_PLACE: f64 = std::f64::consts::LN_2;

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

/// Sets of effects that are held against each other, the base among them.
pub(crate) struct Rivals<'a> {
    all: Vec<Judged<'a>>,
    /// Of each, the effects with a memory that nothing in the records has shown.
    unseen_memories: Vec<usize>,
    /// RMS beside the RMS force that counts at least.
    least_share: f64,
}

impl<'a> Rivals<'a> {
    /// Reads them, on this axis.
    pub(crate) fn of(looked: &[&'a ScoredHypothesis], bench: &Bench<'_>) -> Self {
        let all = || looked.iter().copied();
        let unseen = |l: &ScoredHypothesis| {
            let added = l.hypothesis.added().iter();
            let remember = added.filter(|bound| !bound.entry.state_bounds.is_empty());
            if bench.reverses { 0 } else { remember.count() }
        };
        Self {
            all: all().map(Judged::of).collect(),
            unseen_memories: all().map(unseen).collect(),
            least_share: bench.least_share,
        }
    }

    fn mean(&self, at: usize, weights: &[f64]) -> f64 {
        dot(self.all[at].errors, weights) / weights.iter().sum::<f64>()
    }

    /// Those that lose to the best, and to the best of as many effects, by no more than chance, or
    /// by less than every model of a real joint is wrong by, unless it is clearly better; with
    /// blocks weighted.
    pub(crate) fn good(&self, weights: &[f64]) -> Vec<usize> {
        let all = 0..self.all.len();
        let best = self.best(weights, |_| true);
        let most = self.all.iter().map(|set| set.added.len()).max();
        let best_of_size: Vec<_> = (0..=most.unwrap_or(0))
            .map(|size| self.best(weights, |set| set.added.len() == size))
            .collect();
        let good = |at: &usize| {
            let set = self.all[*at];
            let mut ahead = best.into_iter().chain(best_of_size[set.added.len()]);
            ahead.all(|other| self.is_as_good(set, other, weights))
        };
        all.filter(good).collect()
    }

    /// The best of some, with blocks weighted.
    fn best(&self, weights: &[f64], of: impl Fn(&Judged<'_>) -> bool) -> Option<Judged<'a>> {
        let all = (0..self.all.len()).filter(|&at| of(&self.all[at]));
        let means = all.map(|at| (at, self.mean(at, weights)));
        let best = means.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(at, _)| self.all[at])
    }

    /// Whether a set loses no more than that to another one.
    fn is_as_good(&self, set: Judged<'_>, other: Judged<'_>, weights: &[f64]) -> bool {
        let whole: f64 = weights.iter().sum();
        let behind = falls(set.errors, other.errors);
        let mean = dot(&behind, weights) / whole;
        let pairs = behind.iter().zip(weights);
        let square: f64 = pairs.map(|(b, w)| w * (b - mean).powi(2)).sum();
        let chance = (square / whole / whole)
            .sqrt()
            .max(criteria::LEAST_DIFFERENCE);
        let small = set.power - other.power < self.least_share.powi(2);
        let in_place = !set.added.is_empty() && set.added.len() == other.added.len();
        let clearly = if in_place {
            IN_PLACE
        } else {
            criteria::CLEARLY
        };
        mean <= chance || (small && mean < clearly)
    }

    /// Whether what was looked at loses no more than that to `other`.
    pub(crate) fn keeps_up(&self, looked: &ScoredHypothesis, other: &ScoredHypothesis) -> bool {
        let [looked, other] = [looked, other].map(Judged::of);
        self.is_as_good(looked, other, &vec![1.0; other.errors.len()])
    }

    /// The sets that are as good as this one and have fewer numbers, the simplest first.
    pub(crate) fn simpler(&self, than: &ScoredHypothesis) -> Vec<usize> {
        let other = Judged::of(than);
        let weights = vec![1.0; other.errors.len()];
        let fewer = (0..self.all.len()).filter(|&at| self.all[at].numbers < other.numbers);
        let mut good: Vec<usize> = fewer
            .filter(|&at| self.is_as_good(self.all[at], other, &weights))
            .collect();
        good.sort_by(|a, b| self.by_simplicity(*a, *b, &weights));
        good
    }

    /// That with the fewest numbers first, then that with the fewest memories that were not seen,
    /// then that with the fewest effects, then that with the least error.
    fn by_simplicity(&self, a: usize, b: usize, weights: &[f64]) -> Ordering {
        let order = |at: usize| {
            let set = &self.all[at];
            (set.numbers, self.unseen_memories[at], set.added.len())
        };
        let errors = || self.mean(a, weights).total_cmp(&self.mean(b, weights));
        order(a).cmp(&order(b)).then_with(errors)
    }

    /// The simplest of some.
    pub(crate) fn simplest(&self, of: &[usize], weights: &[f64]) -> usize {
        let simplest = of
            .iter()
            .min_by(|a, b| self.by_simplicity(**a, **b, weights));
        simplest.copied().unwrap_or(0)
    }

    /// Of some, those that hold no other one of them, with the part that each has.
    fn parts(&self, of: &[usize]) -> Vec<(usize, f64)> {
        let holds = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|at| self.all[at].added);
            b.len() < a.len() && b.iter().all(|bound| a.contains(bound))
        };
        let new = of.iter().filter(|&&a| !of.iter().any(|&b| holds(a, b)));
        let least = new.clone().map(|&a| self.all[a].numbers).min().unwrap_or(0);
        let parts: Vec<(usize, f64)> = new
            .map(|&a| (a, PER_NUMBER.powi((self.all[a].numbers - least) as i32)))
            .collect();
        let whole: f64 = parts.iter().map(|(_, part)| part).sum();
        parts
            .into_iter()
            .map(|(a, part)| (a, part / whole))
            .collect()
    }

    /// Effects that stand alone in one of these sets.
    pub(crate) fn sole(&self, of: &[usize]) -> Vec<AxisEffect> {
        let sets = of.iter().map(|&at| self.all[at].added);
        sets.filter(|set| set.len() == 1)
            .map(|set| set[0])
            .collect()
    }
}

/// What a set of effects is judged by.
#[derive(Clone, Copy)]
struct Judged<'a> {
    /// The effects that it adds to the base.
    added: &'a [AxisEffect],
    /// Log error power of every judged block.
    errors: &'a [f64],
    /// Power that it leaves.
    power: f64,
    /// Strengths and shape parameters.
    numbers: usize,
}

impl<'a> Judged<'a> {
    fn of(looked: &'a ScoredHypothesis) -> Self {
        Self {
            added: looked.hypothesis.added(),
            errors: &looked.score.log_errors,
            power: looked.score.error.powi(2),
            numbers: looked.score.numbers,
        }
    }
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
            let named = (of(base) - of(laws)).max(0.0);
            let pieces = (of(laws) - of(decided)).max(0.0);
            let left = taken.before.iter().zip(&taken.after);
            let unnamed = pieces + power(&mut left.map(|(a, b)| a - b)).max(0.0);
            let unknown = gain > criteria::LEAST_DIFFERENCE
                && unnamed.sqrt() > rivals.least_share
                && unnamed > bound * named;
            chances.unknown += if unknown { each } else { 0.0 };
            for (at, part) in rivals.parts(&rivals.good(&weights)) {
                let set = rivals.all[at]
                    .added
                    .iter()
                    .filter(|bound| !weak.contains(bound));
                let set: Vec<AxisEffect> = set.copied().collect();
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
    use super::{Chances, Judged, Rivals, is_gained, is_raised, is_refuted};
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

    #[test]
    fn the_simplest_is_chosen_that_loses_by_no_more_than_chance() {
        let base: Vec<f64> = (0..24).map(|b| -3.0 + 0.2 * f64::from(b % 5)).collect();
        let law: Vec<f64> = base.iter().map(|e| e - 1.0).collect();
        let pairs = law.iter().enumerate();
        let wider: Vec<f64> = pairs
            .map(|(b, e)| e - 0.02 + 0.1 * ((b % 3) as f64 - 1.0))
            .collect();
        let sets = [vec![], vec![bound("dahl")], vec![bound("bouc_wen")]];
        let rivals = |errors: &[&'static [f64]]| Rivals {
            all: errors
                .iter()
                .zip(&sets)
                .zip([(1.0, 2), (0.1, 4), (0.01, 6)])
                .map(|((errors, set), (power, numbers))| Judged {
                    added: set.clone().leak(),
                    errors,
                    power,
                    numbers,
                })
                .collect(),
            unseen_memories: vec![0; errors.len()],
            least_share: 0.005,
        };
        let leak = |v: &Vec<f64>| -> &'static [f64] { v.clone().leak() };
        let alike = vec![1.0; 24];
        // One law is clearly better than none; what wins by less than chance does not win.
        let clear = rivals(&[leak(&base), leak(&law), leak(&wider)]);
        let good = clear.good(&alike);
        assert_eq!(good, [1, 2]);
        assert_eq!(clear.simplest(&good, &alike), 1);
        // Two numbers more: a quarter of the part.
        let parts = clear.parts(&good);
        assert!((parts[0].1 - 0.8).abs() < 1e-12 && (parts[1].1 - 0.2).abs() < 1e-12);
        // What explains little more than another law takes its place where it leaves half of the
        // error power, and is not added to it before it leaves a third of the error.
        let better: Vec<f64> = law.iter().map(|e| e - 0.8).collect();
        let mut close = rivals(&[leak(&base), leak(&law), leak(&better)]);
        close.all[1].power = 1e-5;
        close.all[2].power = 1e-6;
        assert_eq!(close.good(&alike), [2]);
        let both = vec![bound("dahl"), bound("bouc_wen")];
        close.all[2].added = both.leak();
        assert_eq!(close.good(&alike), [1, 2]);
        // Nor does a law that another one beats in its place come in beside both together.
        let pair: Vec<f64> = better.iter().map(|e| e - 0.01).collect();
        let mut beaten = rivals(&[leak(&pair), leak(&law), leak(&better)]);
        for (set, power) in beaten.all.iter_mut().zip([1e-6, 1e-5, 1e-6]) {
            set.power = power;
        }
        beaten.all[0].added = vec![bound("dahl"), bound("bouc_wen")].leak();
        assert_eq!(beaten.good(&alike), [0, 2]);
        // With nothing to be gained, nothing is added, and nothing else has a part.
        let same: Vec<f64> = base.iter().map(|e| e - 0.01).collect();
        let none = rivals(&[leak(&base), leak(&same), leak(&same)]);
        let good = none.good(&alike);
        assert_eq!(none.simplest(&good, &alike), 0);
        assert_eq!(none.parts(&good), [(0, 1.0)]);
    }
}
