//! Values that no sensor gives: a row that stands alone between neighbours that agree, as one wrong
//! digit or sign of a log does.
//!
//! A channel that was sampled as it should be has nothing above half its sample rate, so that no
//! excursion is one row long: its neighbours take part in it. What counts is how far a row is from
//! the middle of its neighbours, beside the same of the rows around it and of the usual row.

use crate::study::series::extent;

/// So many times as far as any row around it, and as 99 of 100 rows of the channel. On measured
/// logs an impact, a step of a command and a coarse counter come to 5; a wrong sign of a usual
/// value comes to 20 and more.
const ALONE: f64 = 8.0;
/// Rows around it, on either side.
const AROUND: usize = 50;
/// Of the rows that are off at all, the share that is usual.
const USUAL: f64 = 0.99;
/// The neighbours agree: they are closer to each other than this part of what the row is off by.
const AGREE: f64 = 0.5;
/// So many times as far as the channel steps on either side of it.
const TURN: f64 = 2.0;
/// So many times the range of all other rows is no measurement.
const IMPOSSIBLE: f64 = 10.0;

/// A row that stands alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lone {
    pub(crate) row: usize,
    /// How far it is from the middle of its neighbours.
    pub(crate) off: f64,
}

/// How far every row is from the middle of its neighbours; 0 at both ends, which have one only.
fn off(series: &[f64]) -> Vec<f64> {
    let inner = series
        .windows(3)
        .map(|w| (w[1] - f64::midpoint(w[0], w[2])).abs());
    let ends = usize::from(series.len() > 1);
    let mut all = vec![0.0; ends];
    all.extend(inner);
    all.resize(series.len(), 0.0);
    all
}

/// The rows that stand alone by `times` as far as usual.
pub(crate) fn lone_by(series: &[f64], times: f64) -> Vec<Lone> {
    let off = off(series);
    let stands_alone = |row: &usize| {
        let (row, own) = (*row, off[*row]);
        // The nearest are asked first: nearly every row is refuted by them.
        let mut after = off[row + 2..].iter().take(AROUND - 1);
        let mut before = off[..row - 1].iter().rev().take(AROUND - 1);
        let above = |other: &f64| own > times * other;
        let apart = (series[row + 1] - series[row - 1]).abs();
        own > 0.0 && apart < AGREE * own && after.all(above) && before.all(above)
    };
    // Neither end has neighbours on both sides.
    let inner = 1..series.len().saturating_sub(1);
    let alone = inner.filter(stands_alone);
    let mut alone: Vec<Lone> = alone.map(|row| Lone { row, off: off[row] }).collect();
    if !alone.is_empty() {
        let usual = usual(off);
        alone.retain(|lone| lone.off > times * usual);
    }
    alone
}

