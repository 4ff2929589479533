//! Channels with times of their own: a row for every message of a recorder, or for every sample of
//! the fastest channel, in which the cells of the others are empty.

use crate::study::survey::{Survey, SurveyedColumn, SurveyedTime};
use crate::study::time::pieces::{MIN_ROWS, density};
use crate::study::time::resample::Resampler;

/// A channel has times of its own where it has no number in so many of the rows.
const EMPTY: f64 = 0.3;

/// The logs with all channels at the rate of the slowest one, and that rate, Hz; `None` where no
/// channel has times of its own.
pub(super) fn evened(surveys: &[Survey], time: &SurveyedTime) -> Option<(Vec<Survey>, f64)> {
    let rates = surveys.iter().filter_map(|survey| {
        let seconds = time.seconds(survey)?;
        let sparse = survey.columns.iter().filter(|c| has_own_times(c));
        let rates = sparse.filter_map(|c| density(&samples(c, &seconds).0));
        rates.map(|d| d.rate_hz).reduce(f64::min)
    });
    let rate_hz = rates.reduce(f64::min)?;
    let all = surveys.iter().map(|s| evenly(s, time, rate_hz));
    Some((all.collect::<Option<Vec<Survey>>>()?, rate_hz))
}

fn has_own_times(column: &SurveyedColumn) -> bool {
    let rows = column.values.len();
    column.missing as f64 > EMPTY * rows as f64 && rows - column.missing >= MIN_ROWS
}

/// The times at which a column has numbers, s, and these.
fn samples(column: &SurveyedColumn, seconds: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let pairs = seconds.iter().copied().zip(column.values.iter().copied());
    pairs.filter(|(_, value)| value.is_finite()).unzip()
}

/// A log at an even rate, as the study will bring it there, for as long as all columns last; one
/// that lacks numbers otherwise has none.
fn evenly(survey: &Survey, time: &SurveyedTime, rate_hz: f64) -> Option<Survey> {
    let seconds = time.seconds(survey)?;
    let columns: Vec<Option<(Vec<f64>, Vec<f64>)>> = survey
        .columns
        .iter()
        .map(|c| (c.missing == 0 || has_own_times(c)).then(|| samples(c, &seconds)))
        .collect();
    let ends = |of: fn(&[f64]) -> Option<&f64>| {
        let all = columns.iter().flatten();
        all.filter_map(move |(times, _)| of(times).copied())
    };
    let begin = ends(<[f64]>::first).fold(f64::NEG_INFINITY, f64::max);
    let end = ends(<[f64]>::last).fold(f64::INFINITY, f64::min);
    let rows = ((end - begin).max(0.0) * rate_hz) as usize + 1;
    let values = columns.into_iter().map(|column| match column {
        None => vec![f64::NAN; rows],
        Some((times, values)) => Resampler::new(&times, begin, rate_hz, rows).apply(&values),
    });
    Some(survey.with_values(values.collect()))
}
