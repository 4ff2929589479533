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
mod too_few;

use crate::signal::motion::Filters;
use crate::study::Study;
use crate::study::series::spread;
use channel::channels;
pub use finding::Finding;
use finding::RecordPosition;
use rayon::prelude::*;

/// Everything that is wrong with a study's data, the serious first.
///
/// Without time a channel may stand still or jump from row to row, so only what a law is learnt
/// from is counted.
pub fn check(study: &Study, filters: &Filters) -> Vec<Finding> {
    let axes = 0..study.axes.len();
    let few: Vec<Finding> = axes
        .clone()
        .flat_map(|axis| too_few::check(study, axis))
        .collect();
    if study.quasi_static {
        return serious_first(few);
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
    found.extend(few);
    for index in 0..study.axes.len() {
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
