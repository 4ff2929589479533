//! The decision on one axis: the simplest hypothesis that no other beats by more than chance, how likely each effect is, and what is left.

use super::bench::Bench;
use super::criteria::CRITERIA;
use super::hypothesis::Hypothesis;
use super::learner::{Inputs, Knows, Taken};
use super::rank::{Field, Looked, look, rank};
use crate::model::effects::Bound;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Choices on blocks drawn with replacement, of which the probabilities are shares.
const DRAWS: usize = 300;
/// Steps in which a hypothesis is found anew without one of its effects.
const STEPS: usize = 8;
/// One effect is as good as the other where the forces that they explain agree to this, as a correlation.
const LIKENESS: f64 = 0.985;
/// Candidates that are compared for likeness and told.
pub(super) const TOLD: usize = 8;

/// What was decided on an axis.
pub(super) struct Decision {
    pub(super) axis: usize,
    /// The effects that are missing, the most important first, with the share of the force that is lost without each, and their values.
    pub(super) hypothesis: Hypothesis,
    /// RMS error over RMS force on blocks in turn: of the base, and with what was found.
    pub(super) errors: [f64; 2],
    /// RMS over RMS force of what it leaves of all rows, learnt from all rows.
    pub(super) left: f64,
    /// What the learner takes away of what is left.
    pub(super) taken: Taken,
    /// The inputs with which it takes most of that, and the parts of the error's power that it takes at each step.
    pub(super) follows: Option<Knows>,
    /// Hypotheses of one effect, best first, with those that explain the same.
    pub(super) singles: Vec<(Looked, Vec<&'static str>)>,
    /// Everything that was looked at.
    pub(super) looked: Vec<Looked>,
    /// Probability of every effect,
    pub(super) chances: Vec<(Bound, f64)>,
    /// that nothing is missing, and that something is that has no name.
    pub(super) nothing: f64,
    pub(super) unknown: f64,
    /// Rows of the axis.
    pub(super) rows: usize,
    /// Of the base: its rank, and its log errors.
    pub(super) base_rank: f64,
    base_errors: Vec<f64>,
}

impl Decision {
    /// Power of what motion explains and no effect does.
    pub(super) fn unnamed(&self) -> f64 {
        self.taken.surely()
    }

    /// Interval, at 95 %, of the factor by which a hypothesis brings the error down, block by block.
    pub(super) fn drop_interval(&self, looked: &Looked) -> [f64; 2] {
        let pairs = self.base_errors.iter().zip(&looked.score.log_errors);
        let fell: Vec<f64> = pairs
            .map(|(before, after)| 0.5 * (before - after))
            .collect();
        let (mean, error) = mean_and_error(&fell);
        [(mean - 1.96 * error).exp(), (mean + 1.96 * error).exp()]
    }

    /// Power that the effects take away.
    pub(super) fn named(&self) -> f64 {
        let [before, after] = self.errors;
        (before * before - after * after).max(0.0)
    }
}

impl Taken {
    /// Power that the learner takes away, where it is more than chance; beside the power of the force.
    fn surely(&self) -> f64 {
        let [before, after] = self.power;
        let differences: Vec<f64> = self.gains().collect();
        let (mean, error) = mean_and_error(&differences);
        let sure = mean > error.max(CRITERIA.least_difference);
        let power = (before - after).max(0.0);
        if sure && power.sqrt() > CRITERIA.least_share {
            power
        } else {
            0.0
        }
    }

    /// Log error power that the learner gains, block by block.
    fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        let pairs = self.before.iter().zip(&self.after);
        pairs.map(|(before, after)| ((before + 1e-7) / (after + 1e-7)).ln())
    }
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (square / (count - 1.0).max(1.0) / count).sqrt())
}

