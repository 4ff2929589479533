//! A stuck channel: it stands at one value over a stretch in which the others show that the axis
//! moves.

use super::channel::{Channel, Kind, constant_runs, quantile, steps};
use super::finding::{Finding, RecordPosition};
use crate::study::series::{range, spread};
use crate::text::table::significant;

/// A stretch shorter than this may be a joint that turns round.
const MIN_S: f64 = 0.2;
/// Rows that such a stretch has at least.
const MIN_ROWS: usize = 60;
/// In stretches of the same length elsewhere the channel moves over at least this many of its
/// counts.
const MOVES_BY_COUNTS: f64 = 20.0;
/// Part of its greatest liveliness in any record that another channel has where the axis still
/// moves.
const STILL_MOVES: f64 = 0.15;
/// How many times the largest hundredth of its steps a displacement jumps by when it comes loose: a
/// body does not.
const JUMPS: f64 = 5.0;
/// Share of the record from which on a diagnosis means nothing; what is wrong there is wrong by its
/// own size.
const SERIOUS: f64 = 0.01;

/// Stuck channels among those of an axis; `liveliest` has the greatest liveliness of each in any
/// record.
pub(super) fn check(
    channels: &[Channel<'_>],
    liveliest: &[f64],
    place: &RecordPosition<'_>,
) -> Vec<Finding> {
    let all = channels.iter().enumerate();
    all.filter_map(|(at, channel)| {
        let others = channels.iter().zip(liveliest).enumerate();
        let others = others.filter(|(other, _)| *other != at);
        let others: Vec<(&Channel<'_>, f64)> = others.map(|(_, (c, most))| (c, *most)).collect();
        stuck(channel, &others, place)
    })
    .collect()
}

fn stuck(
    channel: &Channel<'_>,
    others: &[(&Channel<'_>, f64)],
    place: &RecordPosition<'_>,
) -> Option<Finding> {
    let series = channel.series;
    let least = ((MIN_S * place.sample_rate_hz) as usize).max(MIN_ROWS);
    let runs = constant_runs(series, least);
    let &(start, rows) = runs.iter().max_by_key(|(_, rows)| *rows)?;
    let sizes = steps(series);
    let count = quantile(&sizes, 0.0);
    // What it does elsewhere in as many rows.
    let elsewhere = series[..start]
        .chunks_exact(rows)
        .chain(series[start + rows..].chunks_exact(rows));
    let mut moves: Vec<f64> = elsewhere.map(range).collect();
    moves.sort_by(f64::total_cmp);
    if moves.is_empty() || quantile(&moves, 0.5) < MOVES_BY_COUNTS * count {
        return None;
    }
    let (other, _) = others.iter().find(|(other, most)| {
        let here = spread(&other.series[start..start + rows]);
        here > 0.0 && here > STILL_MOVES * most
    })?;
    let value = series[start];
    let after = series.get(start + rows);
    let jumps = after.is_some_and(|v| (v - value).abs() > JUMPS * quantile(&sizes, 0.99));
    match channel.kind {
        // A joint that friction holds stands still under a force that moves; only a jump gives a
        // sensor away.
        Kind::Relative | Kind::Velocity if !jumps => return None,
        // A drive that is switched off reads exactly 0 while the joint rings down.
        Kind::Force if value == 0.0 && !jumps => return None,
        // Noise is the least that an accelerometer shows, so one that never changes is stuck.
        _ => {}
    }
    let share = rows as f64 / series.len() as f64;
    Some(Finding {
        sentence: format!(
            "{}, {}: {} is stuck: it stands at {} {} for {rows} rows ({:.1} %) while {} moves; check its sensor, and log \
             anew or cut these rows with `rows`",
            place.file,
            place.row(start),
            channel.name,
            significant(value),
            channel.unit,
            100.0 * share,
            other.name
        ),
        serious: share >= SERIOUS,
        spikes: None,
    })
}
