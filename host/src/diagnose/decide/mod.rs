//! The decision on one axis: the simplest hypothesis that no other beats by more than chance, how
//! likely each effect is, and what is left.

mod chances;
pub(super) mod curve;
pub(super) mod gains;
mod rivals;

use crate::diagnose::criteria;
use crate::diagnose::learner::{Inputs, Knows, Left, Taken};
use crate::diagnose::search::bench::Bench;
use crate::diagnose::search::hypothesis::{Column, Hypothesis};
use crate::diagnose::search::rank::{Field, ScoredHypothesis, look, rank};
use crate::model::effects::AxisEffect;
use crate::study::series::{dot, rms};
use chances::Chances;
use curve::Curve;
use gains::{falls, is_gained, mean_and_error};
use rayon::prelude::*;
use rivals::Rivals;

/// Steps in which a hypothesis is found anew without one of its effects.
const STEPS: usize = 8;
/// One effect is as good as the other where the forces that they explain agree to this, as a
/// correlation.
const LIKENESS: f64 = 0.985;
/// Candidates that are compared for likeness and told.
pub(super) const TOLD: usize = 8;

/// What was decided on an axis.
pub(super) struct Decision {
    pub(super) axis: usize,
    /// The effects that are missing, the most important first, with the share of the force that is
    /// lost without each, and their values.
    pub(super) hypothesis: Hypothesis,
    /// Log error power that each of them gains on every block in turn, beside the others found
    /// anew without it.
    pub(super) gains: Vec<(AxisEffect, Vec<f64>)>,
    /// RMS error over RMS force on blocks in turn: of the base, and with what was found.
    pub(super) errors: [f64; 2],
    /// Mean square of the force about its mean, beside its mean square.
    pub(super) moving: f64,
    /// RMS over RMS force of what it leaves of all rows, learnt from all rows.
    pub(super) left: f64,
    /// What the learner takes away of what is left.
    pub(super) taken: Taken,
    /// Those of the effects that are more than pieces of a shape without a name.
    pub(super) laws: ScoredHypothesis,
    /// A curve without a law that does for several of the effects.
    pub(super) curve: Option<Curve>,
    /// The inputs with which it takes most of that, and the parts of the error's power that it
    /// takes at each step.
    pub(super) follows: Option<Knows>,
    /// Hypotheses of one effect, best first, with those that explain the same.
    pub(super) singles: Vec<(ScoredHypothesis, Vec<String>)>,
    /// Everything that was looked at.
    pub(super) looked: Vec<ScoredHypothesis>,
    /// How likely every effect is, that nothing is missing, and that something is that has no
    /// name.
    pub(super) chances: Chances,
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

    /// Interval, at 95 %, of the factor by which a hypothesis brings the error down, block by
    /// block.
    pub(super) fn drop_interval(&self, looked: &ScoredHypothesis) -> [f64; 2] {
        drop_interval(&falls(&self.base_errors, &looked.score.log_errors))
    }

    /// Power that the base leaves, at most that of the force about its mean.
    pub(super) fn moving_error_power(&self) -> f64 {
        self.errors[0].powi(2).min(self.moving)
    }

    /// Power that effects take away which are more than pieces of a shape without a name.
    pub(super) fn named(&self) -> f64 {
        (self.moving_error_power() - self.laws.score.error.powi(2)).max(0.0)
    }

    /// Power of what has no name: what the learner takes away, and what those pieces do.
    pub(super) fn without_name(&self) -> f64 {
        let pieces = self.laws.score.error.powi(2) - self.errors[1].powi(2);
        self.unnamed() + pieces.max(0.0)
    }
}

/// The same from the log error power that every block gains.
pub(super) fn drop_interval(gains: &[f64]) -> [f64; 2] {
    let (mean, error) = mean_and_error(gains);
    [-1.96, 1.96].map(|errors| (0.5 * (mean + errors * error)).exp())
}

impl Taken {
    /// Power that the learner takes away, where it is more than chance; beside the power of the
    /// force.
    fn surely(&self) -> f64 {
        let [before, after] = self.power;
        let power = (before - after).max(0.0);
        if is_gained(&self.gains()) && power.sqrt() > self.least_share {
            power
        } else {
            0.0
        }
    }
}