/// The simplest of hypotheses that loses to the best by no more than chance, or by less than every model of a real joint is wrong by; with
/// blocks weighted. `powers` are those of the errors on blocks in turn.
fn choose(errors: &[&[f64]], powers: &[f64], numbers: &[usize], weights: &[f64]) -> usize {
    let whole: f64 = weights.iter().sum();
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        values.zip(weights).map(|(v, w)| v * w).sum::<f64>() / whole
    };
    let means: Vec<f64> = errors
        .iter()
        .map(|e| mean(&mut e.iter().copied()))
        .collect();
    let best = (0..errors.len()).min_by(|a, b| means[*a].total_cmp(&means[*b]));
    let Some(best) = best else { return 0 };
    let good = (0..errors.len()).filter(|&at| {
        let behind = means[at] - means[best];
        let pairs = errors[at].iter().zip(errors[best]);
        let square = mean(&mut pairs.map(|(a, b)| (a - b - behind).powi(2)));
        let chance = (square / whole).sqrt().max(CRITERIA.least_difference);
        behind <= chance || powers[at] - powers[best] < CRITERIA.least_share.powi(2)
    });
    let simplest = good.min_by(|a, b| {
        numbers[*a]
            .cmp(&numbers[*b])
            .then(means[*a].total_cmp(&means[*b]))
    });
    simplest.unwrap_or(best)
}

/// Decides on an axis, beside a base.
pub(super) fn decide(field: &Field<'_, '_>, axes: usize, base: &Hypothesis) -> Decision {
    let full = field.full;
    let base = look(full, base, &[]);
    let looked = rank(field, base.clone());
    let sound: Vec<&Looked> = looked
        .iter()
        .filter(|l| l.hypothesis.added().is_empty() || (l.sound && helps(l, &base)))
        .collect();
    let errors: Vec<&[f64]> = sound
        .iter()
        .map(|l| l.score.log_errors.as_slice())
        .collect();
    let numbers: Vec<usize> = sound.iter().map(|l| l.score.numbers).collect();
    let judged = base.score.log_errors.len();
    let powers: Vec<f64> = sound.iter().map(|l| l.score.error.powi(2)).collect();
    let chosen = choose(&errors, &powers, &numbers, &vec![1.0; judged]);
    let inputs = Inputs::new(full, axes);
    let (decided, taken) = pruned(field, &inputs, sound[chosen].clone(), &base);
    let design = full.design(&decided.hypothesis, &decided.parts);
    let left = full.solved(&design).1;
    let square = left.iter().map(|e| e * e).sum::<f64>() / left.len().max(1) as f64;
    let mut decision = Decision {
        axis: full.axis,
        left: (square / full.power).sqrt(),
        errors: [base.score.error, decided.score.error],
        hypothesis: decided.hypothesis.clone(),
        taken,
        follows: None,
        singles: singles(full, &looked, &base, &decided),
        chances: Vec::new(),
        nothing: 0.0,
        unknown: 0.0,
        rows: full.measured.len(),
        looked: Vec::new(),
        base_rank: base.score.rank,
        base_errors: base.score.log_errors.clone(),
    };
    let weak = sound[chosen].hypothesis.added().iter();
    let weak: Vec<Bound> = weak
        .filter(|bound| !decided.hypothesis.added().contains(bound))
        .copied()
        .collect();
    decision.chance(full, &sound, [&base, &decided], &weak);
    if decision.unnamed() > 0.0 {
        let powers = Knows::ALL.map(|knows| {
            let taken = inputs.taken(full, &design, knows, true);
            (knows, taken.power[0] - taken.power[1])
        });
        let most = powers.iter().map(|p| p.1).fold(0.0, f64::max);
        let step = powers.iter().find(|p| p.1 > 0.7 * most);
        decision.follows = step.map(|p| p.0);
    }
    decision.looked = looked;
    decision
}

