//! Zeros of force that differ from record to record, and stand or drift while a record runs.
//!
//! A displacement that is integrated from an acceleration, or measured from another origin in every
//! record, has the same look: a spring turns both into a force. Where the base has none, no record
//! says more of its origin.

use super::bench::{Bench, rows_of};
use super::hypothesis::Hypothesis;
use super::rank::look;
use super::score::Score;
use crate::diagnose::criteria;
use crate::diagnose::decide::gains::{chance_of_gain, falls, is_gained, mean_and_error};
use crate::fit::effects::columns::Records;
use crate::model::effects::AxisEffect;
use crate::study::series::{extent, mean};
use jointwatch_shared::effect::Entry;

/// The effects by which a model says so, the simpler one first.
pub(crate) const OWN_ZEROS: [&str; 2] = ["force_zero", "force_drift"];
/// Variance of zeros, or of slopes, beside that of what the halves of the records differ by at
/// which chance leaves one of twenty (Fisher), for three records.
const STANDS: f64 = 9.55;
/// Cycles of a record between which a line in time is no part of the motion.
const MIN_CYCLES: f64 = 3.0;

fn on(axis: usize, name: &str) -> Option<AxisEffect> {
    let entry = Entry::named(name)?;
    Some(AxisEffect {
        input: None,
        entry,
        axis,
    })
}

/// A hypothesis that leaves the zeros to what stands beside it.
pub(crate) fn beside(own: Option<AxisEffect>, hypothesis: &Hypothesis) -> Hypothesis {
    let mut rest = hypothesis.clone();
    let Some(own) = own else {
        return rest;
    };
    for at in (0..rest.members.len()).rev() {
        if own.replaces(&rest.members[at]) {
            rest.members.remove(at);
            rest.values.remove(at);
            rest.base -= usize::from(at < rest.base);
        }
    }
    rest
}

/// What a hypothesis is worth, its log errors those on blocks in turn, every record with a zero of
/// its own where that is given.
pub(crate) fn judged(
    records: &Records<'_>,
    axis: usize,
    hypothesis: &Hypothesis,
    own: Option<AxisEffect>,
) -> Score {
    let hypothesis = beside(own, hypothesis);
    let bench = Bench::new(records, axis, &hypothesis, own);
    let mut score = look(&bench, &hypothesis, &[]).score;
    score.log_errors.truncate(bench.blocks.dealt());
    score
}

/// A hypothesis with dry friction beside it: in a record that goes one way it looks like a zero.
pub(crate) fn beside_friction(
    records: &Records<'_>,
    axis: usize,
    hypothesis: &Hypothesis,
) -> Hypothesis {
    let mut members = hypothesis.members.iter();
    match on(axis, "coulomb") {
        Some(friction) if !members.any(|m| *m == friction || m.replaces(&friction)) => {
            let bench = Bench::new(records, axis, hypothesis, None);
            hypothesis.with(friction, bench.middle(&friction))
        }
        _ => hypothesis.clone(),
    }
}

/// A hypothesis with one zero for all records.
fn with_one_zero(axis: usize, hypothesis: &Hypothesis) -> Hypothesis {
    let mut members = hypothesis.members.iter();
    match on(axis, "preload") {
        Some(preload) if !members.any(|m| *m == preload || m.replaces(&preload)) => {
            hypothesis.with(preload, vec![0.0])
        }
        _ => hypothesis.clone(),
    }
}

/// The effect among `names` with which every record has a zero of its own, beside a hypothesis that
/// does not say so already: where blocks that it was not learnt from are predicted better than with
/// one zero for all, and it is more than a tolerance.
pub(crate) fn own_zero(
    records: &Records<'_>,
    axis: usize,
    hypothesis: &Hypothesis,
    names: &[&str],
) -> Option<AxisEffect> {
    let is_known = |own: &AxisEffect| {
        let mut members = hypothesis.members.iter();
        members.any(|member| member == own || member.replaces(own))
    };
    let mut errors = judged(records, axis, &with_one_zero(axis, hypothesis), None).log_errors;
    let mut found = None;
    let possible = names.iter().filter_map(|name| on(axis, name));
    for own in possible.filter(|own| !is_known(own)) {
        // A zero that stands in one record is a preload, and on one way time and place are the
        // same.
        let is_told = match own.entry.parameters().len() {
            1 => records.rows.len() > 1,
            _ => goes_round(records, axis),
        };
        if !is_told {
            continue;
        }
        let better = judged(records, axis, hypothesis, Some(own)).log_errors;
        let applied = records.applied_rms(axis);
        if is_gained(&falls(&errors, &better))
            && Zeros::of(records, hypothesis, own).size() > criteria::ZERO * applied
        {
            errors = better;
            found = Some(own);
        }
    }
    found
}

/// Whether an axis goes to and fro in every record often enough to tell time from place.
fn goes_round(records: &Records<'_>, axis: usize) -> bool {
    let displacement = records.of_motion(axis, None, |at| at.displacement);
    let mut own = &displacement[rows_of(records, axis)];
    records.rows.iter().all(|rows| {
        let (record, others) = own.split_at(*rows);
        own = others;
        let travel: f64 = record.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
        let [low, high] = extent(record.iter().copied());
        travel >= 2.0 * MIN_CYCLES * (high - low)
    })
}

