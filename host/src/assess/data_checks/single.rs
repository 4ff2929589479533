//! Single wrong rows: values that stand alone, and a displacement that jumps.

use super::channel::{Channel, Kind};
use super::finding::{Finding, RecordPosition};
use crate::signal::motion::Filters;
use crate::study::check::lone::{Lone, lone, lone_by, outliers};
use crate::study::series::spread;
use crate::text::table::significant;

/// A body does not jump by so many times what it moves by from row to row around it. Measured
/// displacements come to 6, where a logger was late by a row.
const JUMPS: f64 = 12.0;
/// Part of a channel's RMS that such rows are wrong by from which on a diagnosis means nothing: as
/// large as the effects that are sought.
const SERIOUS: f64 = 0.01;
/// Part of a channel's RMS that rows which stand out are off by from which on they are spikes, and
/// from which on, of what the low-pass leaves of them in a force, a diagnosis means nothing.
/// Accelerometers of public logs come to 0.09, forces, displacements and velocities to 0.03; a
/// torque that a servo drive works out has 0.6.
const SPIKES: f64 = 0.1;
/// Part of all rows that they are at least: impacts that ring are fewer.
const MANY: f64 = 0.005;

/// Values that stand alone, spikes, or jumps.
pub(super) fn check(
    channel: &Channel<'_>,
    place: &RecordPosition<'_>,
    filters: &Filters,
) -> Option<Finding> {
    let alone = lone(channel.series);
    if !alone.is_empty() {
        let what = "stands alone between its neighbours, as no sampled motion does";
        return finding(channel, place, &alone, what, "repair the log");
    }
    let spikes = outliers(channel.series);
    let many = spikes.len() as f64 > MANY * channel.series.len() as f64;
    if many && share(channel, &spikes) > SPIKES {
        let what = "stands out of the rows around it, as spikes do";
        let what_to_do = "look for where they come from, or take them out of the log: a running median over five rows does";
        // A force is compared behind the low-pass; what is derived of a motion takes all of them
        // in.
        let passes = match channel.kind {
            Kind::Force => filters.band.iter().map(|tap| tap * tap).sum::<f64>().sqrt(),
            _ => 1.0,
        };
        return finding(channel, place, &spikes, what, what_to_do).map(|found| Finding {
            serious: passes * share(channel, &spikes) > SPIKES,
            spikes: (channel.kind == Kind::Force)
                .then(|| (place.axis, (passes * share(channel, &spikes)).powi(2))),
            ..found
        });
    }
    if !matches!(channel.kind, Kind::Position | Kind::Relative) {
        return None;
    }
    let steps = channel.series.windows(2).map(|pair| pair[1] - pair[0]);
    let jumps = lone_by(&steps.collect::<Vec<f64>>(), JUMPS);
    let what = "jumps from there to the next row, as no body does";
    let what_to_do =
        "look for a counter that lost counts, and log anew or cut the record there with `rows`";
    finding(channel, place, &jumps, what, what_to_do)
}

fn finding(
    channel: &Channel<'_>,
    place: &RecordPosition<'_>,
    rows: &[Lone],
    what: &str,
    what_to_do: &str,
) -> Option<Finding> {
    let first = rows.first()?.row;
    let part = share(channel, rows);
    Some(Finding {
        sentence: format!(
            "{}, {}: {}, {} {}, {what}; {} such rows in all, {:.1} % of its RMS; {what_to_do}",
            place.file,
            place.row(first),
            channel.name,
            significant(channel.series[first]),
            channel.unit,
            rows.len(),
            100.0 * part
        ),
        serious: part >= SERIOUS,
        spikes: None,
    })
}

/// By how much some rows are off, RMS over all rows beside that of the channel.
fn share(channel: &Channel<'_>, rows: &[Lone]) -> f64 {
    let power: f64 = rows.iter().map(|lone| lone.off * lone.off).sum();
    (power / channel.series.len().max(1) as f64).sqrt() / spread(channel.series)
}
