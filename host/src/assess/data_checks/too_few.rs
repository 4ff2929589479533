//! Too few of what a law is learnt from: counts of an encoder, levels of a force, rows between the
//! turns of a motion.

use super::finding::Finding;
use crate::study::quasi_static::direction_beyond;
use crate::study::series::{mean, median, range};
use crate::study::{Channels, Role, Study};
use std::collections::{BTreeMap, HashSet};

/// Counts from one end of the motion to the other below which a displacement has too few: rounding
/// to counts then makes an error of 1/(√12·counts) of the motion, which for a spring is above the
/// half per cent at which effects are looked for.
const FEW_COUNTS: f64 = 50.0;
/// Counts below which it is next to nothing: the rounding alone is 3 % of the motion.
const NEXT_TO_NO_COUNTS: f64 = 10.0;
/// A force of no more levels is one that is switched.
const MOST_LEVELS: usize = 4;
/// The motion switches it where it tells more than half of the force's variance.
const SWITCHED: f64 = 0.5;
/// Rows below which it may have a few levels by chance.
const LEAST_ROWS: usize = 100;
/// Rows from one turn of the motion to the next below which the way between is not known: a loop
/// has a side, and a side more than its ends.
const FEW_BETWEEN_TURNS: f64 = 5.0;
/// Turns that show how many.
const LEAST_TURNS: usize = 6;
/// A motion turns where it comes back by this part of its range.
const TURN: f64 = 0.05;

/// What there is too little of on an axis.
pub(super) fn check(study: &Study, index: usize) -> impl Iterator<Item = Finding> {
    let all = [
        counts(study, index),
        levels(study, index),
        rows(study, index),
    ];
    all.into_iter().flatten()
}

fn training(study: &Study, index: usize) -> impl Iterator<Item = &Channels> {
    let records = study.records.iter().filter(|r| r.role == Role::Train);
    records.map(move |record| &record.axes[index])
}

/// Whether a force is switched between a few levels by the motion: whatever else switches with it
/// explains it wholly. A drive that switches by itself is a good one.
fn levels(study: &Study, index: usize) -> Option<Finding> {
    let mut levels = HashSet::new();
    let mut rows = 0;
    for channels in training(study, index) {
        for force in &channels.force {
            levels.insert(force.to_bits());
            rows += 1;
            if levels.len() > MOST_LEVELS {
                return None;
            }
        }
    }
    let is_switched = levels.len() > 1 && rows > LEAST_ROWS;
    (is_switched && switched_by_the_motion(study, index) > SWITCHED).then(|| Finding {
        sentence: format!(
            "axis {}: its force takes {} values alone in {rows} rows and switches with the motion, so any law that does so explains it; \
             log the force that acts at the joint, or drive it at many levels",
            study.axes[index].name,
            levels.len()
        ),
        serious: true,
        spikes: None,
    })
}

/// The part of a force's variance that is told by the direction of travel and the side of the
/// middle.
fn switched_by_the_motion(study: &Study, index: usize) -> f64 {
    let mut sides: BTreeMap<[bool; 2], Vec<f64>> = BTreeMap::new();
    for channels in training(study, index) {
        let displacement = channels.relative_displacement();
        let middle = median(displacement.clone()).unwrap_or_default();
        let steps = displacement.windows(2).zip(&channels.force);
        for (step, force) in steps {
            let side = [step[1] > step[0], step[0] > middle];
            sides.entry(side).or_default().push(*force);
        }
    }
    let whole: Vec<f64> = sides.values().flatten().copied().collect();
    let deviation = |forces: &[f64]| {
        let mean = mean(forces);
        forces.iter().map(|f| (f - mean).powi(2)).sum::<f64>()
    };
    let within: f64 = sides.values().map(|forces| deviation(forces)).sum();
    1.0 - within / deviation(&whole).max(f64::MIN_POSITIVE)
}

/// Whether next to nothing was logged between the turns of a motion.
fn rows(study: &Study, index: usize) -> Option<Finding> {
    let mut between: Vec<f64> = Vec::new();
    for channels in training(study, index) {
        let displacement = channels.relative_displacement();
        let direction = direction_beyond(&displacement, TURN * range(&displacement));
        let runs = direction.chunk_by(|a, b| a == b);
        between.extend(runs.map(|run| run.len() as f64));
    }
    let turns = between.len();
    let few = median(between)?;
    (turns > LEAST_TURNS && few < FEW_BETWEEN_TURNS).then(|| Finding {
        sentence: format!(
            "axis {}: its motion turns every {few:.0} rows, so what the force does between the turns is hardly known, and the shape of a \
             loop less; log more rows a cycle",
            study.axes[index].name
        ),
        serious: false,
        spikes: None,
    })
}

/// Whether an encoder's count is too coarse for the motion of an axis.
fn counts(study: &Study, index: usize) -> Option<Finding> {
    let axis = &study.axes[index];
    let step = axis.encoder_step?;
    let ranges = training(study, index).map(|channels| range(&channels.relative_displacement()));
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