/// Zeros of force beside a hypothesis.
pub(crate) struct Zeros {
    /// The effect that a model has for them: with one parameter they stand, with more they drift.
    pub(crate) own: AxisEffect,
    /// Of every record: its zero, N or N·m, or its slope, per second.
    of_records: Vec<f64>,
    /// By how much those of a record's two halves differ, halved.
    of_halves: Vec<f64>,
    /// How long each record lasts, s.
    lengths_s: Vec<f64>,
    /// Log error power that they gain on every block in turn.
    pub(crate) gains: Vec<f64>,
    /// RMS error over RMS force on these blocks with one zero for all records, and with these.
    pub(crate) errors: [f64; 2],
}

impl Zeros {
    /// Fits the zeros of the records beside a hypothesis, for the effect `own`.
    pub(crate) fn of(records: &Records<'_>, hypothesis: &Hypothesis, own: AxisEffect) -> Self {
        let with_one = with_one_zero(own.axis, hypothesis);
        let [before, after] = [(&with_one, None), (hypothesis, Some(own))]
            .map(|(hypothesis, own_zero)| judged(records, own.axis, hypothesis, own_zero));
        let hypothesis = beside(Some(own), hypothesis);
        let bench = Bench::new(records, own.axis, &hypothesis, Some(own));
        let parts = bench.parts(&hypothesis, &[]);
        // The zeros stand last among the columns, and last of them the slopes.
        let columns = bench.columns(&parts, hypothesis.base);
        let (mut factors, left) = bench.solved(&columns);
        let drifts = own.entry.parameters().len() > 1;
        let mut from = 0;
        let halves = records.rows.iter().map(|&rows| {
            let (first, last) = left[from..from + rows].split_at(rows / 2);
            from += rows;
            let of = |part: &[f64]| match drifts {
                true => slope(part) * records.thinned_rate_hz,
                false => mean(part),
            };
            0.5 * (of(first) - of(last))
        });
        let lengths_s = records.rows.iter();
        Self {
            own,
            gains: falls(&before.log_errors, &after.log_errors),
            errors: [before.error, after.error],
            of_halves: halves.collect(),
            of_records: factors.split_off(factors.len() - records.rows.len()),
            lengths_s: lengths_s
                .map(|&rows| rows as f64 / records.thinned_rate_hz)
                .collect(),
        }
    }

    /// What a model is given that says so.
    pub(crate) fn as_hypothesis(&self) -> Hypothesis {
        Hypothesis {
            base: 0,
            members: vec![self.own],
            values: vec![vec![0.0; self.own.entry.parameters().len()]],
        }
    }

    /// How likely they are.
    pub(crate) fn chance(&self) -> f64 {
        chance_of_gain(&self.gains)
    }

    /// Whether they drift while a record runs.
    pub(crate) fn drift(&self) -> bool {
        self.own.entry.parameters().len() > 1
    }

    /// How far those of the records lie apart, or the RMS of the drifts about their means, N or
    /// N·m.
    pub(crate) fn size(&self) -> f64 {
        let all = || self.of_records.iter().copied();
        if !self.drift() {
            let [low, high] = extent(all());
            return high - low;
        }
        let whole: f64 = self.lengths_s.iter().sum();
        let records = self.of_records.iter().zip(&self.lengths_s);
        // A line that rises by h has the mean square h²/12 about its mean.
        let square: f64 = records
            .map(|(slope, length)| (slope * length).powi(2) / 12.0 * length)
            .sum();
        (square / whole).sqrt()
    }

    /// Whether a zero stands, or drifts at one pace, for as long as a record lasts: records differ
    /// by more than chance makes of what the halves of each differ by. A zero that drifts does
    /// so within a record too, and taking one number off does not mend it; nor does a line mend
    /// what wanders.
    pub(crate) fn stand(&self) -> bool {
        let count = self.of_records.len() as f64;
        let between = if self.drift() {
            self.of_records.iter().map(|s| s * s).sum::<f64>() / count
        } else {
            mean_and_error(&self.of_records).1.powi(2) * count
        };
        let within: f64 = self.of_halves.iter().map(|h| h * h).sum();
        between > STANDS * within / self.of_halves.len() as f64
    }
}

/// The slope of the line through a series, per row.
fn slope(series: &[f64]) -> f64 {
    let middle = 0.5 * (series.len() as f64 - 1.0);
    let pairs = series.iter().enumerate();
    let (product, square) = pairs.fold((0.0, 0.0), |(product, square), (row, value)| {
        let x = row as f64 - middle;
        (product + x * value, square + x * x)
    });
    if square > 0.0 { product / square } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_that_wanders_within_records_does_not_stand() {
        let zeros = |name: &str, of_halves: [f64; 3]| Zeros {
            own: on(0, name).unwrap(),
            of_records: vec![0.1, -0.2, 0.4],
            of_halves: of_halves.to_vec(),
            lengths_s: vec![2.0; 3],
            gains: Vec::new(),
            errors: [0.0; 2],
        };
        // Variance between the records: 0.09.
        assert!((zeros("force_zero", [0.0; 3]).size() - 0.6).abs() < 1e-12);
        assert!(zeros("force_zero", [0.09, -0.09, 0.09]).stand());
        assert!(!zeros("force_zero", [0.1, -0.1, 0.1]).stand());
        // Mean square of the slopes: 0.07; of a line over two seconds, a third of it.
        assert!((zeros("force_drift", [0.0; 3]).size() - (0.07_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(zeros("force_drift", [0.08, -0.08, 0.08]).stand());
        assert!(!zeros("force_drift", [0.09, -0.09, 0.09]).stand());
    }

    #[test]
    fn the_slope_of_a_line_is_its_slope() {
        let line: Vec<f64> = (0..7).map(|row| 3.0 - 0.25 * f64::from(row)).collect();
        assert!((slope(&line) + 0.25).abs() < 1e-12);
    }
}
