//! Which rows of a log belong together, and at which rate they were taken.
//!
//! Rows whose stamps are even, or off by less than half a period, are taken as they are. A few
//! missing samples are bridged; where more are missing the log is split, so that nothing is ever
//! differentiated or filtered across a gap. Anything else is refused, unless the study asks for an
//! even rate ([`super::stretches`]).

use super::pieces::{SHORTEST_PIECE, density, said_of_gaps};
use super::stretches::Stretches;
use super::{BRIDGED_SHARE, Gap, Grid, LONGEST_GAP, RATE_TOLERANCE, bridge, quantum, round_rate};
use crate::study::channels::calibrated::Calibrated;
use crate::study::log::{Log, MemoryLog, Request};
use crate::study::plan::Plan;
use crate::study::series::median;
use crate::text::error::Result;
use std::ops::Range;
use std::path::Path;

/// Jitter of a time stamp, in samples, above which the user is told.
const JITTER_TOLD: f64 = 0.1;

/// How a log becomes records.
pub(crate) struct Sampling {
    pub(crate) rate_hz: f64,
    pub(crate) kind: Kind,
    /// What was done to the time, for the user and for the model file, one sentence each without
    /// the file's name.
    pub(crate) done: Vec<String>,
}

/// Whether rows are used as they are.
pub(crate) enum Kind {
    Rows(Vec<Piece>),
    Grid(Stretches),
}

/// Even rows of a log between two gaps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) rows: Range<usize>,
    /// The gaps in it that are bridged, counted from its first row.
    pub(crate) gaps: Vec<Gap>,
    /// Where its first row would stand had the log no gaps.
    pub(crate) begins: usize,
}

impl Sampling {
    /// The pieces: where each begins, and how many rows it has.
    pub(crate) fn pieces(&self) -> Vec<(usize, usize)> {
        match &self.kind {
            Kind::Rows(pieces) => {
                let bridged = |p: &Piece| p.gaps.iter().map(|g| g.missing).sum::<usize>();
                let size = |p: &Piece| (p.begins, p.rows.len() + bridged(p));
                pieces.iter().map(size).collect()
            }
            Kind::Grid(stretches) => stretches.pieces(),
        }
    }

    /// One channel in one of the pieces, in SI; `None` where an optional column is absent.
    pub(crate) fn series(&self, piece: usize, channel: &Calibrated, log: &Log) -> Option<Vec<f64>> {
        match &self.kind {
            Kind::Rows(pieces) => {
                let Piece { rows, gaps, .. } = &pieces[piece];
                let series = channel.series(log, rows.clone())?;
                Some(match gaps.as_slice() {
                    [] => series,
                    gaps => bridge(&series, gaps),
                })
            }
            Kind::Grid(stretches) => stretches.series(piece, channel, log),
        }
    }

    /// Looks at the time of a log; `None` where the study states the rate and names no column.
    pub(crate) fn of(request: &Request<'_>, log: &Log, plan: &Plan) -> Result<Option<Self>> {
        let Some(channel) = &plan.time else {
            return Ok(None);
        };
        let rows = log.rows(channel.place);
        let seconds = channel
            .series(log, 0..rows)
            .expect("the column of time is not optional and was located before");
        let column = &channel.column;
        let sampling = match plan.resample_hz {
            Some(rate_hz) => {
                let (stretches, done) = Stretches::of(request, log, plan, seconds, rate_hz)?;
                Self {
                    rate_hz,
                    kind: Kind::Grid(stretches),
                    done,
                }
            }
            None => {
                let times = Times {
                    request,
                    log,
                    column,
                    seconds: &seconds,
                };
                match times.by_steps() {
                    Ok(sampling) => sampling,
                    Err(error) => times.by_grids().ok_or(error)?,
                }
            }
        };
        Ok(Some(sampling))
    }

    /// A log without a column of time.
    pub(crate) fn stated(rate_hz: f64, rows: usize) -> Self {
        Self {
            rate_hz,
            kind: Kind::Rows(vec![Piece {
                rows: 0..rows,
                gaps: Vec::new(),
                begins: 0,
            }]),
            done: Vec::new(),
        }
    }
}

/// Whether the rows of a log with these times, s, are taken as they are, perhaps in pieces.
pub(crate) fn are_even(seconds: &[f64]) -> bool {
    let memory = MemoryLog {
        name: "time".into(),
        columns: vec![("time".into(), seconds.to_vec())],
    };
    let request = Request {
        file: &memory.name,
        path: Path::new(&memory.name),
        wanted: None,
        rows: None,
        columns: None,
        memory: Some(&memory),
        sparse: false,
    };
    let Ok(log) = request.read() else {
        return false;
    };
    let times = Times {
        request: &request,
        log: &log,
        column: &memory.name,
        seconds,
    };
    times.by_steps().is_ok() || times.by_grids().is_some()
}

