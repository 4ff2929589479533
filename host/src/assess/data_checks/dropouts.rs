//! Drop-outs: a channel that falls to 0 for a moment, or holds its last value while samples are
//! lost.

use super::channel::{Channel, constant_runs, quantile, steps};
use super::finding::{Finding, RecordPosition};
use crate::study::series::extent;

/// A fall to 0 and the way back are larger than this many of the largest hundredth of the channel's
/// steps.
const FALLS_BY: f64 = 4.0;
/// A drop-out lasts this long at most; what is longer is a stuck channel.
const LONGEST_S: f64 = 0.2;
/// Equal rows that count as held, in a channel that otherwise hardly repeats itself.
const HELD: usize = 4;
/// Share of equal neighbours up to which a channel hardly repeats itself.
const REPEATS: f64 = 0.1;
/// After samples were lost, the channel steps by this many times its usual step to where it would
/// have been.
const CATCHES_UP: f64 = 2.5;
/// Bursts of held values below which nothing is said.
const MIN_BURSTS: usize = 5;
/// Share of lost rows from which on a diagnosis means nothing: as long as a hundredth of the record
/// is wrong by its own size, a tenth of its RMS is error.
const SERIOUS: f64 = 0.01;

/// Drop-outs of a channel.
pub(super) fn check(channel: &Channel<'_>, place: &RecordPosition<'_>) -> Option<Finding> {
    let longest = (LONGEST_S * place.sample_rate_hz) as usize;
    let sizes = steps(channel.series);
    let fallen = zeros(channel.series, FALLS_BY * quantile(&sizes, 0.99), longest);
    let finding = |bursts: &[(usize, usize)], what: &str| {
        let rows: usize = bursts.iter().map(|(_, rows)| rows).sum();
        let share = rows as f64 / channel.series.len() as f64;
        Some(Finding {
            sentence: format!(
                "{}, {}: {} drops out: in {} places, first there, it {what}, {rows} rows in all ({:.2} %); mend its connection or \
                 its logger, and log anew or cut these rows with `rows`",
                place.file,
                place.row(bursts.first()?.0),
                channel.name,
                bursts.len(),
                100.0 * share
            ),
            serious: share >= SERIOUS,
            spikes: None,
        })
    };
    if !fallen.is_empty() {
        return finding(&fallen, "reads exactly 0 between values far from it");
    }
    let held = held(channel.series, &sizes, longest);
    if held.len() < MIN_BURSTS {
        return None;
    }
    finding(&held, "repeats its last value and then jumps")
}

/// Stretches of exact zeros that the channel falls to and comes back from at once.
fn zeros(series: &[f64], far: f64, longest: usize) -> Vec<(usize, usize)> {
    let mut bursts = Vec::new();
    for (start, rows) in constant_runs(series, 1) {
        if series[start] != 0.0 || rows > longest || start == 0 {
            continue;
        }
        let (before, Some(&after)) = (series[start - 1], series.get(start + rows)) else {
            continue;
        };
        let near = before.abs().min(after.abs());
        // It comes back to where it would have been: a signal that crosses 0 goes on to the other
        // side.
        if near > far && near > 0.0 && (before - after).abs() < 0.5 * near {
            bursts.push((start, rows));
        }
    }
    bursts
}

/// Stretches in which a lively channel holds a value and then catches up.
fn held(series: &[f64], sizes: &[f64], longest: usize) -> Vec<(usize, usize)> {
    let [low, high] = extent(series.iter().copied());
    let repeats = series.windows(2).filter(|pair| pair[0] == pair[1]).count();
    // A channel that is logged slower than the others, or one that rests, repeats itself all the
    // time.
    if repeats as f64 > REPEATS * series.len() as f64 {
        return Vec::new();
    }
    let usual = quantile(sizes, 0.5);
    let caught_up = |&(start, rows): &(usize, usize)| {
        let next = series.get(start + rows);
        let value = series[start];
        // What stands at an extreme is clipped.
        rows <= longest
            && value > low
            && value < high
            && next.is_some_and(|next| (next - value).abs() > CATCHES_UP * usual)
    };
    let runs = constant_runs(series, HELD).into_iter();
    runs.filter(caught_up).collect()
}