/// What [`USUAL`] of the values do not exceed that are not 0; 0 where all are.
fn usual(mut values: Vec<f64>) -> f64 {
    values.retain(|v| *v > 0.0);
    if values.is_empty() {
        return 0.0;
    }
    let at = ((USUAL * values.len() as f64) as usize).min(values.len() - 1);
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// The rows that stand out of the usual row around them, however many there are of them: so many
/// that none is alone.
pub(crate) fn outliers(series: &[f64]) -> Vec<Lone> {
    let off = off(series);
    let steps = series.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    // Of a coarse counter most rows are off by nothing.
    let count = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    let stands_out = |row: &usize| {
        let (row, own) = (*row, off[*row]);
        let apart = (series[row + 1] - series[row - 1]).abs();
        // What shakes from one row to the next is off in the rows beyond the neighbours as well.
        let beyond = [row.checked_sub(2), Some(row + 2)];
        let mut beyond = beyond.into_iter().flatten().filter_map(|at| off.get(at));
        if own <= ALONE * count || apart >= AGREE * own || beyond.any(|o| *o >= AGREE * own) {
            return false;
        }
        let around = row.saturating_sub(AROUND)..(row + AROUND + 1).min(off.len());
        let mut near = off[around].to_vec();
        let middle = near.len() / 2;
        own > ALONE * *near.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let inner = 1..series.len().saturating_sub(1);
    let rows = inner.filter(stands_out);
    rows.map(|row| Lone { row, off: off[row] }).collect()
}

/// The rows that stand alone.
pub(crate) fn lone(series: &[f64]) -> Vec<Lone> {
    let mut alone = lone_by(series, ALONE);
    // Where a command turns round from one row to the next, it is off by its step.
    let step = |from: usize| series.get(from + 1).map(|next| (next - series[from]).abs());
    alone.retain(|&Lone { row, off }| {
        let before = row.checked_sub(2).and_then(step);
        let after = step(row + 1);
        [before, after]
            .into_iter()
            .flatten()
            .all(|step| off > TURN * step)
    });
    alone
}

/// The rows that stand alone on a path without time, which may turn round from one row to the next:
/// by more than it steps, too.
pub(crate) fn lone_of_path(series: &[f64]) -> Vec<Lone> {
    let mut alone = lone(series);
    if !alone.is_empty() {
        let steps = series.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let usual = usual(steps.collect());
        alone.retain(|lone| lone.off > ALONE * usual);
    }
    alone
}

/// Of the rows that stand alone, the first by so much that it is no measurement.
pub(crate) fn impossible(series: &[f64], alone: &[Lone]) -> Option<usize> {
    if alone.is_empty() {
        return None;
    }
    let mut rows = alone.iter().map(|lone| lone.row).peekable();
    let others = series.iter().enumerate();
    let others = others.filter(|(row, _)| rows.next_if_eq(row).is_none());
    let [low, high] = extent(others.map(|(_, value)| *value));
    let range = (high - low).max(0.0);
    // Beside a channel that is constant everything is far: a pulse that lasts a row, perhaps.
    let far = |lone: &&Lone| range > 0.0 && lone.off > IMPOSSIBLE * range;
    alone.iter().find(far).map(|lone| lone.row)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion with some noise of a coarse counter.
    fn motion() -> Vec<f64> {
        let at = |n: i32| (0.05 * f64::from(n)).sin() + 0.3 * (0.31 * f64::from(n)).sin();
        (0..2000)
            .map(|n| 5.9e-4 * (at(n) * 500.0).round() / 500.0)
            .collect()
    }

    #[test]
    fn a_wrong_digit_and_a_wrong_sign_stand_alone() {
        assert_eq!(lone(&motion()), []);
        let row = 777;
        for (factor, no_measurement) in [(1e8, true), (-1.0, false), (1e2, true), (0.0, false)] {
            let mut series = motion();
            assert!(series[row].abs() > 3e-4);
            series[row] *= factor;
            let found = lone(&series);
            assert_eq!(found.len(), 1, "{factor}: {found:?}");
            assert_eq!(found[0].row, row);
            let seen = impossible(&series, &found);
            assert_eq!(seen, no_measurement.then_some(row), "{factor}");
        }
        // A command that rises and falls by even steps turns round.
        let command: Vec<f64> = (0..2000)
            .map(|n: i32| 1e-4 * f64::from((n - 900).abs()))
            .collect();
        assert_eq!(lone(&command), []);
        // Twice in a log, both.
        let mut series = motion();
        series[row] *= 1e8;
        series[1500] *= 1e8;
        assert_eq!(lone(&series).len(), 2);
        assert_eq!(impossible(&series, &lone(&series)), Some(row));
    }

    #[test]
    fn many_spikes_are_seen_where_none_is_alone() {
        let mut series = motion();
        for row in (5..2000).step_by(17) {
            series[row] += 3e-3 * f64::from(1 - 2 * (row as i32 % 2));
        }
        assert_eq!(lone(&series), []);
        assert_eq!(outliers(&series).len(), (5..2000).step_by(17).count());
        assert_eq!(outliers(&motion()), []);
        // A motion that begins to shake.
        let mut shaking = motion();
        for (n, value) in shaking[1000..1030].iter_mut().enumerate() {
            *value += 3e-3 * (1.5 * n as f64).sin();
        }
        assert_eq!(outliers(&shaking), []);
        let noise: Vec<f64> = (0..2000)
            .map(|n: u64| (n.wrapping_mul(6_364_136_223_846_793_005) >> 33) as f64)
            .collect();
        assert_eq!(outliers(&noise), []);
    }

    #[test]
    fn a_path_that_turns_round_has_no_row_alone_unless_it_is_farther_than_its_steps() {
        let mut path: Vec<f64> = (0..2000)
            .map(|n| f64::from((n % 400 - 200_i32).abs()) + 0.01 * f64::from(7 * n % 5))
            .collect();
        assert!(!lone_by(&path, ALONE).is_empty());
        assert_eq!(lone_of_path(&path), []);
        path[730] += 60.0;
        assert_eq!(lone_of_path(&path).len(), 1);
    }

    #[test]
    fn steps_impacts_counts_and_rests_are_left_in_peace() {
        let mut step = motion();
        step[1000..].iter_mut().for_each(|v| *v += 1e-2);
        let mut impact = motion();
        for (n, v) in impact[1000..].iter_mut().enumerate() {
            *v += 1e-2 * (-0.2 * n as f64).exp() * (1.3 * n as f64).cos();
        }
        let mut rest = vec![0.0; 2000];
        rest[500..520].fill(1.0);
        let constant = vec![3.0; 2000];
        for (what, series) in [
            ("step", step),
            ("impact", impact),
            ("rest", rest),
            ("constant", constant),
            ("short", vec![1.0, 2.0, 1.0]),
            ("one", vec![1.0]),
            ("none", vec![]),
        ] {
            assert_eq!(lone(&series), [], "{what}");
            // What rings after an impact is a few rows.
            assert!(outliers(&series).len() <= series.len() / 500, "{what}");
        }
    }
}
