//! The monitor's limits, from how a healthy joint's validation records look after the device's own
//! integers.
//!
//! Every record runs through the chain and the monitor itself; what the monitor sums up per block
//! is what the limits are set on. `docs/explanation/monitor.md` derives the formulas; in short, per
//! statistic y and side:
//!
//! - in-control mean μ: the largest over the records (a model is better on one than on another),
//!   plus its own uncertainty;
//! - drift = μ + a part of the shift that a change by 10 % of the RMS force makes: a half for the
//!   error, and for stiffness and friction that part with which the change is found soonest;
//! - increments z = min(y − drift, c), as the device holds them, as if every record had the mean μ;
//! - θ, the rate at which the sum's excursions die out: the root of E exp(θ·Z) = 1 for Z the sum of
//!   1, 2, 4 (and for the error 8 and 16) blocks in a row of any record, whose highest tenth an
//!   exponential continues, and the Gaussian −2·E z/σ² with the long-run variance of all records'
//!   z, steps down held to c as well, and its own uncertainty; the smallest counts;
//! - threshold = ln(blocks between false alarms × statistics)/θ, and never under a least one.
//!
//! A stated drift of gain and stiffness is taken for healthy: every record counts once more with
//! its forces, and once more with its displacements, larger and smaller by that part. What was set
//! is tried on the records it was set from, drifted ones included, and raised where one of them
//! comes near an alarm.

mod board;
mod calibration;
mod chained;
mod cusum;
mod drift;
mod figures;
pub(crate) mod rate;
mod trial;

use crate::device::replay::SetUp;
use crate::fit::errors::AT_REST_BELOW;
use crate::study::series::{dot, mean, mean_square, spread};
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
pub use board::BoardError;
pub use calibration::Calibration;
use chained::ChainedRecord;
pub use cusum::Healthy;
use cusum::{gross_threshold, healthy};
use figures::{GROSS, MIN_BLOCKS, quarters};
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::limits::{
    AxisLimits, CHANNELS, Cusum, Limits, MAX_CUSUM, TwoSided,
};
use jointwatch_shared::monitor::{
    GrossSums, Monitor, MonitorState, OCTAVE, SIDES, Sums, share_of_change,
};
use rate::block;

/// The change of stiffness or friction that the limits are tuned to, as a part of the RMS force.
const CHANGE: f64 = 0.1;
/// The least drift above the healthy mean of the error, in octaves of power.
const MIN_GROWTH_OCTAVES: f64 = 0.5;
/// Share of the time outside the training range that is suspect, in 1/1000, where the validation
/// records ask for no more.
const OUTSIDE_PERMILLE: f64 = 200.0;
/// What the limits are for, besides a model on a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Purpose {
    /// The checksum of the model blob.
    pub model_checksum: u32,
    /// Mean time between false alarms, h.
    pub false_alarm_hours: u32,
    /// By how much gain and stiffness may drift on a healthy joint, as a part of themselves.
    pub drift: f64,
}

/// Sets the limits for a model on the rig of a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study has no validation record or too little of it
/// moves inside the training range, and when a monitor with these limits raises an alarm on the
/// very records they were set from.
pub fn limits(
    study: &Study,
    set_up: &SetUp,
    model: &Model,
    purpose: Purpose,
) -> Result<Calibration> {
    let refuse = |what: String| Error::data(format!("{}: {what}", study.path.display()));
    if study.records.iter().all(|r| r.role != Role::Validate) {
        return Err(refuse(
            "no record has role = \"validate\", and the monitor's limits come from those; log one that the model was not \
             learnt from"
                .into(),
        ));
    }
    let records = study.records.iter();
    let chained_records: Vec<ChainedRecord> = records
        .map(|r| ChainedRecord::new(r, set_up, model))
        .collect();
    board::check_rails(study, &chained_records)?;
    let board = match set_up.wired() {
        Some(_) => board::errors(study, set_up, model)?,
        None => Vec::new(),
    };
    // What the board measures wrongly is the cause of whatever comes of it.
    let doubt = board.iter().find_map(BoardError::doubt);
    let set = set(study, set_up, model, purpose, &chained_records);
    let calibration = match doubt {
        Some(doubt) => set.map_err(|_| refuse(doubt))?,
        None => set?,
    };
    Ok(Calibration {
        board,
        ..calibration
    })
}

