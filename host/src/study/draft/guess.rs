//! The guesses that concern the study as a whole: time, roles, and that the logs go together.

use super::free::free_axis;
use super::parts::{Draft, DraftAxis, Log, UserChoices, names};
use super::records::{parts_of, records};
use super::runs::{one_below_another, side_by_side};
use super::{arrival, axis, sparse};
use crate::study::channels::units::unit_of_time;
use crate::study::quasi_static::ROWS_PER_SECOND;
use crate::study::survey::{self, Survey, SurveyedColumn, SurveyedTime};
use crate::study::time::pieces::{MIN_ROWS, TOO_FINE, density};
use crate::study::time::sampling::are_even;
use crate::study::time::{RATE_TOLERANCE, round_rate};
use crate::text::error::{Error, Result};
use crate::text::table::sample_rate;
use std::borrow::Cow;

/// A round rate that is as near as this, relative, does for uneven times.
const NEAR_RATE: f64 = 0.02;

/// Guesses a study from the logs that were looked at. Those too short for a record are left out,
/// and named.
///
/// # Errors
/// [`crate::text::error::Kind::Data`]: the logs do not go together, or no force or no displacement
/// can be told; the sentence says how to name it.
pub fn draft(surveys: &[Survey], said: &UserChoices) -> Result<Draft> {
    let mut findings = Vec::new();
    let surveys = &*runs_of(surveys, &mut findings);
    let Some(first) = surveys.first() else {
        return Err(Error::usage("no log was given; name at least one"));
    };
    let timeless = said.is_timeless(first);
    let time = if timeless {
        None
    } else {
        time_of(surveys, said)?
    };
    let sample_rate_hz = match (said.sample_rate_hz, &time) {
        _ if timeless => ROWS_PER_SECOND,
        (Some(rate), _) => rate,
        (None, Some(time)) => time.rate_hz,
        (None, None) => stated_rate(surveys, &mut findings).ok_or_else(|| no_time(first))?,
    };
    findings.extend(
        time.as_ref()
            .into_iter()
            .flat_map(|time| of_time(first, time, said)),
    );
    let time = time.filter(|_| said.sample_rate_hz.is_none());
    let is_driven = !said.is_free(first);
    let of_channels = time.as_ref().filter(|_| is_driven);
    let of_channels = of_channels.and_then(|time| sparse::evened(surveys, time));
    let slowest_hz = of_channels.as_ref().map(|(_, rate)| *rate);
    let (time, resample_hz, row_rate) = match time {
        None => (None, None, None),
        Some(time) => evenly(surveys, time, slowest_hz, &mut findings)?,
    };
    let sample_rate_hz = row_rate.or(slowest_hz).unwrap_or(sample_rate_hz);
    let rate_of = |survey| match slowest_hz {
        Some(rate_hz) => Some(rate_hz),
        None => Some(time_like(survey, time.as_ref()?)?.rate_hz),
    };
    let looked_at = of_channels.as_ref().map_or(surveys, |(evened, _)| evened);
    let logs: Vec<Log<'_>> = looked_at
        .iter()
        .map(|survey| Log {
            survey,
            rate_hz: rate_of(survey).unwrap_or(sample_rate_hz),
        })
        .collect();
    let column = time.as_ref().map(|t| t.column.as_str());
    let (axes, stretches) = if is_driven {
        let whole = surveys.iter().map(|s| vec![[0, s.rows]]);
        (
            axis::axes(&logs, column, said, &mut findings)?,
            whole.collect(),
        )
    } else {
        let (axis, decays) = free_axis(&logs, column, said, &mut findings)?;
        (vec![axis], decays)
    };
    Ok(Draft {
        name: "joint rig".into(),
        resample_hz,
        sample_rate_hz: (!timeless).then_some(sample_rate_hz),
        guesses_rate: row_rate.is_some(),
        records: records(&parts_of(surveys, &stretches), &axes, &mut findings),
        unused: unused(looked_at, time.as_ref(), &axes),
        axes,
        time,
        findings,
    })
}

/// The sample rate that all logs state beside their columns, Hz.
fn stated_rate(surveys: &[Survey], findings: &mut Vec<String>) -> Option<f64> {
    let (name, rate_hz) = surveys.first()?.rate.as_ref()?;
    let is_same = |survey: &Survey| survey.rate.as_ref().is_some_and(|(_, hz)| hz == rate_hz);
    surveys.iter().all(is_same).then(|| {
        findings.push(format!(
            "no column counts the time, and the log states {name} = {rate_hz}, so that is the sample rate in Hz"
        ));
        *rate_hz
    })
}

