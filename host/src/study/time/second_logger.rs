//! A run that two loggers recorded, each by its own clock: the second one's columns are put beside
//! the first one's, at times of the first one's clock.

use super::alignment::{Alignment, Unaligned};
use super::clock::{Aligned, Clock};
use super::pieces::density;
use super::resample::Resampler;
use super::{even_where_rounded, sampled};
use crate::study::channels::calibrated::{Calibrated, Columns, calibrate};
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::{alike, clear_lag, motion};
use crate::study::description::{ClockEntry, Description, Source};
use crate::study::log::{Log, MemoryLog, Request, Wanted};
use crate::study::readers::long::LongLog;
use crate::study::series::extent;
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use std::path::Path;

/// A second logger of a run, as `[[clock]]` describes it.
pub(crate) struct SecondLogger {
    file: String,
    record: String,
    names: Option<Vec<String>>,
    time: Calibrated,
    /// Its column of time, and the one that the other logger recorded as well.
    wanted: Vec<Wanted>,
    /// Nothing where both files have their times from one clock.
    common: Option<[String; 2]>,
    derivative: i8,
}

/// What of a plan a second logger may serve.
#[derive(Clone, Copy)]
pub(crate) struct Wants<'a> {
    pub(crate) wanted: &'a [Wanted],
    pub(crate) time: Option<&'a Calibrated>,
    /// Columns of time of single channels.
    pub(crate) clocks: &'a [Calibrated],
    pub(crate) loggers: &'a [SecondLogger],
}

/// The second loggers of a description, checked.
pub(crate) fn second_loggers(source: &Source<'_>, said: &Description) -> Result<Vec<SecondLogger>> {
    let mut all: Vec<SecondLogger> = Vec::new();
    for entry in &said.clock {
        check(source, said, entry)?;
        let (file, record) = (entry.file.get_ref(), entry.record.get_ref());
        if all.iter().any(|l| l.file == *file && l.record == *record) {
            return Err(source.wrong(
                &entry.file,
                format!("{file:?} is there twice for {record:?}; keep one"),
            ));
        }
        let mut columns = Columns::default();
        let start = entry.time.span().start;
        let table = std::slice::from_ref(&entry.time.get_ref().0);
        let mut time = calibrate(source, start, "time", table, Quantity::Time, &mut columns)?;
        let common = entry.common.as_ref().map(|common| common.get_ref().clone());
        if let Some([own, _]) = &common {
            columns.place(own, false);
        }
        all.push(SecondLogger {
            file: file.clone(),
            record: record.clone(),
            names: entry.columns.clone(),
            time: time.remove(0),
            wanted: columns.wanted,
            common,
            derivative: entry.derivative.as_ref().map_or(0, |d| *d.get_ref()),
        });
    }
    Ok(all)
}

fn check(source: &Source<'_>, said: &Description, entry: &ClockEntry) -> Result<()> {
    let (file, record) = (entry.file.get_ref(), entry.record.get_ref());
    if said
        .time
        .as_ref()
        .is_none_or(|time| time.get_ref().resample_hz.is_none())
    {
        return Err(source.wrong(
            &entry.file,
            "two clocks need one even rate to be brought to; write time = { column = …, resample_hz = … } at the top",
        ));
    }
    let known: Vec<&str> = said
        .record
        .iter()
        .map(|r| r.file.get_ref().as_str())
        .collect();
    if !known.contains(&record.as_str()) {
        return Err(source.wrong(
            &entry.record,
            format!(
                "no [[record]] has the file {record:?}; {}",
                suggestion(record, &known)
            ),
        ));
    }
    if file == record {
        return Err(source.wrong(
            &entry.file,
            "a log is no second logger of itself; name the other file",
        ));
    }
    let cut = said.record.iter().filter(|r| r.file.get_ref() == record);
    if let Some(rows) = cut.filter_map(|r| r.rows.as_ref()).next()
        && entry.common.is_some()
    {
        return Err(source.wrong(
            rows,
            "rows counts the rows of one clock, and this run has two; leave rows out, or cut the logs; where one clock gave both files their \
             times, leave common out instead",
        ));
    }
    if let (Some(derivative), None) = (&entry.derivative, &entry.common) {
        return Err(source.wrong(
            derivative,
            "derivative is of the columns in common, and none is named; name two, or leave derivative out",
        ));
    }
    match &entry.derivative {
        Some(order) if !(-2..=2).contains(order.get_ref()) => Err(source.wrong(
            order,
            "derivative is from −2 to 2: how often this file's column is differentiated to be the record's",
        )),
        _ => Ok(()),
    }
}

