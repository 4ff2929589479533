//! A study with a log too long to be held in memory: its channels thinned, and told to the pages
//! while they are read.

use super::locked;
use crate::study::long::overview::Overview;
use crate::study::long::study::{Channels, LongStudy};
use crate::text::error::{Error, Result};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Parts of a drawn channel.
const POINTS: usize = 700;
/// The pages are told of what was read after this time.
const NEWS: Duration = Duration::from_millis(300);

/// The study, and what was read of its logs.
pub(super) struct Long {
    study: LongStudy,
    overviews: Vec<Mutex<Overview>>,
    /// Nobody looks at it any more.
    left: AtomicBool,
    failed: Mutex<Option<String>>,
}

impl Long {
    /// A study of which nothing was read yet.
    pub(super) fn new(study: LongStudy) -> Self {
        let overview = |log: &Channels| Mutex::new(log.overview());
        Self {
            overviews: study.logs.iter().map(overview).collect(),
            study,
            left: AtomicBool::new(false),
            failed: Mutex::new(None),
        }
    }

    /// Ends the reading before the next block.
    pub(super) fn leave(&self) {
        self.left.store(true, Ordering::Relaxed);
    }

    /// Reads all logs, block by block on all cores; `tell` is called now and then, and at the end.
    pub(super) fn read(&self, tell: &(dyn Fn() + Sync)) {
        let told = Mutex::new(Instant::now());
        for (log, overview) in self.study.logs.iter().zip(&self.overviews) {
            let empty = log.overview();
            let block = |rows: std::ops::Range<usize>| {
                if self.left.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let condensed = log.condensed(rows.clone(), &empty)?;
                locked(overview).absorb(rows.start, rows.len(), &condensed);
                let mut told = locked(&told);
                if told.elapsed() > NEWS {
                    *told = Instant::now();
                    tell();
                }
                Ok(())
            };
            let read: Result<()> = log.blocks().into_par_iter().map(block).collect();
            if let Err(e) = read {
                *locked(&self.failed) = Some(e.sentence);
                break;
            }
        }
        tell();
    }

    /// What the pages are told of it.
    pub(super) fn told(&self) -> Value {
        let logs = self.study.logs.iter().zip(&self.overviews);
        let log = |(log, overview): (&Channels, &Mutex<Overview>)| {
            json!({
                "file": log.file, "format": log.format(), "rows": log.rows(), "read": locked(overview).read(),
                "timed": log.has_time() || self.study.sample_rate_hz.is_some(),
                "channels": log.columns.iter().map(|c| json!({ "name": c.name, "unit": c.unit })).collect::<Vec<_>>(),
            })
        };
        let records = self.study.records.iter().map(|r| {
            let role = r.role.words();
            json!({ "file": r.file, "role": role, "rows": [r.rows.start, r.rows.end] })
        });
        json!({
            "name": self.study.name,
            "logs": logs.map(log).collect::<Vec<_>>(),
            "records": records.collect::<Vec<_>>(),
            "sentence": *locked(&self.failed),
        })
    }

    /// Some rows of a log, thinned to what a screen shows: read where they are few, from the
    /// overview otherwise.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] where there is no such log, and what reading it says.
    pub(super) fn thinned(&self, log: usize, from: usize, to: usize) -> Result<Value> {
        let found = self.study.logs.get(log).zip(self.overviews.get(log));
        let (log, overview) = found.ok_or_else(|| Error::usage("there is no such log"))?;
        let to = to.min(log.rows());
        let from = from.min(to.saturating_sub(1));
        // A part of the drawing is then two bins at least, so that none is drawn at the wrong
        // place.
        let coarse = (to - from) / POINTS >= 2 * locked(overview).bin();
        let mut parts = match coarse {
            true => locked(overview).thinned(from..to, POINTS),
            false => Overview::of_rows(&log.read(from..to)?, POINTS),
        };
        for (channel, parts) in parts.iter_mut().enumerate() {
            parts.iter_mut().for_each(|e| *e = log.in_si(channel, *e));
        }
        let count = parts.first().map_or(0, Vec::len);
        let row = |part: usize| from + part * (to - from) / count.max(1);
        let times: Vec<Option<f64>> = match (log.has_time(), self.study.sample_rate_hz) {
            (true, _) => {
                let known = |e: &[f64; 2], side: usize| (e[0] <= e[1]).then_some(e[side]);
                let seen = parts.last().map_or(&[][..], Vec::as_slice);
                let mut times: Vec<_> = seen.iter().map(|e| known(e, 0)).collect();
                times.push(seen.last().and_then(|e| known(e, 1)));
                // Where a drawing begins and ends is known before what lies between was read.
                for (at, row) in [(0, from), (count, to - 1)] {
                    if times[at].is_none() {
                        let read = log.read(row..row + 1)?;
                        let time = read.last().and_then(|t| t.first().copied());
                        times[at] = time.map(|t| log.in_si(log.columns.len(), [t, t])[0]);
                    }
                }
                times
            }
            (false, rate) => {
                let rate = rate.unwrap_or(1.0);
                let rows = (0..=count).map(|part| Some(row(part) as f64 / rate));
                rows.collect()
            }
        };
        let side = |channel: &[[f64; 2]], side: usize| -> Vec<Option<f64>> {
            let value = |e: &[f64; 2]| (e[0] <= e[1]).then_some(e[side]);
            channel.iter().map(value).collect()
        };
        let channels = log.columns.iter().zip(&parts);
        let channels = channels.map(|(c, parts)| {
            json!({ "name": c.name, "unit": c.unit, "low": side(parts, 0), "high": side(parts, 1) })
        });
        Ok(json!({
            "rows": (0..=count).map(row).collect::<Vec<_>>(),
            "times": times,
            "channels": channels.collect::<Vec<_>>(),
        }))
    }
}