/// Whether a hypothesis beats the base by more than chance, and by more than every model of a real joint is wrong by.
fn helps(looked: &Looked, base: &Looked) -> bool {
    let pairs = base.score.log_errors.iter().zip(&looked.score.log_errors);
    let gains: Vec<f64> = pairs.map(|(before, after)| before - after).collect();
    let (mean, error) = mean_and_error(&gains);
    let explained = base.score.error.powi(2) - looked.score.error.powi(2);
    mean > error.max(CRITERIA.least_difference) && explained > CRITERIA.least_share.powi(2)
}

/// Takes out what explains next to nothing, and of several effects what explains less than what has no name: it cannot be told from that.
/// What is lost without each effect is asked when the others are found anew. Two that stand in for each other would hide each other, so
/// the least important one goes first. Also what the learner takes away of what stays.
fn pruned(
    field: &Field<'_, '_>,
    inputs: &Inputs,
    mut decided: Looked,
    base: &Looked,
) -> (Looked, Taken) {
    let power = |looked: &Looked| looked.score.error.powi(2);
    let taken = |looked: &Looked| {
        let design = field.full.design(&looked.hypothesis, &looked.parts);
        inputs.taken(field.full, &design, Knows::Time, false)
    };
    loop {
        let explained = (power(base) - power(&decided)).max(f64::MIN_POSITIVE);
        let added = decided.hypothesis.added().to_vec();
        let mut lost: Vec<(f64, Bound, Looked)> = added
            .iter()
            .map(|bound| {
                let narrower = decided.hypothesis.without(bound);
                let refined = field.excerpt.refined(&narrower, false, STEPS);
                let without = look(field.full, &refined, &decided.parts);
                (power(&without) - power(&decided), *bound, without)
            })
            .collect();
        lost.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = lost.first().map_or(f64::INFINITY, |(lost, ..)| *lost);
        let counts = (CRITERIA.least_importance * explained).max(CRITERIA.least_share.powi(2));
        if least >= counts {
            let taken = taken(&decided);
            if added.len() < 2 || least >= taken.surely() {
                let order: Vec<Bound> = lost.iter().rev().map(|(_, bound, _)| *bound).collect();
                let ordered = decided.hypothesis.ordered(&order);
                return (look(field.full, &ordered, &decided.parts), taken);
            }
        }
        decided = lost.swap_remove(0).2;
    }
}

/// Hypotheses of one effect, best first, each with the others that explain the same.
fn singles(
    bench: &Bench<'_>,
    looked: &[Looked],
    base: &Looked,
    decided: &Looked,
) -> Vec<(Looked, Vec<&'static str>)> {
    let alone = |l: &&Looked| l.hypothesis.added().len() == 1;
    let mut singles: Vec<Looked> = looked.iter().filter(alone).cloned().collect();
    let order = |a: &Looked, b: &Looked| {
        b.sound
            .cmp(&a.sound)
            .then(a.score.rank.total_cmp(&b.score.rank))
    };
    singles.sort_by(order);
    singles.truncate(TOLD);
    // What was found only beside others is told by itself as well.
    let found = decided
        .hypothesis
        .members
        .iter()
        .zip(&decided.hypothesis.values);
    for (bound, values) in found.skip(decided.hypothesis.base) {
        if !singles.iter().any(|l| l.hypothesis.added()[0] == *bound) {
            let one = base.hypothesis.with(*bound, values.clone());
            singles.push(look(bench, &one, &decided.parts));
        }
    }
    singles.sort_by(order);
    let left = |looked: &Looked| {
        bench
            .solved(&bench.design(&looked.hypothesis, &looked.parts))
            .1
    };
    let before = left(base);
    let explained: Vec<Vec<f64>> = singles
        .iter()
        .map(|l| left(l).iter().zip(&before).map(|(a, b)| b - a).collect())
        .collect();
    let like = |a: &[f64], b: &[f64]| {
        let dot = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(f64::MIN_POSITIVE)
    };
    let named = singles.iter().enumerate().map(|(at, single)| {
        let same = (0..singles.len())
            .filter(|&other| other != at && like(&explained[at], &explained[other]) > LIKENESS);
        let names = same.map(|other| singles[other].hypothesis.added()[0].entry.about.name);
        (single.clone(), names.collect())
    });
    named.collect()
}

