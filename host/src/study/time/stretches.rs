//! Channels brought to an even rate: each at its own times, split where any of them has a gap.

use super::pieces::{Density, MIN_ROWS, SHORTEST_PIECE, TOO_FINE, density, said_of_gaps};
use super::resample::Resampler;
use super::{even_where_rounded, round_rate, sampled};
use crate::study::channels::calibrated::Calibrated;
use crate::study::log::{Log, Request};
use crate::study::plan::Plan;
use crate::text::error::Result;
use crate::text::table::significant;
use std::sync::OnceLock;

/// The even parts of the time that all channels share.
pub(crate) struct Stretches {
    rate_hz: f64,
    /// One entry per clock: the times of a log's rows, s; those of second loggers last.
    clocks: Vec<Vec<f64>>,
    /// How many of them belong to the log itself.
    own: usize,
    parts: Vec<Stretch>,
}

struct Stretch {
    start_s: f64,
    points: usize,
    /// Grid points between the log's beginning and this.
    begins: usize,
    /// For the channels that have a value in every row of the log's own clock.
    whole: OnceLock<Resampler>,
}

/// The times at which something was sampled.
struct Stamps {
    sorted: Vec<f64>,
    density: Density,
    doubled: usize,
    disordered: usize,
}

impl Stretches {
    /// The pieces: where each begins, and how many rows it has.
    pub(crate) fn pieces(&self) -> Vec<(usize, usize)> {
        self.parts.iter().map(|s| (s.begins, s.points)).collect()
    }

    /// One channel in one of the parts.
    pub(crate) fn series(&self, part: usize, channel: &Calibrated, log: &Log) -> Option<Vec<f64>> {
        let stretch = &self.parts[part];
        let number = clock_of(channel, log, self.own);
        let clock = &self.clocks[number];
        let logged = channel.series(log, 0..clock.len())?;
        let (values, seconds) = sampled(&logged, clock);
        let resampler = || {
            let seconds = even_where_rounded(&seconds);
            Resampler::new(&seconds, stretch.start_s, self.rate_hz, stretch.points)
        };
        Some(match number == 0 && values.len() == clock.len() {
            true => stretch.whole.get_or_init(resampler).apply(&values),
            false => resampler().apply(&values),
        })
    }

    /// How the channels of a log are brought to `rate_hz`, and what was done, in words.
    pub(crate) fn of(
        request: &Request<'_>,
        log: &Log,
        plan: &Plan,
        seconds: Vec<f64>,
        rate_hz: f64,
    ) -> Result<(Self, Vec<String>)> {
        let mut clocks = vec![seconds];
        for clock in &plan.clocks {
            let seconds = clock.series(log, 0..log.rows(clock.place));
            clocks.push(seconds.expect("a column of time is not optional and was located before"));
        }
        let own = clocks.len();
        clocks.extend(log.others.iter().map(|other| other.seconds.clone()));
        let mut looked_at: Vec<Stamps> = Vec::new();
        let mut facts: Vec<(String, Vec<String>)> = Vec::new();
        for channel in plan.channels() {
            let clock = &clocks[clock_of(channel, log, own)];
            let Some(logged) = channel.series(log, 0..log.rows(channel.place)) else {
                continue;
            };
            if logged.len() != clock.len() {
                return Err(request.error(format!(
                    "has {} values in {:?} but {} in its column of time; name the column that belongs to it with \
                     {{ column = …, time = … }}",
                    logged.len(),
                    channel.column,
                    clock.len()
                )));
            }
            let (values, seconds) = sampled(&logged, clock);
            let stamps = Stamps::of(request, log, channel, &even_where_rounded(&seconds))?;
            let name = format!("{:?}", channel.column);
            let fact = stamps.in_words(logged.len() - values.len(), rate_hz);
            match facts.iter_mut().find(|(known, _)| *known == fact) {
                Some((_, names)) if names.contains(&name) => {}
                Some((_, names)) => names.push(name),
                None => facts.push((fact, vec![name])),
            }
            looked_at.push(stamps);
        }
        let mut done = vec![format!(
            "brought to {rate_hz} Hz by band-limited interpolation"
        )];
        let facts = facts.into_iter().filter(|(fact, _)| !fact.is_empty());
        done.extend(facts.map(|(fact, names)| format!("{} {fact}", names.join(", "))));
        done.extend(log.others.iter().map(|other| other.sentence.clone()));
        let parts = parts(request, &looked_at, rate_hz, &mut done)?;
        let stretches = Self {
            rate_hz,
            clocks,
            own,
            parts,
        };
        Ok((stretches, done))
    }
}