/// What the learner takes of what a design leaves when it knows everything. The time shows it a
/// zero of force that wanders within a data sheet's tolerance as well; so no more counts than what
/// it takes without the time and the record, or without such zeros.
fn all_taken(bench: &Bench<'_>, inputs: &Inputs, design: &[Column]) -> Taken {
    let left = inputs.left(bench, design, false);
    let taken = inputs.taken(bench, &left, Knows::Record);
    if taken.surely() == 0.0 {
        return taken;
    }
    let timeless = inputs.taken(bench, &left, Knows::Inputs);
    let steady = inputs.taken(bench, &inputs.steady(bench, &left), Knows::Record);
    let by_power = |a: &Taken, b: &Taken| a.surely().total_cmp(&b.surely());
    let most = std::cmp::max_by(steady, timeless, by_power);
    std::cmp::min_by(most, taken, by_power)
}

/// Decides on an axis, beside a base.
pub(super) fn decide(field: &Field<'_, '_>, axes: usize, base: &Hypothesis) -> Decision {
    let full = field.full;
    let base = look(full, base, &[]);
    let looked = rank(field, base.clone());
    let mut sound: Vec<&ScoredHypothesis> = looked
        .iter()
        .filter(|l| {
            l.hypothesis.added().is_empty() || (l.sound && helps(l, &base, full.least_share))
        })
        .collect();
    let inputs = Inputs::new(full, axes, &full.records.inputs());
    let mut edged: Option<Choice<'_>> = None;
    let choice = loop {
        let choice = Choice::of(field, &inputs, &sound, &base);
        let decided = &choice.pruned.decided;
        let added = decided.hypothesis.added().to_vec();
        if decided.sound || added.is_empty() {
            // What is physics only beside an effect that explains next to nothing gives way to what
            // predicts better.
            break edged
                .filter(|edged| edged.pruned.decided.score.rank < decided.score.rank)
                .unwrap_or(choice);
        }
        edged.get_or_insert(choice);
        let holds = |l: &ScoredHypothesis| added.iter().all(|b| l.hypothesis.added().contains(b));
        sound.retain(|l| !holds(l));
    };
    let Choice {
        rivals,
        good,
        chosen,
        pruned: Pruned {
            decided,
            lost,
            taken,
        },
    } = choice;
    let gains = gains(full, &decided, &lost);
    let curve = Curve::in_place_of(full, &decided);
    let laws = laws(field, &decided, lost, (taken.surely(), curve.as_ref()));
    let as_good: Vec<AxisEffect> = rivals.sole(&good);
    let design = full.design(&decided.hypothesis, &decided.parts);
    let left = full.solved(&design).1;
    let mut decision = Decision {
        axis: full.axis,
        left: rms(&left) / full.power.sqrt(),
        errors: [base.score.error, decided.score.error],
        moving: full.moving,
        hypothesis: decided.hypothesis.clone(),
        gains,
        taken,
        laws,
        curve,
        follows: None,
        singles: singles(full, &looked, &base, &decided, &as_good),
        chances: Chances::default(),
        rows: full.measured.len(),
        looked: Vec::new(),
        base_rank: base.score.rank,
        base_errors: base.score.log_errors.clone(),
    };
    let weak = chosen.hypothesis.added().iter();
    let weak: Vec<AxisEffect> = weak
        .filter(|bound| !decided.hypothesis.added().contains(bound))
        .copied()
        .collect();
    let block_of: Vec<usize> = full.blocks.folds.iter().flatten().copied().collect();
    decision.chances = Chances::draw(
        &rivals,
        (&block_of, full.blocks.rows.len()),
        &decision.taken,
        [&base, &decided, &decision.laws],
        &weak,
    );
    if decision.unnamed() > 0.0 {
        let left = inputs.left(full, &design, true);
        decision.follows = follows(full, &inputs, &left);
    }
    decision.looked = looked;
    decision
}

/// Log error power that each effect gains on every block in turn; `lost` is what
/// [`lost_without_each`] makes of `decided`.
fn gains(
    bench: &Bench<'_>,
    decided: &ScoredHypothesis,
    lost: &[(f64, AxisEffect, ScoredHypothesis)],
) -> Vec<(AxisEffect, Vec<f64>)> {
    let gain = |(_, bound, without): &(f64, AxisEffect, ScoredHypothesis)| {
        let mut gains = falls(&without.score.log_errors, &decided.score.log_errors);
        gains.truncate(bench.blocks.dealt());
        (*bound, gains)
    };
    lost.iter().map(gain).collect()
}