/// Reads a record with what its second loggers add to it.
pub(crate) fn read(
    request: &Request<'_>,
    long: Option<&LongLog>,
    plan: Wants<'_>,
    (folder, memory): (&Path, Option<&[MemoryLog]>),
) -> Result<Log> {
    let loggers = || plan.loggers.iter().filter(|l| l.record == request.file);
    if loggers().next().is_none() {
        return request.read_of(long);
    }
    let time = plan.time.map_or(0, |time| time.place);
    let mut wanted = plan.wanted.to_vec();
    for (place, column) in wanted.iter_mut().enumerate() {
        column.optional |= place != time;
    }
    for [_, common] in loggers().filter_map(|logger| logger.common.as_ref()) {
        want(&mut wanted, common, false);
    }
    let own = Request {
        wanted: Some(&wanted),
        ..*request
    };
    let mut log = own.read_of(long)?;
    for logger in loggers() {
        logger.join(&mut log, request, (plan, &wanted), (folder, memory))?;
    }
    for (place, column) in plan.wanted.iter().enumerate() {
        if log.values[place].is_none() && !column.optional {
            let files: Vec<&str> = loggers().map(|l| l.file.as_str()).collect();
            let known: Vec<&str> = log.unused.iter().map(String::as_str).collect();
            return Err(request.error(format!(
                "has no column {:?}, and neither has {}; {}",
                column.column,
                files.join(", "),
                suggestion(&column.column, &known)
            )));
        }
    }
    log.values.truncate(plan.wanted.len());
    log.units.truncate(plan.wanted.len());
    log.logger.truncate(plan.wanted.len());
    Ok(log)
}

/// The place of a column among the wanted, added where it is not there.
fn want(wanted: &mut Vec<Wanted>, column: &str, optional: bool) -> usize {
    let there = wanted.iter().position(|w| w.column == column);
    let place = there.unwrap_or_else(|| {
        wanted.push(Wanted {
            column: column.to_owned(),
            optional,
        });
        wanted.len() - 1
    });
    wanted[place].optional &= optional;
    place
}

impl SecondLogger {
    /// Whether it logged the run of this file as well.
    pub(crate) fn joins(&self, record: &str) -> bool {
        self.record == record
    }