/// Sets the limits from records that have gone through the chain.
fn set(
    study: &Study,
    set_up: &SetUp,
    model: &Model,
    purpose: Purpose,
    chained_records: &[ChainedRecord],
) -> Result<Calibration> {
    let refuse = |what: String| Error::data(format!("{}: {what}", study.path.display()));
    let block = block(study.sample_rate_hz);
    let mut limits = Limits {
        model_checksum: purpose.model_checksum,
        block,
        outside_permille: outside_permille(chained_records),
        false_alarm_hours: purpose.false_alarm_hours,
        axes: (0..study.axes.len())
            .map(|axis| scales(chained_records, axis))
            .collect(),
    };
    let not_held = |e| refuse(format!("the monitor's limits cannot be held ({e})"));
    let monitor = Monitor::new(limits.clone(), &set_up.chain).map_err(not_held)?;
    let mut seen: Vec<Seen> = chained_records
        .iter()
        .map(|c| Seen::of(&monitor, c))
        .collect();
    drift::each(study, set_up, model, purpose.drift, |chained| {
        seen.push(Seen::of(&monitor, chained));
        Ok(())
    })?;

    let blocks_between =
        f64::from(purpose.false_alarm_hours) * 3600.0 * study.sample_rate_hz / f64::from(block);
    let log_rarity = (blocks_between * SIDES as f64 * study.axes.len() as f64).ln();
    let mut healthy = Vec::new();
    let mut judged = Vec::new();
    for (axis, mine) in limits.axes.iter_mut().enumerate() {
        let (sides, count) = set_axis(mine, axis, &seen, &monitor, log_rarity);
        if count < MIN_BLOCKS {
            return Err(refuse(format!(
                "only {count} blocks of {:.0} ms of the validation records move {} inside the training range, and the \
                 monitor's limits need {MIN_BLOCKS}; log a longer record for validation",
                1e3 * f64::from(block) / study.sample_rate_hz,
                study.axes[axis].name
            )));
        }
        healthy.push(sides);
        judged.push(count);
    }
    limits.check().map_err(not_held)?;
    let mut calibration = Calibration {
        limits,
        blocks: judged,
        healthy,
        board: Vec::new(),
    };
    trial::raise(
        &mut calibration,
        study,
        set_up,
        model,
        chained_records,
        purpose.drift,
    )?;
    Ok(calibration)
}

/// Sets the cumulative sums of one axis; how they came out, and the judged blocks of validation.
fn set_axis(
    mine: &mut AxisLimits,
    axis: usize,
    seen: &[Seen],
    monitor: &Monitor,
    log_rarity: f64,
) -> ([Healthy; 5], usize) {
    mine.per_octave = per_octave(&series(seen, axis, mine, monitor.log_values()));
    let series = series(seen, axis, mine, monitor.log_values());
    let validation = series.iter().filter(|s| s.validation);
    let count = validation.map(|s| s.values.len()).sum();
    if count < MIN_BLOCKS {
        return ([Healthy::default(); 5], count);
    }
    let sides = sides(&series, log_rarity);
    let [error, stiffer, softer, more, less] = sides.map(|side| Cusum {
        drift: side.drift.round() as i32,
        threshold: side.threshold.ceil() as i32,
    });
    mine.error = error;
    mine.stiffness = TwoSided {
        more: stiffer,
        less: softer,
    };
    mine.friction = TwoSided { more, less };
    let of_gross = |side: usize| {
        let [sum, _] = mine.gross_sums();
        let drift = f64::from(sum.drift);
        let records = gross(seen, axis, side, mine, monitor.log_values());
        let threshold = gross_threshold(&records, GROSS[side], drift, log_rarity);
        quarters(threshold)
    };
    mine.gross = [of_gross(0), of_gross(1)];
    (sides, count)
}

/// The values of a gross change to less (0) or more (1) force, per record that is not a short one.
fn gross(
    seen: &[Seen],
    axis: usize,
    side: usize,
    limits: &AxisLimits,
    log_values: u32,
) -> Vec<Vec<f64>> {
    let of_record = |seen: &Seen| -> Vec<f64> {
        let blocks = seen.gross.iter();
        let judged = blocks.filter_map(|(sums, outside)| {
            let gross = sums[axis].judged(limits, log_values, *outside)?;
            (gross.side == side).then_some(f64::from(gross.value))
        });
        judged.collect()
    };
    seen.iter().map(of_record).collect()
}