/// The first step at which the learner takes most of what it can of what is left.
fn follows(bench: &Bench<'_>, inputs: &Inputs, left: &Left) -> Option<Knows> {
    let gain = |taken: Taken| taken.power[0] - taken.power[1];
    let powers = Knows::ALL.map(|knows| (knows, gain(inputs.taken(bench, left, knows))));
    let most = powers.iter().map(|p| p.1).fold(0.0, f64::max);
    let &(step, power) = powers.iter().find(|p| p.1 > 0.7 * most)?;
    // The largest excursion and the time can tell records apart, and say less than what they stand
    // for.
    let by_record = |step| matches!(step, Knows::States | Knows::Record);
    if step > Knows::States && gain(inputs.taken_by(bench, left, by_record)) > power {
        return Some(Knows::Record);
    }
    Some(step)
}

/// The simplest of the sets that no other one beats by more than chance, without what explains next
/// to nothing.
struct Choice<'a> {
    rivals: Rivals<'a>,
    /// Those that no other one beats.
    good: Vec<usize>,
    chosen: &'a ScoredHypothesis,
    pruned: Pruned,
}

/// A set without what explains next to nothing.
struct Pruned {
    decided: ScoredHypothesis,
    /// Error power that is lost without each of its effects, the least first, with what stays.
    lost: Vec<(f64, AxisEffect, ScoredHypothesis)>,
    /// What the learner takes away of what it leaves.
    taken: Taken,
}

