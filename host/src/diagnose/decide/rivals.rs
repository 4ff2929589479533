//! Which sets of effects the blocks cannot tell apart, and which of them is taken.
//!
//! Of two sets that lose to the best by no more than chance the one with a number more has half the
//! part. A set that holds another one of them has none, for it says nothing new.

use super::gains::falls;
use crate::diagnose::criteria;
use crate::diagnose::search::bench::Bench;
use crate::diagnose::search::rank::ScoredHypothesis;
use crate::model::effects::AxisEffect;
use crate::study::series::dot;
use std::cmp::Ordering;

/// Part of a set that has a number more than another one that is as good.
const PER_NUMBER: f64 = 0.5;

/// Mean log error power by which a law is better than another in its place, however little it
/// explains: it leaves half of the error power. That is less than what it takes to add one: a
/// second effect imitates whatever the first is wrong by.
const IN_PLACE: f64 = std::f64::consts::LN_2;

/// Sets of effects that are held against each other, the base among them.
pub(crate) struct Rivals<'a> {
    pub(super) all: Vec<Judged<'a>>,
    /// Of each, the effects with a memory that nothing in the records has shown.
    unseen_memories: Vec<usize>,
    /// RMS beside the RMS force that counts at least.
    pub(super) least_share: f64,
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

    /// Those that lose to a set of as many effects or more by no more than that.
    pub(super) fn as_good_as(&self, other: Judged<'_>, weights: &[f64]) -> Vec<usize> {
        let good = |at: &usize| {
            let set = self.all[*at];
            set.added.len() <= other.added.len() && self.is_as_good(set, other, weights)
        };
        (0..self.all.len()).filter(good).collect()
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
    pub(super) fn parts(&self, of: &[usize]) -> Vec<(usize, f64)> {
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
pub(super) struct Judged<'a> {
    /// The effects that it adds to the base.
    pub(super) added: &'a [AxisEffect],
    /// Log error power of every judged block.
    errors: &'a [f64],
    /// Power that it leaves.
    power: f64,
    /// Strengths and shape parameters.
    numbers: usize,
}

impl<'a> Judged<'a> {
    pub(super) fn of(looked: &'a ScoredHypothesis) -> Self {
        Self {
            added: looked.hypothesis.added(),
            errors: &looked.score.log_errors,
            power: looked.score.error.powi(2),
            numbers: looked.score.numbers,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Judged, Rivals};
    use crate::model::effects::AxisEffect;

    #[test]
    fn the_simplest_is_chosen_that_loses_by_no_more_than_chance() {
        let bound = |name| AxisEffect::parse(name, &["x"]).unwrap();
        let base: Vec<f64> = (0..24).map(|b| -3.0 + 0.2 * f64::from(b % 5)).collect();
        let law: Vec<f64> = base.iter().map(|e| e - 1.0).collect();
        let pairs = law.iter().enumerate();
        let wider: Vec<f64> = pairs
            .map(|(b, e)| e - 0.02 + 0.1 * ((b % 3) as f64 - 1.0))
            .collect();
        let sets = [vec![], vec![bound("dahl@x")], vec![bound("bouc_wen@x")]];
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
        let both = vec![bound("dahl@x"), bound("bouc_wen@x")];
        close.all[2].added = both.leak();
        assert_eq!(close.good(&alike), [1, 2]);
        // Nor does a law that another one beats in its place come in beside both together.
        let pair: Vec<f64> = better.iter().map(|e| e - 0.01).collect();
        let mut beaten = rivals(&[leak(&pair), leak(&law), leak(&better)]);
        for (set, power) in beaten.all.iter_mut().zip([1e-6, 1e-5, 1e-6]) {
            set.power = power;
        }
        beaten.all[0].added = vec![bound("dahl@x"), bound("bouc_wen@x")].leak();
        assert_eq!(beaten.good(&alike), [0, 2]);
        // With nothing to be gained, nothing is added, and nothing else has a part.
        let same: Vec<f64> = base.iter().map(|e| e - 0.01).collect();
        let none = rivals(&[leak(&base), leak(&same), leak(&same)]);
        let good = none.good(&alike);
        assert_eq!(none.simplest(&good, &alike), 0);
        assert_eq!(none.parts(&good), [(0, 1.0)]);
    }
}
