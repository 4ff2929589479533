//! Limits tried on the very records they were set from: none of those may come near an alarm.

use super::calibration::Calibration;
use super::chained::ChainedRecord;
use super::drift;
use super::figures::{GROSS, quarters};
use crate::device::replay::SetUp;
use crate::study::Study;
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::limits::{AxisLimits, Limits, MAX_CUSUM};
use jointwatch_shared::monitor::{Monitor, MonitorState, OCTAVE, SIDES};

/// How near to the alarm a sum may come on a record of a healthy joint; *suspect* begins at 0.75.
const NEAREST: f64 = 0.7;
/// What a threshold may be raised by at most before the record is doubted, as a factor.
const MAX_RAISED: f64 = 4.0;
/// A sum stops at one and a half thresholds, so that one of them is raised by about as much at a
/// time.
const ROUNDS: usize = 5;
/// The sums in words, in the monitor's order.
const WORDS: [&str; SIDES] = [
    "the error",
    "a stiffer joint",
    "a softer joint",
    "more friction",
    "less friction",
    "a force that is gone",
    "a force that is not expected",
];

/// How near each sum of each axis came to its threshold, and on which record.
type Peaks = [[(f64, String); SIDES]; 2];

/// Raises every threshold that a record of the study comes near to.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with record, axis and sum when a threshold would have to be
/// raised too far.
pub(super) fn raise(
    calibration: &mut Calibration,
    study: &Study,
    set_up: &SetUp,
    model: &Model,
    chained_records: &[ChainedRecord],
    drift: f64,
) -> Result<()> {
    let mut factors = [[1.0_f64; SIDES]; 2];
    for _ in 0..ROUNDS {
        let peaks = peaks(calibration, study, set_up, model, chained_records, drift)?;
        let mut is_raised = false;
        for (axis, limits) in calibration.limits.axes.iter_mut().enumerate() {
            for (side, (peak, file)) in peaks[axis].iter().enumerate() {
                if *peak <= NEAREST {
                    continue;
                }
                let factor = peak / NEAREST;
                factors[axis][side] *= factor;
                if factors[axis][side] > MAX_RAISED {
                    return Err(too_far(study, axis, side, file));
                }
                is_raised = true;
                raise_one(limits, side, factor);
                if let Some(healthy) = calibration.healthy[axis].get_mut(side) {
                    healthy.threshold *= factor;
                    healthy.blocks_to_alarm *= factor;
                }
            }
        }
        if !is_raised {
            return Ok(());
        }
    }
    Err(Error::data(format!(
        "{}: no limits of the monitor were found at which its own records raise no alarm; look at the validation records for rows \
         that are not the joint's",
        study.path.display()
    )))
}

fn too_far(study: &Study, axis: usize, side: usize, file: &str) -> Error {
    Error::data(format!(
        "{}: {file} looks to the monitor like {} on {} beside the study's other records, so that its limits would find nothing; \
         look for a sensor fault or a changed joint in it, or leave it out",
        study.path.display(),
        WORDS[side],
        study.axes[axis].name,
    ))
}

fn raise_one(limits: &mut AxisLimits, side: usize, factor: f64) {
    if let Some(place) = GROSS.iter().position(|&gross| gross == side) {
        let threshold = f64::from(limits.gross_sums()[place].threshold);
        limits.gross[place] = quarters(threshold * factor + f64::from(OCTAVE / 8));
        return;
    }
    let cusum = match side {
        0 => &mut limits.error,
        1 => &mut limits.stiffness.more,
        2 => &mut limits.stiffness.less,
        3 => &mut limits.friction.more,
        _ => &mut limits.friction.less,
    };
    let raised = (f64::from(cusum.threshold) * factor).ceil();
    cusum.threshold = raised.min(f64::from(MAX_CUSUM)) as i32;
}

/// How near to its threshold every sum comes on any record.
fn peaks(
    calibration: &Calibration,
    study: &Study,
    set_up: &SetUp,
    model: &Model,
    chained_records: &[ChainedRecord],
    drift: f64,
) -> Result<Peaks> {
    let limits: &Limits = &calibration.limits;
    let monitor = Monitor::new(limits.clone(), &set_up.chain)
        .map_err(|e| Error::data(format!("{}: {e}", study.path.display())))?;
    let mut peaks = Peaks::default();
    let mut look = |chained: &ChainedRecord| {
        let mut state = MonitorState::default();
        for (row, sample) in chained.samples.iter().enumerate() {
            let output = sample.output.as_ref();
            monitor.update(&mut state, &sample.raw, output, &sample.faults);
            if row % usize::from(limits.block) != 0 {
                continue;
            }
            for (axis, peaks) in peaks.iter_mut().enumerate() {
                for (peak, level) in peaks.iter_mut().zip(state.levels(&monitor, axis)) {
                    let level = f64::from(level) / 1000.0;
                    if level > peak.0 {
                        *peak = (level, chained.file.clone());
                    }
                }
            }
        }
        Ok(())
    };
    chained_records.iter().try_for_each(&mut look)?;
    drift::each(study, set_up, model, drift, look)?;
    Ok(peaks)
}