/// What was guessed of the time.
fn of_time(first: &Survey, time: &SurveyedTime, said: &UserChoices) -> Vec<String> {
    let named = first.column(&time.column).map(|c| c.named.time);
    let is_guess = named == Some(0) && said.column("time").is_none();
    let rises = is_guess.then(|| {
        format!(
            "column {:?} rises evenly, so it is taken for the time",
            time.column
        )
    });
    let counts = time.guessed.then(|| {
        format!(
            "column {:?} states no unit; by its steps it counts {}, which makes {}",
            time.column,
            unit_of_time(time.seconds_per_unit).unwrap_or("s"),
            sample_rate(time.rate_hz)
        )
    });
    rises.into_iter().chain(counts).collect()
}

/// The runs in the logs that have rows enough for a record, or all where none has.
fn runs_of<'a>(surveys: &'a [Survey], findings: &mut Vec<String>) -> Cow<'a, [Survey]> {
    let mut runs: Vec<Cow<'_, Survey>> = Vec::new();
    for survey in surveys {
        let (own, place) = match side_by_side(survey) {
            Some(own) => (own, "side by side"),
            None => (one_below_another(survey), "one below the other"),
        };
        if own.is_empty() {
            runs.push(Cow::Borrowed(survey));
            continue;
        }
        findings.push(format!(
            "{} holds {} runs {place}, each of which is a record of its own",
            survey.file,
            own.len()
        ));
        runs.extend(own.into_iter().map(Cow::Owned));
    }
    if runs.iter().any(|run| run.rows >= MIN_ROWS) {
        runs.retain(|run| {
            let enough = run.rows >= MIN_ROWS;
            findings.extend((!enough).then(|| {
                format!(
                    "{} has {} rows, and a record needs at least {MIN_ROWS}, so it is left out",
                    run.file, run.rows
                )
            }));
            enough
        });
    }
    let is_whole = |run: &Cow<'_, Survey>| matches!(run, Cow::Borrowed(_));
    match runs.len() == surveys.len() && runs.iter().all(is_whole) {
        true => Cow::Borrowed(surveys),
        false => Cow::Owned(runs.into_iter().map(Cow::into_owned).collect()),
    }
}

/// Why no column of a log is taken for its time.
fn no_time(first: &Survey) -> Error {
    let named = first.columns.iter().filter(|c| c.named.time > 1);
    let broken = match named.max_by_key(|c| c.named.time) {
        Some(c) if c.missing > 0 => {
            format!(" ({:?} holds no number in {} rows)", c.name, c.missing)
        }
        Some(c) if c.values.windows(2).all(|w| w[1] <= w[0]) => format!(
            " ({:?} falls from row to row: the last row stands first, so turn the rows round)",
            c.name
        ),
        Some(c) => format!(" ({:?} does not rise from row to row)", c.name),
        None => String::new(),
    };
    let rising: Vec<String> = first
        .columns
        .iter()
        .filter(|c| c.missing == 0 && c.rises())
        .map(|c| format!("{:?}", c.name))
        .collect();
    let candidates = match rising.as_slice() {
        [] => String::new(),
        names => format!(" (rising in every row: {})", names.join(", ")),
    };
    Error::data(format!(
        "{}: no column counts the time{broken}; name it with --column time=COLUMN{candidates}, state the rate with --rate HZ, or say --column \
         time=none for a quasi-static log without time",
        first.file
    ))
}

/// The columns that change, in a log or from one to another, and that nothing was found for; those
/// that are inputs likeliest first.
fn unused(
    surveys: &[Survey],
    time: Option<&SurveyedTime>,
    axes: &[DraftAxis],
) -> Vec<(String, Option<String>)> {
    let Some(first) = surveys.first() else {
        return Vec::new();
    };
    let all = first.columns.iter().filter(|column| {
        let is_time = time.is_some_and(|time| time.column == column.name) || column.named.time > 0;
        let is_used = axes.iter().any(|a| a.columns().any(|c| c == column.name));
        let everywhere = || surveys.iter().filter_map(|s| s.column(&column.name));
        let whole = everywhere().count() == surveys.len() && everywhere().all(|c| c.missing == 0);
        let changes = everywhere().any(|c| c.range != [column.range[0]; 2]);
        !is_time && !is_used && whole && changes
    });
    // What measures no motion and no force, or is switched, drives or heats the joint sooner than a
    // further sensor does.
    let mut all: Vec<&SurveyedColumn> = all.collect();
    all.sort_by_key(|c| c.is_measured() && !c.named.quantities.is_empty());
    let each = all.into_iter();
    each.map(|c| (c.name.clone(), c.unit.clone())).collect()
}

