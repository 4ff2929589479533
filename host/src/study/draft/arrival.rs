//! Times at which rows arrived at a logger, as of a serial line that is read in bursts: the rows
//! were taken evenly, and the times say only how many there were.

use crate::study::survey::{Survey, SurveyedTime};
use crate::study::time::Grid;
use crate::study::time::pieces::{MIN_ROWS, density};
use crate::text::error::{Error, Result};
use crate::text::table::short;

/// Rows were taken evenly where the channel that goes on most smoothly does so this many times more
/// smoothly from row to row than from time to time.
const SMOOTHER: f64 = 2.0;

/// Most of the time.
const MOST: f64 = 0.5;

/// The rate of the rows, Hz, where the times of every log are only those at which rows arrived.
pub(super) fn rate(surveys: &[Survey], time: &SurveyedTime) -> Option<f64> {
    let mut rates = Vec::new();
    for survey in surveys {
        let seconds = time.seconds(survey)?;
        arrived(survey, &seconds).then_some(())?;
        rates.push(Grid::of(&seconds)?.rate_hz);
    }
    Some(rates.iter().sum::<f64>() / rates.len() as f64)
}

/// Refuses a log whose rows come in bursts too short for a record, with most of the time between
/// them.
pub(super) fn check(survey: &Survey, time: &SurveyedTime) -> Result<()> {
    let seconds = time.seconds(survey).unwrap_or_default();
    let Some(density) = density(&seconds) else {
        return Ok(());
    };
    let steps = seconds.windows(2).map(|w| w[1] - w[0]);
    let between: Vec<f64> = steps.filter(|step| *step > density.gap_s).collect();
    let lasts_s = seconds.last().unwrap_or(&0.0) - seconds[0];
    let bursts = between.len() + 1;
    if between.iter().sum::<f64>() < MOST * lasts_s || seconds.len() >= bursts * MIN_ROWS {
        return Ok(());
    }
    Err(Error::data(format!(
        "{}: the rows come in bursts, {} a second by {:?}, and of the time between them nothing is known; log every sample with the time at \
         which it was taken or, if the rows were taken evenly, state their rate with --rate HZ instead of the time",
        survey.file,
        short(bursts as f64 / lasts_s),
        time.column
    )))
}

/// Whether a log goes on more smoothly from row to row than from time to time.
fn arrived(survey: &Survey, seconds: &[f64]) -> bool {
    // A counter goes on evenly from row to row whenever it was read.
    let channels = survey.columns.iter().filter(|c| c.missing == 0);
    let channels = channels.filter(|c| c.rms > 0.0 && c.falls());
    let roughness = channels.map(|c| {
        let by_row = roughness(&c.values, |_| 0.5);
        let by_time = roughness(&c.values, |row| {
            let (before, at, after) = (seconds[row - 1], seconds[row], seconds[row + 1]);
            match after > before {
                true => (at - before) / (after - before),
                false => 0.5,
            }
        });
        [by_row / c.rms, by_time / c.rms]
    });
    let smoothest = roughness.min_by(|a, b| a[0].min(a[1]).total_cmp(&b[0].min(b[1])));
    smoothest.is_some_and(|[by_row, by_time]| SMOOTHER * by_row < by_time)
}

/// Mean distance of the values from the line between their neighbours; `share` is how far from the
/// one before to the one after a row stands.
fn roughness(values: &[f64], share: impl Fn(usize) -> f64) -> f64 {
    let inner = 1..values.len().saturating_sub(1);
    let off = inner.map(|row| {
        let [before, at, after] = [values[row - 1], values[row], values[row + 1]];
        (at - before - share(row) * (after - before)).abs()
    });
    off.sum::<f64>() / values.len() as f64
}