    /// Puts what it recorded, and the record lacks, beside the record's columns.
    fn join(
        &self,
        log: &mut Log,
        record: &Request<'_>,
        (plan, of_record): (Wants<'_>, &[Wanted]),
        (folder, memory): (&Path, Option<&[MemoryLog]>),
    ) -> Result<()> {
        let mut wanted = self.wanted.clone();
        let lacking = (0..plan.wanted.len()).filter(|place| log.values[*place].is_none());
        let lacking: Vec<(usize, usize)> = lacking
            .map(|place| (place, want(&mut wanted, &plan.wanted[place].column, true)))
            .collect();
        let path = folder.join(&self.file);
        let request = Request {
            file: &self.file,
            path: &path,
            wanted: Some(&wanted),
            rows: None,
            columns: self.names.as_deref(),
            memory: memory.and_then(|logs| logs.iter().find(|log| log.name == self.file)),
            sparse: true,
        };
        let other = request.read()?;
        let alone = request.lone_values(&other, Some(&self.time.column), false)?;
        log.notes.extend(alone);
        log.notes.extend(other.notes.iter().cloned());
        let aligned = self.aligned(log, record, (plan, of_record), &other, &request)?;
        log.others.push(aligned);
        let mut used = false;
        for (place, at) in lacking {
            let Some(values) = &other.values[at] else {
                continue;
            };
            if plan.clocks.iter().any(|clock| clock.place == place) {
                return Err(request.error(format!(
                    "holds {:?}, the time of single channels, which a second logger cannot give: its rows have the time of its \
                     [[clock]]",
                    wanted[at].column
                )));
            }
            used = true;
            log.values[place] = Some(values.clone());
            log.units[place] = other.units[at].clone();
            log.logger[place] = log.others.len();
        }
        if used {
            return Ok(());
        }
        Err(request.error(format!(
            "gives no column that the study uses and {} lacks; leave its [[clock]] out",
            record.file
        )))
    }

    /// Its times by the record's clock.
    fn aligned(
        &self,
        log: &Log,
        record: &Request<'_>,
        (plan, of_record): (Wants<'_>, &[Wanted]),
        other: &Log,
        request: &Request<'_>,
    ) -> Result<Aligned> {
        let seconds_of = |time: &Calibrated, log: &Log| {
            let seconds = time.series(log, 0..log.rows(time.place));
            seconds.ok_or_else(|| request.error("needs a record with a column of time"))
        };
        let column = |log: &Log, wanted: &[Wanted], name: &str| {
            let place = wanted.iter().position(|w| w.column == name);
            place
                .and_then(|at| log.values[at].clone())
                .unwrap_or_default()
        };
        let time = plan
            .time
            .ok_or_else(|| request.error("needs a record with a column of time"))?;
        let theirs = seconds_of(time, log)?;
        let mine = seconds_of(&self.time, other)?;
        let Some(common) = &self.common else {
            return Ok(Aligned {
                sentence: format!(
                    "{} has its times from the clock of {}",
                    self.file, record.file
                ),
                clock: Clock::shared(&self.file, &other.sha256),
                seconds: mine,
            });
        };
        let first = column(log, of_record, &common[1]);
        let second = column(other, request.wanted.unwrap_or_default(), &common[0]);
        let rates = [(&theirs, record), (&mine, request)].map(|(seconds, of)| rate(seconds, of));
        let [one, two] = rates;
        let rate = one?.min(two?);
        let (first_start, first) = even(&theirs, &first, rate);
        let (second_start, second) = even(&mine, &second, rate);
        let (first, second, lost) = self.alike(first, second, rate);
        let found = Alignment::of(&first, &second)
            .map_err(|why| refused(&why, common, rate, record, request))?;
        // Both series have lost as many rows at their beginning.
        let row = |seconds: f64| (seconds - second_start) * rate - lost as f64;
        let by_record =
            |seconds: &f64| first_start + (found.at(row(*seconds)) + lost as f64) / rate;
        let at_s = second_start + (found.middle + lost as f64) / rate;
        let clock = Clock {
            file: self.file.clone(),
            sha256: other.sha256.clone(),
            at_s,
            offset_s: by_record(&at_s) - at_s,
            offset_within_s: found.within[0] / rate,
            drift_ppm: 1e6 * found.drift,
            drift_within_ppm: 1e6 * found.within[1],
            correlation: found.correlation,
        };
        Ok(Aligned {
            sentence: self.in_words(&clock, common, record),
            seconds: mine.iter().map(by_record).collect(),
            clock,
        })
    }

    /// Both columns as the same quantity, and how many rows that cost at either end.
    fn alike(&self, first: Vec<f64>, second: Vec<f64>, rate: f64) -> (Vec<f64>, Vec<f64>, usize) {
        let order = usize::from(self.derivative.unsigned_abs());
        if order == 0 {
            return (first, second, 0);
        }
        let derived = |series: &[f64]| {
            let lag = clear_lag(series);
            (lag, motion(series, lag, rate)[order].clone())
        };
        if self.derivative > 0 {
            let (lag, second) = derived(&second);
            return (alike(&first, lag), second, lag);
        }
        let (lag, first) = derived(&first);
        let second = alike(&second, lag);
        (first, second, lag)
    }

    fn in_words(&self, clock: &Clock, common: &[String; 2], record: &Request<'_>) -> String {
        format!(
            "the clock of {} was put right by its column {:?} and {:?} of {}: offset {:.7} s ± {:.1} µs at {:.3} s of its own, drift \
             {:.2} ± {:.2} ppm (95 %), correlation {:.3}",
            self.file,
            common[0],
            common[1],
            record.file,
            clock.offset_s,
            1e6 * clock.offset_within_s,
            clock.at_s,
            clock.drift_ppm,
            clock.drift_within_ppm,
            clock.correlation
        )
    }
}

/// Why two logs cannot be put in time.
fn refused(
    why: &Unaligned,
    common: &[String; 2],
    rate: f64,
    record: &Request<'_>,
    request: &Request<'_>,
) -> Error {
    let pair = format!("{:?} and {:?} of {}", common[0], common[1], record.file);
    request.error(match why {
        Unaligned::Short(rows) => format!(
            "cannot be put in time by {pair}: at {rate} Hz both need {rows} rows for that; use longer logs"
        ),
        Unaligned::Unlike(correlation) => format!(
            "cannot be put in time by {pair}: nothing in them is alike (correlation {correlation:.2}); name columns that logged the \
             same signal, or say with derivative how often one has to be differentiated to be the other"
        ),
        Unaligned::Once => format!(
            "cannot be put in time by {pair}: they are alike in one place only, which says nothing of the drift; log a knock at the \
             beginning, in the middle and at the end"
        ),
        Unaligned::Repeats(rows) => format!(
            "cannot be put in time by {pair}: what they hold repeats itself after {:.4} s, so that any of several offsets fits; log a \
             knock, a pulse or a start with both loggers",
            rows / rate
        ),
    })
}

/// Samples per second of a clock.
fn rate(seconds: &[f64], request: &Request<'_>) -> Result<f64> {
    let mut sorted: Vec<f64> = seconds.iter().copied().filter(|t| t.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let density = density(&sorted).map(|density| density.rate_hz);
    density.ok_or_else(|| {
        request.error("has no two rows at different times; check its column of time")
    })
}

/// A column brought to an even rate, and when its first row is due.
fn even(seconds: &[f64], values: &[f64], rate: f64) -> (f64, Vec<f64>) {
    let (values, seconds) = sampled(values, seconds);
    let seconds = even_where_rounded(&seconds);
    let [first, last] = extent(seconds.iter().copied());
    if last <= first {
        return (0.0, Vec::new());
    }
    let points = ((last - first) * rate + 1e-6).floor() as usize + 1;
    (
        first,
        Resampler::new(&seconds, first, rate, points).apply(&values),
    )
}