/// The even rate that the logs have to be brought to, Hz, where one of them has times that are not
/// even, or faster ones: that of their steps, or of the rows where these are far fewer, since what
/// lies between them is no measurement.
fn resample_rate(surveys: &[Survey], time: &SurveyedTime) -> Option<f64> {
    let mut times = surveys.iter().filter_map(|s| time_like(s, time));
    let faster = times.any(|own| own.rate_hz > (1.0 + RATE_TOLERANCE) * time.rate_hz);
    let seconds = surveys.iter().filter_map(|s| time.seconds(s));
    let uneven: Vec<Vec<f64>> = seconds.filter(|times| !are_even(times)).collect();
    let rows = uneven.iter().filter_map(|times| density(times));
    let rows = rows.map(|density| density.rate_hz);
    let fewest = rows.fold(f64::INFINITY, f64::min);
    let rate_hz = match fewest < TOO_FINE * time.rate_hz {
        true => fewest,
        false => time.rate_hz,
    };
    (faster || !uneven.is_empty()).then(|| round_rate(rate_hz, NEAR_RATE))
}

/// How the channels come to an even rate, Hz: the time, to which rate they are interpolated, or at
/// which rate rows were taken whose times are only those at which they arrived. `slowest_hz` is the
/// rate of the slowest of channels with times of their own.
///
/// # Errors
/// Rows that come in bursts too short for a record.
fn evenly(
    surveys: &[Survey],
    time: SurveyedTime,
    slowest_hz: Option<f64>,
    findings: &mut Vec<String>,
) -> Result<(Option<SurveyedTime>, Option<f64>, Option<f64>)> {
    if let Some(slowest_hz) = slowest_hz {
        let rate = round_rate(slowest_hz, NEAR_RATE);
        findings.push(format!(
            "channels have times of their own, with empty cells in the rows of others, so all of them are interpolated to {rate} Hz, the \
             rate of the slowest"
        ));
        return Ok((Some(time), Some(rate), None));
    }
    let Some(resample_hz) = resample_rate(surveys, &time) else {
        return Ok((Some(time), None, None));
    };
    if let Some(rate) = arrival::rate(surveys, &time) {
        let rate = round_rate(rate, NEAR_RATE);
        findings.push(format!(
            "the times in {:?} come in bursts, and the channels go on evenly from row to row: they are the times at which rows arrived, \
             so the rows are taken as even, at {rate} Hz",
            time.column
        ));
        return Ok((None, None, Some(rate)));
    }
    surveys
        .iter()
        .try_for_each(|survey| arrival::check(survey, &time))?;
    findings.push(format!(
        "the times in {:?} are not even, or not the same in all logs, so all channels are interpolated to {resample_hz} Hz",
        time.column
    ));
    Ok((Some(time), Some(resample_hz), None))
}

fn time_of(surveys: &[Survey], said: &UserChoices) -> Result<Option<SurveyedTime>> {
    let first = &surveys[0];
    let mut time = first.time.clone();
    if let Some(column) = said.column("time") {
        let Some(found) = first.column(column) else {
            return Err(Error::usage(format!(
                "{} has no column {column:?}; --column time= needs one of {}",
                first.file,
                names(first)
            )));
        };
        let mut only = first.clone();
        only.columns = vec![found.clone()];
        only.columns[0].named.time = 2;
        time = survey::time_of(&only.columns);
        if time.is_none() {
            return Err(Error::data(format!(
                "{}, column {column:?}: this does not rise from row to row, so it cannot count the time; name another column, or \
                 state the rate with --rate HZ",
                first.file
            )));
        }
    }
    let Some(chosen) = &time else { return Ok(None) };
    let others = surveys[1..]
        .iter()
        .filter_map(|survey| Some((&survey.file, time_like(survey, chosen)?)));
    let differs =
        |other: &SurveyedTime| (other.rate_hz / chosen.rate_hz - 1.0).abs() > RATE_TOLERANCE;
    let differing: Vec<_> = others.filter(|(_, other)| differs(other)).collect();
    if let (Some((file, other)), Some(_)) = (differing.first(), said.sample_rate_hz) {
        return Err(Error::data(format!(
            "{file} runs at {} Hz and {} at {} Hz, so one rate is not that of both: leave --rate out",
            other.rate_hz, first.file, chosen.rate_hz
        )));
    }
    // The slowest log holds no more than its own rate does.
    let all = differing
        .into_iter()
        .map(|(_, other)| other)
        .chain([chosen]);
    let slowest = all.min_by(|a, b| a.rate_hz.total_cmp(&b.rate_hz));
    Ok(slowest.cloned())
}

/// The time of a log, where it counts in the same column.
fn time_like<'a>(survey: &'a Survey, chosen: &SurveyedTime) -> Option<&'a SurveyedTime> {
    survey.time.as_ref().filter(|t| t.column == chosen.column)
}