/// Three times the share of the validation records, and [`OUTSIDE_PERMILLE`] at least.
fn outside_permille(chained_records: &[ChainedRecord]) -> u16 {
    let outputs = || {
        validation(chained_records)
            .flat_map(|c| &c.samples)
            .filter_map(|s| s.output.as_ref())
    };
    let outside = outputs().filter(|o| o.outside != 0).count() as f64;
    let share = outside / outputs().count().max(1) as f64;
    (3e3 * share).clamp(OUTSIDE_PERMILLE, 1e3).round() as u16
}

fn validation(chained_records: &[ChainedRecord]) -> impl Iterator<Item = &ChainedRecord> {
    chained_records.iter().filter(|chained| chained.validation)
}

/// Powers of force and states, the sign of the axis, and how far a channel goes when it moves;
/// cumulative sums that never end, for the run that measures what they are to be.
fn scales(chained_records: &[ChainedRecord], axis: usize) -> AxisLimits {
    let force_of = |chained: &ChainedRecord| -> Vec<f64> {
        let outputs = chained.samples.iter().filter_map(|s| s.output.as_ref());
        outputs.map(|o| f64::from(o.measured[axis])).collect()
    };
    let powers: Vec<(f64, &ChainedRecord)> = validation(chained_records)
        .map(|chained| (mean_square(&force_of(chained)), chained))
        .collect();
    let largest = powers.iter().map(|(power, _)| *power).fold(0.0, f64::max);
    // A record in which the axis rests says nothing about how far it moves.
    let moving: Vec<&ChainedRecord> = powers
        .iter()
        .filter(|(power, _)| *power >= AT_REST_BELOW * AT_REST_BELOW * largest)
        .map(|(_, chained)| *chained)
        .collect();
    let outputs = || {
        moving
            .iter()
            .flat_map(|c| &c.samples)
            .filter_map(|s| s.output.as_ref())
    };
    let force: Vec<f64> = outputs().map(|o| f64::from(o.measured[axis])).collect();
    let states = [0, 1].map(|s| -> Vec<f64> {
        outputs()
            .map(|o| f64::from(o.state[2 * axis + s] >> 16))
            .collect()
    });
    let rms = mean_square(&force).sqrt();
    let force_shift = (rms.log2() - 16.0).ceil().clamp(0.0, 30.0);
    let unit = force_shift.exp2();
    let power = |value: f64| (value.round() as u64).max(1);
    // Whichever of displacement and velocity the force goes with more tells the sign of the axis.
    let along = states.each_ref().map(|state| correlation(&force, state));
    let [x, v] = along;
    let whole = |channel: usize| -> Vec<f64> {
        let samples = moving.iter().flat_map(|c| &c.samples);
        samples
            .map(|s| f64::from(s.raw[axis].counts()[channel]))
            .collect()
    };
    let moving_counts = std::array::from_fn(|channel| {
        // An input may stand still while the axis moves.
        if channel == CHANNELS - 1 {
            return 0;
        }
        spread(&whole(channel)).round() as u32
    });
    let never = Cusum {
        drift: MAX_CUSUM,
        threshold: MAX_CUSUM,
    };
    let neither = TwoSided {
        more: never,
        less: never,
    };
    AxisLimits {
        reversed: if x.abs() >= v.abs() { x < 0.0 } else { v < 0.0 },
        force_shift: force_shift as u8,
        force_power: power(mean_square(&force) / (unit * unit)),
        state_power: states.map(|state| power(mean_square(&state))),
        per_octave: [0; 3],
        error: never,
        stiffness: neither,
        friction: neither,
        gross: [u8::MAX; 2],
        moving_counts,
    }
}

/// The sums of every block that the monitor finishes over one record.
struct Seen {
    validation: bool,
    fine: Vec<[Sums; 2]>,
    /// With whether a state was outside the training range.
    gross: Vec<([GrossSums; 2], bool)>,
}

impl Seen {
    fn of(monitor: &Monitor, chained: &ChainedRecord) -> Self {
        let mut state = MonitorState::default();
        let mut seen = Self {
            validation: chained.validation,
            fine: Vec::new(),
            gross: Vec::new(),
        };
        let (mut number, mut of_gross) = (0, 0);
        for sample in &chained.samples {
            let output = sample.output.as_ref();
            monitor.update(&mut state, &sample.raw, output, &sample.faults);
            let (finished, sums) = state.last_block();
            if finished != number {
                number = finished;
                seen.fine.push(*sums);
            }
            let (finished, sums, outside) = state.last_gross_block();
            if finished != of_gross {
                of_gross = finished;
                seen.gross.push((*sums, outside));
            }
        }
        seen
    }
}

