//! Where the error of a model sits: in which region of the states, in which stretch of time, at
//! which frequencies.

use crate::signal::spectrum::Accumulator;
use crate::study::series::mean;
use crate::text::table::rounded;
use serde::Serialize;
use std::ops::Range;

/// One place that holds a large part of an axis's error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailingRegion {
    /// The axis whose force is wrong there.
    pub axis: String,
    /// `state`, `time`, `frequency`, or `zero` for a constant in one record.
    pub kind: &'static str,
    /// The place in words and numbers.
    pub region: String,
    /// The part of Σ(r−r̂)² that lies in it, 0 to 1.
    pub share_of_error: f64,
    /// The part of the rows (for a band: of the common band) that it takes, 0 to 1.
    pub share_of_rows: f64,
    /// The place in numbers, for drawings.
    #[serde(skip)]
    pub extent: Extent,
}

/// A place in numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Extent {
    /// No part stands out.
    Everywhere,
    /// Where all of these hold.
    States(Vec<Condition>),
    /// A stretch of the record `file`, seconds since its beginning.
    Time {
        /// The record's file, as study.toml names it.
        file: String,
        /// Where it begins, s.
        from_s: f64,
        /// Where it ends, s.
        to_s: f64,
    },
    /// Lower and upper end of a band, Hz.
    Frequency([f64; 2]),
}

/// A state, or its magnitude, lies between two values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Condition {
    /// Which state: 0 and 1 for displacement and velocity of the first axis, 2 and 3 for those of
    /// the second.
    pub state: usize,
    /// Whether it is about the magnitude.
    pub magnitude: bool,
    /// What it lies above, SI; none where it has no lower end.
    pub above: Option<f64>,
    /// What it lies below, SI.
    pub below: Option<f64>,
}

/// One record's errors of one axis beside the states they belong to, row by row.
pub struct ErrorRecord<'a> {
    /// The record's file, to name it.
    pub file: &'a str,
    /// Time of the first row, s.
    pub start_s: f64,
    /// States, SI, one series each.
    pub states: Vec<&'a [f64]>,
    /// r − r̂, N or N·m.
    pub error: &'a [f64],
}

/// Name and unit of one state, for the words.
pub struct StateName {
    /// As it stands in the sentence: `x`, `velocity of x`.
    pub name: String,
    /// The unit of the numbers: `mm`, `mrad/s`, …
    pub unit: String,
    /// SI value × this = value in `unit`.
    pub factor: f64,
}

/// Cuts at which a region may begin or end: this many quantiles of every state.
const CUTS: usize = 32;
/// A region never holds fewer rows than this part of all.
const MIN_ROWS: f64 = 0.02;
/// What a cut keeps has so many times the error power a row of what it was cut from.
const STANDS_OUT: f64 = 1.3;
/// How often a region may be cut down.
const DEPTH: usize = 3;
/// Rows that the search looks at; more are thinned evenly, which moves shares by far less than a
/// percent.
const MAX_ROWS: usize = 60_000;
/// The part of the error that a place in time or frequency must hold.
const HALF: f64 = 0.5;
/// A place that takes more than this part of the whole is no place.
const SPREAD: f64 = 0.35;

