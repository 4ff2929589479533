//! Whether the logs can be believed, before anything is read into them: clipped, stuck, dropped
//! out, wrong in single rows, too coarse, humming, skewed.
//!
//! A finding is serious when what it spoils is of the size of the effects that a diagnosis looks
//! for; then the verdict is "data". The others are remarks: they are said, and the diagnosis
//! stands.

mod channel;
mod clipping;
mod dropouts;
mod finding;
mod mains;
mod single;
mod skew;
mod stuck;

use crate::signal::motion::Filters;
use crate::study::series::{range, spread};
use crate::study::{Role, Study};
use channel::channels;
pub use finding::Finding;
use finding::RecordPosition;
use rayon::prelude::*;

/// Counts from one end of the motion to the other below which a displacement has too few: rounding
/// to counts then makes an error of 1/(√12·counts) of the motion, which for a spring is above the
/// half per cent at which effects are looked for.
const FEW_COUNTS: f64 = 50.0;
/// Counts below which it is next to nothing: the rounding alone is 3 % of the motion.
const NEXT_TO_NO_COUNTS: f64 = 10.0;

/// Everything that is wrong with a study's data, the serious first.
///
/// Without time a channel may stand still or jump from row to row, so only the resolution of the
/// displacement is looked at.
pub fn check(study: &Study, filters: &Filters) -> Vec<Finding> {
    let axes = 0..study.axes.len();
    if study.quasi_static {
        let coarse = axes.filter_map(|index| coarse(study, index));
        return serious_first(coarse.collect());
    }
    let liveliest: Vec<Vec<f64>> = axes.map(|index| liveliest(study, index)).collect();
    let records = study.records.par_iter().flat_map_iter(|record| {
        let axes = study.axes.iter().zip(&record.axes).zip(&liveliest);
        axes.enumerate()
            .flat_map(|(index, ((axis, logged), liveliest))| {
                let all = channels(axis, logged);
                let place = RecordPosition {
                    file: &record.file,
                    axis: index,
                    first_row: record.first_row,
                    sample_rate_hz: study.sample_rate_hz,
                };
                let mut found = stuck::check(&all, liveliest, &place);
                for channel in &all {
                    found.extend(clipping::check(channel, &place));
                    found.extend(dropouts::check(channel, &place));
                    found.extend(single::check(channel, &place, filters));
                }
                found
            })
            .collect::<Vec<_>>()
    });
    let mut found: Vec<Finding> = records.collect();
    for index in 0..study.axes.len() {
        found.extend(coarse(study, index));
        found.extend(mains::check(study, index));
        found.extend(skew::check(study, index, filters));
    }
    serious_first(found)
}

fn serious_first(mut found: Vec<Finding>) -> Vec<Finding> {
    found.sort_by_key(|finding| !finding.serious);
    found
}

/// What was found, in words, the serious first.
pub fn sentences(findings: Vec<Finding>) -> Vec<String> {
    findings.into_iter().map(|f| f.sentence).collect()
}

/// The greatest liveliness of every channel of an axis in any record: RMS about the mean. White
/// noise is in it by its own size only, which for a sensor that is any good is a small part of the
/// motion's.
fn liveliest(study: &Study, index: usize) -> Vec<f64> {
    let records = study.records.iter();
    let all = records.map(|record| channels(&study.axes[index], &record.axes[index]));
    all.fold(Vec::new(), |mut most: Vec<f64>, channels| {
        most.resize(channels.len(), 0.0);
        for (most, channel) in most.iter_mut().zip(&channels) {
            *most = most.max(spread(channel.series));
        }
        most
    })
}

/// Whether an encoder's count is too coarse for the motion of an axis.
fn coarse(study: &Study, index: usize) -> Option<Finding> {
    let axis = &study.axes[index];
    let step = axis.encoder_step?;
    let training = study.records.iter().filter(|r| r.role == Role::Train);
    let ranges = training.map(|record| {
        let relative = record.axes[index].relative_displacement();
        range(&relative)
    });
    let counts = ranges.fold(0.0, f64::max) / step;
    // Next to no motion at all is not the encoder's fault; the fit says what it could not
    // determine.
    (1.0..FEW_COUNTS).contains(&counts).then(|| Finding {
        sentence: format!(
            "axis {}: its displacement moves over {counts:.0} counts of the encoder in all training records, and its velocity is \
             derived from those; shake harder, or use a finer encoder",
            axis.name
        ),
        serious: counts < NEXT_TO_NO_COUNTS,
        spikes: None,
    })
}
