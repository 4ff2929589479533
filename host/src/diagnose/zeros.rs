//! Zeros of force that differ from record to record.

use super::bench::Bench;
use super::chances::mean_and_error;
use super::criteria::CRITERIA;
use super::hypothesis::Hypothesis;
use super::rank::look;
use crate::fit::effects::columns::Records;
use crate::model::effects::AxisEffect;
use jointwatch_shared::effect::Entry;

/// The effect by which a model says that the zero of force differs from record to record.
pub(super) const FORCE_ZERO: &str = "force_zero";
/// Variance between the zeros of records beside that of the means of their halves at which chance leaves one of twenty (Fisher), for three
/// records.
const STANDS: f64 = 9.55;

/// What a model is given where the zero of force differs from record to record.
pub(super) fn zero_of_force(axis: usize) -> Hypothesis {
    let entry = Entry::named(FORCE_ZERO);
    let members: Vec<AxisEffect> = entry
        .map(|entry| AxisEffect {
            input: None,
            entry,
            axis,
        })
        .into_iter()
        .collect();
    Hypothesis {
        base: 0,
        values: vec![vec![0.0]; members.len()],
        members,
    }
}

/// Whether every record has a zero of force of its own, beside a hypothesis that does not say so already.
pub(super) fn zeros_differ(records: &Records<'_>, axis: usize, hypothesis: &Hypothesis) -> bool {
    let mut members = hypothesis.members.iter();
    if records.rows.len() < 2 || members.any(|bound| bound.effect() == FORCE_ZERO) {
        return false;
    }
    let Some(preload) = Entry::named("preload") else {
        return false;
    };
    let preload = AxisEffect {
        input: None,
        entry: preload,
        axis,
    };
    let mut with_one = hypothesis.clone();
    if !with_one.members.contains(&preload) {
        with_one = with_one.with(preload, vec![0.0]);
    }
    let turns = |per_record: bool, hypothesis: &Hypothesis| {
        let bench = Bench::new(records, axis, hypothesis, per_record);
        let count: usize = bench.blocks.folds[..bench.blocks.turns]
            .iter()
            .map(Vec::len)
            .sum();
        let score = look(&bench, hypothesis, &[]).score;
        score.log_errors[..count].iter().sum::<f64>() / count as f64
    };
    let gain = turns(false, &with_one) - turns(true, hypothesis);
    let applied = records.applied_rms(axis);
    gain > CRITERIA.least_difference
        && Zeros::of(records, axis, hypothesis).spread() > CRITERIA.zero * applied
}

/// Zeros of force beside a hypothesis.
pub(super) struct Zeros {
    /// Of every record.
    of_records: Vec<f64>,
    /// By how much the zeros of a record's two halves differ, halved.
    of_halves: Vec<f64>,
}

impl Zeros {
    /// Those of records.
    pub(super) fn of(records: &Records<'_>, axis: usize, hypothesis: &Hypothesis) -> Self {
        let bench = Bench::new(records, axis, hypothesis, true);
        let parts = bench.parts(hypothesis, &[]);
        // The zeros stand last among the columns.
        let columns = bench.columns(&parts, hypothesis.base);
        let (mut factors, left) = bench.solved(&columns);
        let mut from = 0;
        let halves = records.rows.iter().map(|&rows| {
            let (first, last) = left[from..from + rows].split_at(rows / 2);
            from += rows;
            let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
            0.5 * (mean(first) - mean(last))
        });
        Self {
            of_halves: halves.collect(),
            of_records: factors.split_off(factors.len() - records.rows.len()),
        }
    }

    /// How far those of the records lie apart.
    pub(super) fn spread(&self) -> f64 {
        let all = || self.of_records.iter().copied();
        all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min)
    }

    /// Whether a zero stands for as long as a record lasts: records differ by more than chance makes of what the halves of each differ by. A
    /// zero that drifts does so within a record too, and taking one number off does not mend it.
    pub(super) fn stand(&self) -> bool {
        let (_, error) = mean_and_error(&self.of_records);
        let between = error.powi(2) * self.of_records.len() as f64;
        let within: f64 = self.of_halves.iter().map(|h| h * h).sum();
        between > STANDS * within / self.of_halves.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_that_wanders_within_records_does_not_stand() {
        let zeros = |of_halves: [f64; 3]| Zeros {
            of_records: vec![0.1, -0.2, 0.4],
            of_halves: of_halves.to_vec(),
        };
        // Variance between the records: 0.09.
        assert!((zeros([0.0; 3]).spread() - 0.6).abs() < 1e-12);
        assert!(zeros([0.09, -0.09, 0.09]).stand());
        assert!(!zeros([0.1, -0.1, 0.1]).stand());
    }
}