/// The number of the clock by which a channel was sampled, where `own` of them belong to the log
/// itself.
fn clock_of(channel: &Calibrated, log: &Log, own: usize) -> usize {
    match log.logger[channel.place] {
        0 => channel.clock,
        other => own + other - 1,
    }
}

/// A rate in four digits or so, as people write it.
fn rate_text(rate: f64) -> String {
    let text = format!("{:.3}", round_rate(rate, 1e-3));
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

impl Stamps {
    /// What the user should know of a channel's sampling; nothing where it is as it should be.
    fn in_words(&self, without: usize, rate_hz: f64) -> String {
        let own_hz = self.density.rate_hz;
        let mut facts = vec![format!("sampled at about {} Hz", rate_text(own_hz))];
        if own_hz < TOO_FINE * rate_hz {
            facts.push(format!(
                "which says nothing above {} Hz (resample_hz = {} fits better)",
                rate_text(0.5 * own_hz),
                rate_text(own_hz)
            ));
        }
        let counted = [
            (without, "rows without a value"),
            (self.doubled, "times twice"),
            (self.disordered, "rows out of order"),
        ];
        let counted = counted.iter().filter(|(count, _)| *count > 0);
        facts.extend(counted.map(|(count, what)| format!("{count} {what}")));
        match facts.len() {
            1 => String::new(),
            _ => facts.join(", "),
        }
    }

    fn of(request: &Request<'_>, log: &Log, channel: &Calibrated, seconds: &[f64]) -> Result<Self> {
        let mut sorted = seconds.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let steps = || sorted.windows(2).map(|w| w[1] - w[0]);
        let Some(density) = density(&sorted) else {
            return Err(request.error(format!(
                "has no two samples of {:?} at different times; check its column of time",
                channel.column
            )));
        };
        let mut latest = f64::NEG_INFINITY;
        let mut disordered = 0;
        for (row, at) in seconds.iter().enumerate() {
            if latest - at > density.gap_s {
                return Err(request.error_at(
                    &log.row_name(row),
                    &channel.column,
                    format!(
                        "its time {at} s is {:.3e} s before one above it, which is more than rows out of order explain; if the clock \
                         began anew here, take the parts as records of their own with rows = […]",
                        latest - at
                    ),
                ));
            }
            disordered += usize::from(*at < latest);
            latest = latest.max(*at);
        }
        Ok(Self {
            doubled: steps().filter(|s| *s == 0.0).count(),
            density,
            sorted,
            disordered,
        })
    }
}

/// The parts of the time in which every channel goes on.
fn parts(
    request: &Request<'_>,
    looked_at: &[Stamps],
    rate_hz: f64,
    done: &mut Vec<String>,
) -> Result<Vec<Stretch>> {
    let first = |s: &Stamps| s.sorted[0];
    let last = |s: &Stamps| s.sorted[s.sorted.len() - 1];
    let begin = looked_at
        .iter()
        .map(first)
        .fold(f64::NEG_INFINITY, f64::max);
    let end = looked_at.iter().map(last).fold(f64::INFINITY, f64::min);
    let mut gaps: Vec<[f64; 2]> = looked_at
        .iter()
        .flat_map(|stamps| {
            let long = stamps.density.gap_s;
            let pairs = stamps.sorted.windows(2).filter(move |w| w[1] - w[0] > long);
            pairs.map(|w| [w[0], w[1]])
        })
        .filter(|[from, to]| *to > begin && *from < end)
        .collect();
    gaps.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut spans = Vec::new();
    let mut from = begin;
    for [gap_from, gap_to] in &gaps {
        spans.push([from, *gap_from]);
        from = from.max(*gap_to);
    }
    spans.push([from, end]);
    spans.retain(|[from, to]| to > from);
    let found = spans.len();
    let mut parts: Vec<Stretch> = spans
        .iter()
        .map(|[from, to]| Stretch {
            start_s: *from,
            // A stamp's last digit must not cost the last point.
            points: ((to - from) * rate_hz + 1e-6).floor() as usize + 1,
            begins: ((from - begin) * rate_hz).round() as usize,
            whole: OnceLock::new(),
        })
        .collect();
    // Filters are shortened for a short log, but not for a scrap of one.
    let shortest = if found == 1 { MIN_ROWS } else { SHORTEST_PIECE };
    parts.retain(|part| part.points >= shortest);
    if parts.is_empty() {
        return Err(request.error(format!(
            "has no stretch of {shortest} points at {} Hz in which all its channels go on ({:.4} s in all, {} gaps); \
             use a longer log or another resample_hz",
            significant(rate_hz),
            (end - begin).max(0.0),
            gaps.len()
        )));
    }
    if found > 1 {
        let place = format!("{:.6} s", spans[1][0]);
        done.push(said_of_gaps(found - 1, &place, found - parts.len()));
    }
    Ok(parts)
}
