//! Drift and threshold of one cumulative sum, from the values that its statistic takes on a healthy
//! joint.

use super::figures::{GROSS, MIN_BLOCKS};
use crate::study::series::mean;
use jointwatch_shared::monitor::limits::MAX_CUSUM;
use jointwatch_shared::monitor::{MAX_OF_SHARE, OCTAVE, least_blocks, most_of_block};
use serde::Serialize;

/// Blocks in a row over which increments are summed up: how they hang together shows in the sums of
/// several. How well a model does, which is what the error tells, hangs together for longer than
/// which way it is wrong.
const GROUPS: [usize; 3] = [1, 2, 4];
const GROUPS_OF_ERROR: [usize; 5] = [1, 2, 4, 8, 16];
/// What one block may add at least to the sum of the error, in octaves of power, and to that of a
/// gross change.
const MIN_STEP_OCTAVES: f64 = 1.5;
const MIN_GROSS_STEP_OCTAVES: f64 = 1.0;
/// Where the drift may lie between the healthy mean and that of a changed joint.
const PARTS_OF_SHIFT: [f64; 7] = [0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5];
/// What of the shift a changed joint shows at least, as it moves less than before or its friction
/// is dry.
const SHOWN_OF_SHIFT: f64 = 0.7;
/// Standard deviations of its own uncertainty by which a mean or a variance is taken larger than it
/// came out.
const CAUTION: f64 = 2.0;
/// The part of a statistic's highest values to which the exponential tail is fitted.
const TAIL: f64 = 0.1;
/// Past this rate no threshold is above its least one, in 1 over a statistic's unit.
const MAX_RATE: f64 = 1e6;
/// How often the threshold of a gross change is raised until a block adds no more than it bears.
const ROUNDS: usize = 50;
/// What one statistic of one axis looks like on a healthy joint, in its own unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Healthy {
    /// Largest mean over the records, with its uncertainty.
    pub mean: f64,
    /// Square root of the long-run variance of a block's increment, with its uncertainty.
    pub spread: f64,
    /// Above which the cumulative sum rises.
    pub drift: f64,
    /// Where it raises the alarm.
    pub threshold: f64,
    /// Blocks from a change of `CHANGE` of the RMS force to the alarm, in the mean.
    pub blocks_to_alarm: f64,
}

/// The limits of one side of one statistic that a change shifts by `shift`.
pub(super) fn healthy(
    records: &[(bool, Vec<f64>)],
    side: usize,
    shift: f64,
    log_rarity: f64,
) -> Healthy {
    let all: Vec<&Vec<f64>> = records
        .iter()
        .filter(|(_, s)| s.len() >= MIN_BLOCKS)
        .map(|(_, s)| s)
        .collect();
    let validation: Vec<&Vec<f64>> = records.iter().filter(|(v, _)| *v).map(|(_, s)| s).collect();
    let mine: Vec<f64> = validation.iter().copied().flatten().copied().collect();
    let middle = mean(&mine);
    let uncertainty = (long_run_variance(&validation).0 / mine.len() as f64).sqrt();
    let largest = all.iter().map(|s| mean(s)).fold(middle, f64::max);
    // Where every record is short, those of validation are together long enough.
    let all = if all.is_empty() {
        validation.clone()
    } else {
        all
    };
    let from = Evidence {
        side,
        shift,
        log_rarity,
        mean: largest + CAUTION * uncertainty,
        all: &all,
        validation: &validation,
    };
    if side == 0 {
        return from.limit(0.5);
    }
    let limits = PARTS_OF_SHIFT.iter().map(|&part| from.limit(part));
    let soonest = limits.min_by(|a, b| a.blocks_to_alarm.total_cmp(&b.blocks_to_alarm));
    // There is at least one part.
    soonest.unwrap_or_else(|| from.limit(0.5))
}

