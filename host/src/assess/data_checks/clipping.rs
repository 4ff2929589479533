//! Clipping: a channel that meets the rail of its amplifier or converter has flat tops.

use super::channel::{Channel, Kind, constant_runs, quantile, steps};
use super::finding::{Finding, RecordPosition};
use crate::study::series::extent;
use crate::text::table::significant;

/// Rows at the very same extreme value that make a flat top.
const FLAT: usize = 3;
/// Flat tops of one channel in one record below which nothing is said: two peaks may fall on the
/// same count.
const MIN_TOPS: usize = 3;
/// A smooth peak that stays on one count for three rows is reached by steps of at most five counts:
/// with curvature a per row² the rows beside its middle lie a/2 below it, under a count, and the
/// next ones 2a with a count of rounding.
const ENTERED_FROM_COUNTS: f64 = 6.0;
/// A step this much of the whole range onto the top is a command that switches, not a signal that
/// was cut.
const SWITCHED: f64 = 0.2;
/// Share of the rows that are cut from which on a diagnosis means nothing: peaks are where laws
/// differ, and half a per cent of the rows at the peaks carries several per cent of the power.
const SERIOUS: f64 = 0.005;

/// Flat tops of a channel.
pub(super) fn check(channel: &Channel<'_>, place: &RecordPosition<'_>) -> Option<Finding> {
    let series = channel.series;
    let [low, high] = extent(series.iter().copied());
    if high <= low {
        return None;
    }
    let sizes = steps(series);
    let count = quantile(&sizes, 0.0);
    let runs = constant_runs(series, FLAT);
    let cut = |rail: f64| -> Vec<(usize, usize)> {
        let at_rail = runs.iter().filter(|(start, _)| series[*start] == rail);
        let entered_steeply = |&&(start, rows): &&(usize, usize)| {
            let before = start.checked_sub(1).map(|row| (rail - series[row]).abs());
            let after = series.get(start + rows).map(|v| (rail - v).abs());
            let sides = [before, after];
            sides
                .iter()
                .flatten()
                .all(|step| *step > ENTERED_FROM_COUNTS * count && *step < SWITCHED * (high - low))
        };
        at_rail.filter(entered_steeply).copied().collect()
    };
    let (bottoms, tops) = (cut(low), cut(high));
    // A hard stop holds a displacement at one place too, but not to the count and not every time.
    let least = match channel.kind {
        Kind::Position | Kind::Relative => 2 * MIN_TOPS,
        _ => MIN_TOPS,
    };
    let rows = |runs: &[(usize, usize)]| runs.iter().map(|(_, rows)| rows).sum::<usize>();
    let (rail, runs) = if rows(&tops) >= rows(&bottoms) {
        (high, &tops)
    } else {
        (low, &bottoms)
    };
    if runs.len() < least {
        return None;
    }
    let all = rows(&tops) + rows(&bottoms);
    let share = all as f64 / series.len() as f64;
    let first = runs.first()?.0;
    Some(Finding {
        sentence: format!(
            "{}, {}: {} is clipped: {all} rows ({:.2} %) stand at its extreme value, {} {}, first there; widen its range or \
             shake more gently, and log anew",
            place.file,
            place.row(first),
            channel.name,
            100.0 * share,
            significant(rail),
            channel.unit
        ),
        serious: share >= SERIOUS,
        spikes: None,
    })
}