/// The statistics of one record's judged blocks on one axis.
struct Series {
    validation: bool,
    /// The level of motion, in octaves.
    levels: Vec<f64>,
    /// Error, stiffer, softer, more friction, less friction.
    values: Vec<[f64; 5]>,
    /// Mean over the blocks of Σe²/Σr².
    error_share: f64,
}

fn series(seen: &[Seen], axis: usize, limits: &AxisLimits, log_values: u32) -> Vec<Series> {
    let of_record = |seen: &Seen| {
        let judged = seen.fine.iter().map(|sums| &sums[axis]).filter_map(|sums| {
            let said = sums.statistics(limits, log_values);
            said.moves.then_some((sums, said))
        });
        let (mut error, mut force) = (0.0, 0.0);
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        for (sums, seen) in judged {
            levels.push(f64::from(seen.level) / f64::from(OCTAVE));
            error += sums.error as f64;
            force += sums.force as f64;
            let [e, s, f] = [seen.error, seen.stiffness, seen.friction].map(f64::from);
            values.push([e, s, -s, f, -f]);
        }
        Series {
            validation: seen.validation,
            levels,
            values,
            error_share: if force > 0.0 { error / force } else { 0.0 },
        }
    };
    seen.iter().map(of_record).collect()
}

/// The slopes of error, stiffness and friction over the level of motion by least squares, on the
/// validation records.
fn per_octave(series: &[Series]) -> [i32; 3] {
    let judged = || series.iter().filter(|s| s.validation);
    let levels: Vec<f64> = judged().flat_map(|s| s.levels.iter().copied()).collect();
    let middle = mean(&levels);
    let spread: f64 = levels.iter().map(|l| (l - middle).powi(2)).sum();
    // Error, stiffer and more friction among the five sides.
    [0, 1, 3].map(|side| {
        let values = judged().flat_map(|s| s.values.iter().map(|v| v[side]));
        let product: f64 = levels
            .iter()
            .zip(values)
            .map(|(l, v)| (l - middle) * v)
            .sum();
        (product / spread.max(1e-9)).round() as i32
    })
}

fn sides(series: &[Series], log_rarity: f64) -> [Healthy; 5] {
    let judged = series.iter().filter(|s| s.validation);
    let (error, count) = judged.fold((0.0, 0.0), |(sum, count), s| {
        let n = s.values.len() as f64;
        (sum + n * s.error_share, count + n)
    });
    let share = error / f64::max(count, 1.0);
    let growth = ((share + CHANGE * CHANGE) / share.max(1e-12)).log2();
    std::array::from_fn(|side| {
        let shift = if side == 0 {
            f64::from(OCTAVE) * growth.max(2.0 * MIN_GROWTH_OCTAVES)
        } else {
            share_of_change(CHANGE)
        };
        let records: Vec<(bool, Vec<f64>)> = series
            .iter()
            .map(|s| (s.validation, s.values.iter().map(|v| v[side]).collect()))
            .collect();
        healthy(&records, side, shift, log_rarity)
    })
}

/// Σab/√(Σa²·Σb²); 0 when either is 0 throughout.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let size = (mean_square(a) * mean_square(b)).sqrt() * a.len() as f64;
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::rate::band_every_log2;
    use crate::signal::filters::Filters;

    #[test]
    fn the_usual_rig_is_judged_at_every_fourth_sample() {
        // The self-test counts instructions on one of 129 taps, more than this has:
        // `jointwatch_shared::selftest::chain`.
        let filters = Filters::for_bands(1000.0, 70.0, 250.0).unwrap();
        assert_eq!((filters.band.len(), band_every_log2(&filters)), (111, 2));
        // A block of the monitor would sum up too few where the band allows more.
        let narrow = Filters::for_bands(1000.0, 10.0, 250.0).unwrap();
        assert_eq!(band_every_log2(&narrow), 2);
        let wide = Filters::for_bands(1000.0, 300.0, 450.0).unwrap();
        assert_eq!(band_every_log2(&wide), 0);
    }
}