/// The threshold of a gross change, whose drift is given, from the values on every record.
pub(super) fn gross_threshold(
    records: &[Vec<f64>],
    side: usize,
    drift: f64,
    log_rarity: f64,
) -> f64 {
    let all: Vec<&Vec<f64>> = records.iter().filter(|s| s.len() >= MIN_BLOCKS).collect();
    if all.is_empty() {
        return 0.0;
    }
    let means = all.iter().map(|s| mean(s));
    let from = Evidence {
        side,
        shift: 0.0,
        log_rarity,
        mean: means.fold(f64::NEG_INFINITY, f64::max),
        all: &all,
        validation: &[],
    };
    // A lower threshold lets a block add less, which in turn is what allows for a lower threshold:
    // the least that its own step bears.
    let step_of = |threshold: f64| f64::from(most_of_block(side, threshold.ceil() as i32));
    let mut threshold = from.least();
    for _ in 0..ROUNDS {
        let (needed, _) = from.threshold(drift, step_of(threshold));
        if needed <= threshold {
            return threshold;
        }
        threshold = needed;
    }
    from.threshold(drift, f64::INFINITY).0
}

/// What the limits of one side of one statistic are made from.
struct Evidence<'a> {
    side: usize,
    /// By a change of `CHANGE` of the RMS force.
    shift: f64,
    log_rarity: f64,
    /// In control, with its uncertainty.
    mean: f64,
    /// Every record with enough judged blocks, or all of validation.
    all: &'a [&'a Vec<f64>],
    validation: &'a [&'a Vec<f64>],
}

impl Evidence<'_> {
    /// With the drift at this part of the shift.
    fn limit(&self, part: f64) -> Healthy {
        let drift = self.mean + part * self.shift;
        // What a block may add depends on the threshold, and the threshold on it: a step that is
        // larger than the one that the device will take is on the safe side.
        let step_of = |threshold: f64| f64::from(most_of_block(self.side, threshold.ceil() as i32));
        let (unheld, _) = self.threshold(drift, f64::INFINITY);
        let (threshold, spread) = self.threshold(drift, step_of(unheld));
        let shown = if self.side == 0 { 1.0 } else { SHOWN_OF_SHIFT };
        let step = step_of(threshold);
        let steps = self.validation.iter().copied().flatten();
        let steps = steps.map(|y| (y + shown * self.shift - drift).min(step));
        Healthy {
            mean: self.mean,
            spread,
            drift,
            threshold,
            blocks_to_alarm: threshold / mean(&steps.collect::<Vec<_>>()).max(1e-9),
        }
    }

    /// The threshold when a block adds `most` at most, and the root of the increments' long-run
    /// variance.
    fn threshold(&self, drift: f64, most: f64) -> (f64, f64) {
        let moved = |record: &&Vec<f64>| -> Vec<f64> {
            let by = self.mean - mean(record) - drift;
            record.iter().map(|y| (y + by).min(most)).collect()
        };
        let increments: Vec<Vec<f64>> = self.all.iter().map(moved).collect();
        // The device's sum takes steps down as they come. One whose steps down are held as those up
        // are is never below it, so what is true of how rarely that one rises is true of
        // the device's; and a model that is now and then wrong by far the other way, as a
        // polynomial is, does not count for one that wanders.
        let held = |record: &Vec<f64>| record.iter().map(|z| z.max(-most)).collect();
        let held: Vec<Vec<f64>> = increments.iter().map(held).collect();
        let (variance, length) = long_run_variance(&held.iter().collect::<Vec<_>>());
        let flat: Vec<f64> = held.iter().flatten().copied().collect();
        // Independent values that the blocks are worth; a variance from n of them is off by √(2/n)
        // of itself.
        let worth = (flat.len() as f64 / length).max(2.0);
        let variance = variance * (1.0 + CAUTION * (2.0 / worth).sqrt());
        let gaussian = -2.0 * mean(&flat) / variance.max(1e-9);
        let of_error = self.side == 0;
        let groups: &[usize] = if of_error { &GROUPS_OF_ERROR } else { &GROUPS };
        // A healthy joint is so far from a gross change that none of its blocks is held. What a
        // longer look would show is: the tail ends where the device's steps do. How blocks
        // hang together is taken from held steps: by how much a healthy block is
        // below the drift wanders by many of them, and says nothing about how the sum would rise.
        let is_gross = GROSS.contains(&self.side);
        let reach = if is_gross { most } else { f64::INFINITY };
        let of_group = |&group: &usize| {
            let steps = if is_gross && group > 1 {
                &held
            } else {
                &increments
            };
            tail_rate(steps, group, reach)
        };
        let rate = groups.iter().map(of_group).fold(gaussian, f64::min);
        let threshold = (self.log_rarity / rate.max(1e-9)).max(self.least());
        (threshold.min(f64::from(MAX_CUSUM)), variance.sqrt())
    }

    /// The least threshold: the fewest blocks that raise an alarm, times a step of this side.
    fn least(&self) -> f64 {
        let step = if self.side == 0 {
            MIN_STEP_OCTAVES * f64::from(OCTAVE)
        } else if GROSS.contains(&self.side) {
            MIN_GROSS_STEP_OCTAVES * f64::from(OCTAVE)
        } else {
            f64::from(MAX_OF_SHARE)
        };
        f64::from(least_blocks(self.side)) * step
    }
}