impl<'a> Choice<'a> {
    fn of(
        field: &Field<'_, '_>,
        inputs: &Inputs,
        sound: &[&'a ScoredHypothesis],
        base: &ScoredHypothesis,
    ) -> Self {
        let rivals = Rivals::of(sound, field.full);
        let alike = vec![1.0; base.score.log_errors.len()];
        let good = rivals.good(&alike);
        let mut chosen = sound[rivals.simplest(&good, &alike)];
        let of = |looked: &ScoredHypothesis| pruned(field, inputs, looked.clone(), base);
        let mut pruned = of(chosen);
        // Of what is left of a set another one may be as good, and simpler, after the same.
        while let Some((simpler, rest)) = rivals
            .simpler(&pruned.decided)
            .into_iter()
            .map(|at| (sound[at], of(sound[at])))
            .find(|(_, rest)| rivals.keeps_up(&rest.decided, &pruned.decided))
        {
            (chosen, pruned) = (simpler, rest);
        }
        Self {
            pruned,
            rivals,
            good,
            chosen,
        }
    }
}

/// Whether a hypothesis beats the base by more than chance, and by more than every model of a real
/// joint is wrong by.
fn helps(looked: &ScoredHypothesis, base: &ScoredHypothesis, least_share: f64) -> bool {
    let pairs = base.score.log_errors.iter().zip(&looked.score.log_errors);
    let gains: Vec<f64> = pairs.map(|(before, after)| before - after).collect();
    let explained = base.score.error.powi(2) - looked.score.error.powi(2);
    is_gained(&gains) && explained > least_share.powi(2)
}

/// Takes out what explains next to nothing, and of several effects what explains less than what has
/// no name: it cannot be told from that. What is lost without each effect is asked when the others
/// are found anew. Two that stand in for each other would hide each other, so the least important
/// one goes first.
fn pruned(
    field: &Field<'_, '_>,
    inputs: &Inputs,
    mut decided: ScoredHypothesis,
    base: &ScoredHypothesis,
) -> Pruned {
    let power = |looked: &ScoredHypothesis| looked.score.error.powi(2);
    let taken = |looked: &ScoredHypothesis| {
        let design = field.full.design(&looked.hypothesis, &looked.parts);
        all_taken(field.full, inputs, &design)
    };
    loop {
        // What a constant force does is no yardstick for the others.
        let before = power(base).min(field.full.moving);
        let explained = (before - power(&decided)).max(f64::MIN_POSITIVE);
        let added = decided.hypothesis.added().to_vec();
        let mut lost = lost_without_each(field, &decided);
        let least = lost.first().map_or(f64::INFINITY, |(lost, ..)| *lost);
        let share = criteria::LEAST_IMPORTANCE * explained;
        // No piece of another one's shape makes the error a third.
        let clearly = lost
            .first()
            .is_none_or(|(.., without)| decided.score.is_clearly_better(&without.score));
        if least >= field.full.least_share.powi(2) && (least >= share || clearly) {
            let taken = taken(&decided);
            if added.len() < 2 || least >= taken.surely() {
                let order: Vec<AxisEffect> =
                    lost.iter().rev().map(|(_, bound, _)| *bound).collect();
                let ordered = decided.hypothesis.ordered(&order);
                return Pruned {
                    decided: look(field.full, &ordered, &decided.parts),
                    lost,
                    taken,
                };
            }
        }
        decided = lost.swap_remove(0).2;
    }
}

/// Error power that is lost without each added effect when the others are found anew, the least
/// first, with what stays.
fn lost_without_each(
    field: &Field<'_, '_>,
    of: &ScoredHypothesis,
) -> Vec<(f64, AxisEffect, ScoredHypothesis)> {
    let added = of.hypothesis.added().par_iter();
    let mut lost: Vec<(f64, AxisEffect, ScoredHypothesis)> = added
        .map(|bound| {
            let narrower = of.hypothesis.without(bound);
            let refined = field.excerpt.refined(&narrower, false, STEPS);
            let without = look(field.full, &refined, &of.parts);
            let lost = without.score.error.powi(2) - of.score.error.powi(2);
            (lost, *bound, without)
        })
        .collect();
    lost.sort_by(|a, b| a.0.total_cmp(&b.0));
    lost
}

/// Of several effects, those that are laws. An effect beside others that explains little more than
/// what is left without a name is a piece of a shape that has none, and counts with what is left;
/// so does then an effect that explains little more than both. Of several that one curve does for,
/// only the most important may be a law.
///
/// `lost` is what [`lost_without_each`] makes of `decided`.
fn laws(
    field: &Field<'_, '_>,
    decided: &ScoredHypothesis,
    lost: Vec<(f64, AxisEffect, ScoredHypothesis)>,
    (without_name, curve): (f64, Option<&Curve>),
) -> ScoredHypothesis {
    let power = |looked: &ScoredHypothesis| looked.score.error.powi(2);
    let (mut laws, mut lost) = (decided.clone(), Some(lost));
    while laws.hypothesis.added().len() > 1 {
        let mut each = lost
            .take()
            .unwrap_or_else(|| lost_without_each(field, &laws));
        let is_piece = |bound: &AxisEffect| curve.is_some_and(|c| c.pieces.contains(bound));
        let pieces = each.iter().filter(|(_, bound, _)| is_piece(bound)).count();
        let of_curve = each.iter().position(|(_, bound, _)| is_piece(bound));
        let unnamed = without_name + (power(&laws) - power(decided)).max(0.0);
        let least = match of_curve.filter(|_| pieces > 1) {
            Some(least) => least,
            None if without_name > 0.0 && unnamed > criteria::UNKNOWN * each[0].0 => 0,
            None => break,
        };
        laws = each.swap_remove(least).2;
    }
    laws
}

/// Hypotheses of one effect, best first, each with the others that explain the same; those that are
/// `as_good` as the best one cannot be told from each other either.
fn singles(
    bench: &Bench<'_>,
    looked: &[ScoredHypothesis],
    base: &ScoredHypothesis,
    decided: &ScoredHypothesis,
    as_good: &[AxisEffect],
) -> Vec<(ScoredHypothesis, Vec<String>)> {
    let alone = |l: &&ScoredHypothesis| l.hypothesis.added().len() == 1;
    let mut singles: Vec<ScoredHypothesis> = looked.iter().filter(alone).cloned().collect();
    let order = |a: &ScoredHypothesis, b: &ScoredHypothesis| {
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
    let left = |looked: &ScoredHypothesis| {
        bench
            .solved(&bench.design(&looked.hypothesis, &looked.parts))
            .1
    };
    let before = left(base);
    let explained: Vec<Vec<f64>> = singles
        .iter()
        .map(|l| left(l).iter().zip(&before).map(|(a, b)| b - a).collect())
        .collect();
    let like =
        |a: &[f64], b: &[f64]| dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(f64::MIN_POSITIVE);
    let named = singles.iter().enumerate().map(|(at, single)| {
        let bound = |at: usize| singles[at].hypothesis.added()[0];
        let good = |at: usize| as_good.contains(&bound(at));
        let same = (0..singles.len()).filter(|&other| {
            let alike = like(&explained[at], &explained[other]) > LIKENESS;
            other != at && (alike || (good(at) && good(other)))
        });
        let names = same.map(|other| singles[other].hypothesis.added()[0].effect());
        (single.clone(), names.collect())
    });
    named.collect()
}