/// Finds the state region, the time span and the frequency band that hold most of the error of one
/// axis.
///
/// The state region comes from cutting greedily along one state, or its magnitude, at a time, each
/// cut keeping the side whose mean squared error gains most (a regression tree of which only the
/// worst branch is followed). Time span and band (shares of `band_hz`) are the narrowest that hold
/// half of the error; a time span of more than a third of all says "spread".
pub fn find(
    axis: &str,
    names: &[StateName],
    records: &[ErrorRecord<'_>],
    sample_rate_hz: f64,
    band_hz: f64,
) -> Vec<FailingRegion> {
    let total: f64 = records.iter().flat_map(|r| r.error).map(|e| e * e).sum();
    if total <= 0.0 || total.is_nan() {
        return Vec::new();
    }
    let mut places = Vec::new();
    places.extend(state_region(axis, names, records));
    places.extend(time_span(axis, records, sample_rate_hz, total));
    places.extend(frequency_band(axis, records, sample_rate_hz, band_hz));
    places
}

/// The record in which a constant holds most of the error of an axis, where it is most of the error
/// of that record: what is wrong there is the zero of force, in `unit`, and not how the force
/// follows the motion.
pub fn zero(axis: &str, unit: &str, records: &[ErrorRecord<'_>]) -> Option<FailingRegion> {
    let power = |error: &[f64]| error.iter().map(|e| e * e).sum::<f64>();
    let total: f64 = records.iter().map(|r| power(r.error)).sum();
    let rows: usize = records.iter().map(|r| r.error.len()).sum();
    let of_constant = |record: &ErrorRecord<'_>| {
        let mean = mean(record.error);
        (mean, mean * mean * record.error.len() as f64)
    };
    let constants = records.iter().map(|record| (record, of_constant(record)));
    let (record, (mean, held)) = constants.max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    // An error that is not a number holds nothing.
    if held.is_nan() || held <= HALF * power(record.error) {
        return None;
    }
    Some(FailingRegion {
        axis: axis.into(),
        kind: "zero",
        region: format!(
            "a constant {} {unit} in {}: the zero of its force, so tare the channel or add force_zero@{axis}",
            rounded(mean),
            record.file
        ),
        share_of_error: held / total,
        share_of_rows: record.error.len() as f64 / rows as f64,
        extent: Extent::Everywhere,
    })
}

/// A quantity by which a region can be cut.
struct Feature {
    values: Vec<f64>,
    state: usize,
    magnitude: bool,
}

/// One cut: values of a feature above or below a threshold stay in the region.
struct Cut {
    feature: usize,
    threshold: f64,
    above: bool,
}

fn state_region(
    axis: &str,
    names: &[StateName],
    records: &[ErrorRecord<'_>],
) -> Option<FailingRegion> {
    let rows: usize = records.iter().map(|r| r.error.len()).sum();
    let step = rows.div_ceil(MAX_ROWS).max(1);
    let squares: Vec<f64> = records
        .iter()
        .flat_map(|r| r.error.iter().step_by(step))
        .map(|e| e * e)
        .collect();
    let mut features = Vec::new();
    for state in 0..names.len() {
        let values: Vec<f64> = records
            .iter()
            .flat_map(|r| r.states[state].iter().step_by(step))
            .copied()
            .collect();
        let magnitudes = values.iter().map(|v| v.abs()).collect();
        features.push(Feature {
            values,
            state,
            magnitude: false,
        });
        features.push(Feature {
            values: magnitudes,
            state,
            magnitude: true,
        });
    }

    let total: f64 = squares.iter().sum();
    let least = ((squares.len() as f64 * MIN_ROWS) as usize).max(1);
    let power = |rows: &[usize]| rows.iter().map(|&row| squares[row]).sum::<f64>();
    let mean = |rows: &[usize]| power(rows) / rows.len() as f64;
    // Where the cuts lead up to the last that stands out: one that keeps hardly more than its share
    // may lead to one that does.
    let mut inside: Vec<usize> = (0..squares.len()).collect();
    let (mut cuts, mut standing) = (Vec::new(), 0);
    let mut within = inside.clone();
    for _ in 0..DEPTH {
        let Some((cut, kept)) = best_cut(&features, &squares, &within, least) else {
            break;
        };
        if power(&kept) / total < 0.3 {
            break;
        }
        cuts.push(cut);
        if mean(&kept) > STANDS_OUT * mean(&within) {
            standing = cuts.len();
            inside.clone_from(&kept);
        }
        within = kept;
    }
    cuts.truncate(standing);
    if cuts.is_empty() {
        return Some(FailingRegion {
            axis: axis.into(),
            kind: "state",
            region: "no region of the states stands out".into(),
            share_of_error: 1.0,
            share_of_rows: 1.0,
            extent: Extent::Everywhere,
        });
    }
    let share_of_error = inside.iter().map(|&row| squares[row]).sum::<f64>() / total;
    let share_of_rows = inside.len() as f64 / squares.len() as f64;
    let conditions = conditions(&cuts, &features);
    Some(FailingRegion {
        axis: axis.into(),
        kind: "state",
        region: region_in_words(&conditions, names),
        share_of_error,
        share_of_rows,
        extent: Extent::States(conditions),
    })
}

/// The cut whose kept side stands out most: the largest drop in Σ(e² − mean)², as a regression tree
/// splits.
fn best_cut(
    features: &[Feature],
    squares: &[f64],
    inside: &[usize],
    least: usize,
) -> Option<(Cut, Vec<usize>)> {
    let count = inside.len() as f64;
    let sum: f64 = inside.iter().map(|&row| squares[row]).sum();
    let mut best: Option<(f64, Cut)> = None;
    for (index, feature) in features.iter().enumerate() {
        let mut order: Vec<usize> = inside.to_vec();
        order.sort_by(|&a, &b| feature.values[a].total_cmp(&feature.values[b]));
        let mut below = 0.0;
        let mut taken = 0;
        for part in 1..CUTS {
            let end = order.len() * part / CUTS;
            below += order[taken..end]
                .iter()
                .map(|&row| squares[row])
                .sum::<f64>();
            taken = end;
            let rest = order.len() - end;
            if end < least
                || rest < least
                || feature.values[order[end - 1]] == feature.values[order[end]]
            {
                continue;
            }
            let (mean_below, mean_above) = (below / end as f64, (sum - below) / rest as f64);
            let gain = end as f64 * mean_below * mean_below + rest as f64 * mean_above * mean_above
                - sum * sum / count;
            let above = mean_above > mean_below;
            if best.as_ref().is_none_or(|(most, _)| gain > *most) {
                let threshold = 0.5 * (feature.values[order[end - 1]] + feature.values[order[end]]);
                best = Some((
                    gain,
                    Cut {
                        feature: index,
                        threshold,
                        above,
                    },
                ));
            }
        }
    }
    let (_, cut) = best?;
    let values = &features[cut.feature].values;
    let kept: Vec<usize> = inside
        .iter()
        .copied()
        .filter(|&row| (values[row] > cut.threshold) == cut.above)
        .collect();
    Some((cut, kept))
}

/// What all cuts together ask of the states, in the order of the features.
fn conditions(cuts: &[Cut], features: &[Feature]) -> Vec<Condition> {
    // Several cuts of one quantity on the same side are one condition: the last is the tightest.
    let last = |feature: usize, above: bool| {
        let mut mine = cuts.iter().rev();
        let cut = mine.find(|c| c.feature == feature && c.above == above)?;
        Some(cut.threshold)
    };
    let condition = |(index, feature): (usize, &Feature)| {
        let (above, below) = (last(index, true), last(index, false));
        (above.is_some() || below.is_some()).then_some(Condition {
            state: feature.state,
            magnitude: feature.magnitude,
            above,
            below,
        })
    };
    features.iter().enumerate().filter_map(condition).collect()
}

fn region_in_words(conditions: &[Condition], names: &[StateName]) -> String {
    let words = conditions.iter().map(|condition| {
        let name = &names[condition.state];
        let quantity = if condition.magnitude {
            format!("|{}|", name.name)
        } else {
            name.name.clone()
        };
        let side = |threshold: Option<f64>| threshold.map(|t| rounded(t * name.factor));
        match (side(condition.above), side(condition.below)) {
            (Some(low), Some(high)) => format!("{quantity} from {low} to {high} {}", name.unit),
            (Some(low), None) => format!("{quantity} above {low} {}", name.unit),
            (None, Some(high)) => format!("{quantity} below {high} {}", name.unit),
            (None, None) => quantity,
        }
    });
    words.collect::<Vec<_>>().join(" and ")
}

fn time_span(
    axis: &str,
    records: &[ErrorRecord<'_>],
    rate: f64,
    total: f64,
) -> Option<FailingRegion> {
    let rows: usize = records.iter().map(|r| r.error.len()).sum();
    // The narrowest stretch of one record that holds half of all the error.
    let each = records.iter().enumerate().filter_map(|(index, record)| {
        let squares: Vec<f64> = record.error.iter().map(|e| e * e).collect();
        narrowest_half(&squares, total).map(|(rows, share)| (index, rows, share))
    });
    let best = each.min_by_key(|(_, rows, _)| rows.len());
    let evenly = || FailingRegion {
        axis: axis.into(),
        kind: "time",
        region: "spread evenly over time".into(),
        share_of_error: 1.0,
        share_of_rows: 1.0,
        extent: Extent::Everywhere,
    };
    let Some((index, stretch, share)) = best else {
        return Some(evenly());
    };
    let part = stretch.len() as f64 / rows as f64;
    if part > SPREAD {
        return Some(evenly());
    }
    let record = &records[index];
    let at = |row: usize| record.start_s + row as f64 / rate;
    Some(FailingRegion {
        axis: axis.into(),
        kind: "time",
        region: format!(
            "{} from {:.3} s to {:.3} s",
            record.file,
            at(stretch.start),
            at(stretch.end - 1)
        ),
        share_of_error: share,
        share_of_rows: part,
        extent: Extent::Time {
            file: record.file.into(),
            from_s: at(stretch.start),
            to_s: at(stretch.end - 1),
        },
    })
}

/// The narrowest run that holds half of `total`, by two pointers, and its share of it; nothing
/// where all together hold less.
fn narrowest_half(parts: &[f64], total: f64) -> Option<(Range<usize>, f64)> {
    let (mut first, mut sum) = (0, 0.0);
    let mut best: Option<(Range<usize>, f64)> = None;
    for (last, part) in parts.iter().enumerate() {
        sum += part;
        while sum - parts[first] >= HALF * total {
            sum -= parts[first];
            first += 1;
        }
        let run = first..last + 1;
        let narrower = best.as_ref().is_none_or(|(best, _)| run.len() < best.len());
        if sum >= HALF * total && narrower {
            best = Some((run, sum / total));
        }
    }
    best
}

fn frequency_band(
    axis: &str,
    records: &[ErrorRecord<'_>],
    rate: f64,
    band_hz: f64,
) -> Option<FailingRegion> {
    // Lines half a hertz apart or finer, as long as the shortest record allows.
    let shortest = records.iter().map(|r| r.error.len()).min()?;
    let mut accumulator = Accumulator::new(rate, ((2.0 * rate) as usize).min(shortest));
    records.iter().for_each(|r| accumulator.add(r.error));
    let spectrum = accumulator.finish();
    let power = &spectrum.density;
    let total: f64 = power.iter().sum();
    if total <= 0.0 || total.is_nan() {
        return None;
    }
    let (lines, share) = narrowest_half(power, total)?;
    let step = spectrum.resolution_hz;
    let low = (lines.start as f64 - 0.5).max(0.0) * step;
    let high = (lines.end as f64 - 0.5) * step;
    Some(FailingRegion {
        axis: axis.into(),
        kind: "frequency",
        region: format!("{} Hz to {} Hz", rounded(low), rounded(high)),
        share_of_error: share,
        share_of_rows: (lines.len() as f64 * step / band_hz).min(1.0),
        extent: Extent::Frequency([low, high]),
    })
}

#[cfg(test)]
mod tests;