/// σ²·(1 + 2·Σρ_k): how fast the variance of a sum of blocks grows, never less than that of one
/// block, and how many blocks are worth one independent value. Lags up to twice the cube root of
/// their number, with Bartlett's weights (Newey and West, Econometrica 55, 1987, 703–708).
fn long_run_variance(records: &[&Vec<f64>]) -> (f64, f64) {
    let count: usize = records.iter().map(|s| s.len()).sum();
    let middle = records.iter().copied().flatten().sum::<f64>() / count.max(1) as f64;
    let lags = (2.0 * (count as f64).cbrt()).round() as usize;
    let covariance = |lag: usize| {
        let products = records
            .iter()
            .flat_map(|s| s.iter().zip(s.iter().skip(lag)));
        products
            .map(|(a, b)| (a - middle) * (b - middle))
            .sum::<f64>()
            / count as f64
    };
    let variance = covariance(0);
    let weighted = (1..=lags).map(|lag| (1.0 - lag as f64 / (lags + 1) as f64) * covariance(lag));
    let sum = variance + 2.0 * weighted.sum::<f64>();
    let long_run = sum.max(variance);
    (long_run, (long_run / variance.max(1e-12)).max(1.0))
}

/// The root θ of E exp(θ·Z) = 1 for Z the sum of `group` increments in a row: the records' own sums
/// in the body, and beyond their highest tenth an exponential with the mean excess found there,
/// taken larger by its uncertainty, up to `reach` per increment. Infinite when that tenth is one
/// value that is not above 0.
fn tail_rate(records: &[Vec<f64>], group: usize, reach: f64) -> f64 {
    let mut sums: Vec<f64> = records
        .iter()
        .flat_map(|s| s.windows(group).map(|w| w.iter().sum::<f64>()))
        .collect();
    sums.sort_by(f64::total_cmp);
    let beyond = ((TAIL * sums.len() as f64) as usize).max(4).min(sums.len());
    let (body, tail) = sums.split_at(sums.len() - beyond);
    let edge = tail.first().copied().unwrap_or(0.0);
    let independent = (beyond as f64 / group as f64).max(1.0);
    let excess = mean(&tail.iter().map(|z| z - edge).collect::<Vec<_>>());
    // Values that the step holds may all be one, which a tail of no width would take for none.
    let excess = (excess * (1.0 + CAUTION / independent.sqrt())).max(1e-3 * edge);
    let moment = |rate: f64| {
        let body: f64 = body.iter().map(|z| (rate * z).exp()).sum();
        let tail = beyond as f64 * held_moment(rate, edge, excess, reach * group as f64);
        (body + tail) / sums.len() as f64
    };
    if excess <= 0.0 {
        return f64::INFINITY;
    }
    // The moment is 1 at 0, falls when the mean is negative, and grows beyond all bounds: before
    // 1/excess where nothing is held.
    let (mut low, mut high) = (0.0, 1.0 / excess);
    while moment(high) < 1.0 && high < MAX_RATE {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if moment(middle) < 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// E exp(rate·Z) for Z above `edge` by an exponential with this mean, held at `reach`.
fn held_moment(rate: f64, edge: f64, excess: f64, reach: f64) -> f64 {
    let (at_edge, falls) = ((rate * edge).exp(), 1.0 - rate * excess);
    if reach.is_infinite() {
        return if falls > 0.0 {
            at_edge / falls
        } else {
            f64::INFINITY
        };
    }
    let width = (reach - edge).max(0.0) / excess;
    let held = (rate * reach - width).exp();
    let below = if falls.abs() < 1e-9 {
        at_edge * width
    } else {
        (at_edge - held) / falls
    };
    below + held
}