impl Decision {
    /// Probabilities: the same choice on blocks drawn with replacement. `weak` are effects that explained next to nothing.
    fn chance(
        &mut self,
        bench: &Bench<'_>,
        sets: &[&Looked],
        [base, decided]: [&Looked; 2],
        weak: &[Bound],
    ) {
        let errors: Vec<&[f64]> = sets.iter().map(|l| l.score.log_errors.as_slice()).collect();
        let powers: Vec<f64> = sets.iter().map(|l| l.score.error.powi(2)).collect();
        let numbers: Vec<usize> = sets.iter().map(|l| l.score.numbers).collect();
        let block_of: Vec<usize> = bench.blocks.folds.iter().flatten().copied().collect();
        let count = bench.blocks.rows.len();
        let mut rng = StdRng::seed_from_u64(0);
        let gains: Vec<f64> = self.taken.gains().collect();
        for _ in 0..DRAWS {
            let mut drawn = vec![0.0; count];
            for _ in 0..count {
                drawn[rng.random_range(0..count)] += 1.0;
            }
            let weights: Vec<f64> = block_of.iter().map(|&block| drawn[block]).collect();
            let chosen = sets[choose(&errors, &powers, &numbers, &weights)];
            let power = |values: &mut dyn Iterator<Item = f64>| {
                values.zip(&weights).map(|(v, w)| v * w).sum::<f64>() / weights.iter().sum::<f64>()
            };
            let gain = power(&mut gains.iter().copied());
            let of = |looked: &Looked| power(&mut looked.score.log_errors.iter().map(|e| e.exp()));
            let named = (of(base) - of(decided)).max(0.0);
            let left = self.taken.before.iter().zip(&self.taken.after);
            let unnamed = power(&mut left.map(|(a, b)| a - b)).max(0.0);
            let added = chosen.hypothesis.added().iter();
            let added: Vec<&Bound> = added.filter(|bound| !weak.contains(bound)).collect();
            if gain > CRITERIA.least_difference
                && unnamed.sqrt() > CRITERIA.least_share
                && unnamed > CRITERIA.unknown * named
            {
                self.unknown += 1.0;
            } else if added.is_empty() {
                self.nothing += 1.0;
            }
            for bound in added {
                match self.chances.iter_mut().find(|(b, _)| b == bound) {
                    Some((_, chance)) => *chance += 1.0,
                    None => self.chances.push((*bound, 1.0)),
                }
            }
        }
        let shares = self.chances.iter_mut().map(|(_, chance)| chance);
        let shares = shares.chain([&mut self.unknown, &mut self.nothing]);
        shares.for_each(|chance| *chance /= DRAWS as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::choose;

    #[test]
    fn the_simplest_is_chosen_that_loses_by_no_more_than_chance() {
        let base: Vec<f64> = (0..24).map(|b| -3.0 + 0.2 * f64::from(b % 5)).collect();
        let law: Vec<f64> = base.iter().map(|e| e - 1.0).collect();
        let pairs = law.iter().enumerate();
        let wider: Vec<f64> = pairs
            .map(|(b, e)| e - 0.02 + 0.1 * ((b % 3) as f64 - 1.0))
            .collect();
        let sets = [base.as_slice(), &law, &wider];
        let alike = vec![1.0; 24];
        let far = [1.0, 0.1, 0.01];
        // One law is clearly better than none; what wins by less than chance does not win.
        assert_eq!(choose(&sets, &far, &[2, 4, 7], &alike), 1);
        // With nothing to be gained, nothing is added.
        let same: Vec<f64> = base.iter().map(|e| e - 0.01).collect();
        assert_eq!(choose(&[&base, &same], &far, &[2, 4], &alike), 0);
    }
}