/// A time column, looked at.
struct Times<'a> {
    request: &'a Request<'a>,
    log: &'a Log,
    column: &'a str,
    seconds: &'a [f64],
}

impl Times<'_> {
    /// What to write into study.toml to have the log resampled.
    fn cure(&self) -> String {
        let rate = typical_rate(self.seconds);
        format!(
            "time = {{ column = {:?}, resample_hz = {} }} interpolates the channels to an even rate",
            self.column, rate
        )
    }

    /// Samples per second: the steps counted in units of their median. Refuses time that stands
    /// still or runs backwards.
    fn rate(&self) -> Result<f64> {
        let time = self.seconds;
        for (i, pair) in time.windows(2).enumerate() {
            let step = pair[1] - pair[0];
            if step <= 0.0 {
                let what = if step == 0.0 {
                    "is there twice"
                } else {
                    "comes after a later one"
                };
                return Err(self.request.error_at(
                    &self.log.row_name(i + 1),
                    self.column,
                    format!(
                        "the time {} s {what}; {}, or leave time out and state sample_rate_hz if the rows are even",
                        pair[1],
                        self.cure()
                    ),
                ));
            }
        }
        let steps = || time.windows(2).map(|pair| pair[1] - pair[0]);
        let middle = median(steps().collect()).unwrap_or(1.0);
        // Counting whole steps over the whole record averages out stamps that were rounded.
        let whole: f64 = steps().map(|step| (step / middle).round()).sum();
        Ok(round_rate(whole / (time[time.len() - 1] - time[0]), 0.0))
    }

    /// Takes each step as a whole number of periods.
    fn by_steps(&self) -> Result<Sampling> {
        let rate_hz = self.rate()?;
        let mut gaps = Vec::new();
        let mut jitter: f64 = 0.0;
        for (i, pair) in self.seconds.windows(2).enumerate() {
            let steps = (pair[1] - pair[0]) * rate_hz;
            let whole = steps.round();
            jitter = jitter.max((steps - whole).abs());
            if whole < 1.0 {
                return Err(self.request.error_at(
                    &self.log.row_name(i + 1),
                    self.column,
                    format!(
                        "only {:.3e} s after the row before, where {:.3e} s are expected: a log must be sampled evenly, or resampled; {}",
                        pair[1] - pair[0],
                        1.0 / rate_hz,
                        self.cure()
                    ),
                ));
            }
            if whole > 1.0 {
                gaps.push(Gap {
                    after: i,
                    missing: whole as usize - 1,
                });
            }
        }
        let mut done = Vec::new();
        if jitter > JITTER_TOLD {
            done.push(format!(
                "the times in column {:?} jitter by up to {jitter:.2} of a sample; the rows are taken as even",
                self.column
            ));
        }
        done.extend(self.bridged(&gaps)?);
        let pieces = self.split(&gaps);
        self.finish(rate_hz, pieces, done)
    }

    /// What is said of the gaps that are bridged; refuses too many of them.
    fn bridged(&self, gaps: &[Gap]) -> Result<Option<String>> {
        let short = || gaps.iter().filter(|g| g.missing <= LONGEST_GAP);
        let Some(first) = short().next() else {
            return Ok(None);
        };
        let missing: usize = short().map(|g| g.missing).sum();
        let places = short().count();
        let found = format!(
            "{missing} sample{} dropped in {places} place{}, first after {}",
            if missing == 1 { " was" } else { "s were" },
            if places == 1 { "" } else { "s" },
            self.log.row_name(first.after)
        );
        let allowed = ((self.seconds.len() as f64 * BRIDGED_SHARE) as usize).max(LONGEST_GAP);
        if missing > allowed {
            return Err(self.request.error_at(
                &self.log.row_name(first.after),
                self.column,
                format!(
                    "{found}; at most {allowed} in all are bridged without a word from you; {}, and rows = […] takes the even \
                     parts alone",
                    self.cure()
                ),
            ));
        }
        Ok(Some(format!(
            "column {:?}: {found}; bridged by interpolation",
            self.column
        )))
    }

    /// The rows between the gaps that are too long to be bridged.
    fn split(&self, gaps: &[Gap]) -> Vec<Piece> {
        let mut pieces = vec![Piece {
            rows: 0..0,
            gaps: Vec::new(),
            begins: 0,
        }];
        let mut missing = 0;
        for gap in gaps {
            missing += gap.missing;
            let piece = pieces.last_mut().expect("there is one from the beginning");
            if gap.missing <= LONGEST_GAP {
                piece.gaps.push(Gap {
                    after: gap.after - piece.rows.start,
                    missing: gap.missing,
                });
                continue;
            }
            piece.rows.end = gap.after + 1;
            pieces.push(Piece {
                rows: gap.after + 1..0,
                gaps: Vec::new(),
                begins: gap.after + 1 + missing,
            });
        }
        let last = pieces.last_mut().expect("there is one from the beginning");
        last.rows.end = self.seconds.len();
        pieces
    }

    /// Takes the rows between gaps as even when their stamps are rounded, jittering, here and there
    /// doubled; `None` when they are worse.
    fn by_grids(&self) -> Option<Sampling> {
        let time = self.seconds;
        let step = median(
            time.windows(2)
                .map(|w| w[1] - w[0])
                .filter(|s| *s > 0.0)
                .collect(),
        )?;
        let long = (LONGEST_GAP as f64 + 1.5) * step;
        let ends = (1..time.len()).filter(|i| time[*i] - time[*i - 1] > long);
        let starts: Vec<usize> = std::iter::once(0).chain(ends).chain([time.len()]).collect();
        let rounded = quantum(time).unwrap_or(0.0);
        let mut grids = Vec::new();
        for pair in starts.windows(2) {
            let rows = pair[0]..pair[1];
            match Grid::of(&time[rows.clone()]) {
                Some(grid) if grid.is_even(rounded) => grids.push((rows, grid)),
                // What is left out anyway need not be even.
                _ if starts.len() > 2 && rows.len() < SHORTEST_PIECE => {}
                _ => return None,
            }
        }
        let rate_hz = grids.iter().max_by_key(|(rows, _)| rows.len())?.1.rate_hz;
        let differs = |rate: f64| (rate / rate_hz - 1.0).abs() > RATE_TOLERANCE;
        let long = |rows: &Range<usize>| rows.len() >= SHORTEST_PIECE;
        if grids
            .iter()
            .any(|(rows, grid)| long(rows) && differs(grid.rate_hz))
        {
            return None;
        }
        let jitter = grids
            .iter()
            .map(|(_, grid)| grid.jitter)
            .fold(0.0, f64::max);
        let doubled = time.windows(2).filter(|w| w[1] <= w[0]).count();
        let done = format!(
            "the times in column {:?} are up to {jitter:.2} of a sample off an even grid{}{}; the rows are taken as even, at {rate_hz} Hz",
            self.column,
            match doubled {
                0 => String::new(),
                1 => ", one of them no later than the one before".to_owned(),
                n => format!(", {n} of them no later than the one before"),
            },
            if rounded * rate_hz > 0.1 {
                format!(" (they are rounded to {rounded:.2e} s)")
            } else {
                String::new()
            },
        );
        let pieces = grids.into_iter().map(|(rows, grid)| Piece {
            rows,
            gaps: Vec::new(),
            begins: ((grid.start_s - time[0]) * rate_hz).round().max(0.0) as usize,
        });
        self.finish(rate_hz, pieces.collect(), vec![done]).ok()
    }

    /// Leaves out what is too short, and says so.
    fn finish(
        &self,
        rate_hz: f64,
        mut pieces: Vec<Piece>,
        mut done: Vec<String>,
    ) -> Result<Sampling> {
        if pieces.len() > 1 {
            let row = self.log.row_name(pieces[1].rows.start);
            let all = pieces.clone();
            pieces.retain(|piece| piece.rows.len() >= SHORTEST_PIECE);
            let left_out = all.len() - pieces.len();
            done.push(said_of_gaps(all.len() - 1, &row, left_out));
            if pieces.is_empty() {
                return Err(self.request.error_at(
                    &row,
                    self.column,
                    format!(
                        "samples are missing in {} places, and no part between them has the {SHORTEST_PIECE} rows that filters \
                         need; {}",
                        all.len() - 1,
                        self.cure()
                    ),
                ));
            }
        }
        Ok(Sampling {
            rate_hz,
            kind: Kind::Rows(pieces),
            done,
        })
    }
}

/// The rate to propose for uneven stamps, in two digits.
pub(crate) fn typical_rate(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.retain(|t| t.is_finite());
    sorted.sort_unstable_by(f64::total_cmp);
    let rate = density(&sorted).map_or(1.0, |d| d.rate_hz);
    let unit = 10_f64.powf(rate.log10().floor() - 1.0);
    ((rate / unit).round() * unit * 1e6).round() / 1e6
}
