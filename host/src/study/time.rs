//! The time column: is it even, does it agree with the stated rate, and which samples were dropped?

use super::log::{Log, Request};
use crate::text::error::Result;

/// Missing samples in a row that may be bridged.
pub const LONGEST_GAP: usize = 5;
/// Share of a record's rows that may be bridged in all; five rows may be in any record.
pub const BRIDGED_SHARE: f64 = 1e-3;
/// How far the time column may be from the stated sample rate, relative.
pub const RATE_TOLERANCE: f64 = 1e-3;
/// Jitter of a time stamp, in samples, above which the user is told.
const JITTER_TOLD: f64 = 0.1;

/// Samples that are missing after a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gap {
    /// The last row before the gap.
    pub(crate) after: usize,
    pub(crate) missing: usize,
}

/// Samples per second that the time column speaks of: the steps counted in units of their median.
///
/// Refuses time that stands still or runs backwards.
pub(crate) fn rate_of(request: &Request<'_>, log: &Log, column: &str, time: &[f64]) -> Result<f64> {
    let mut steps = Vec::with_capacity(time.len());
    for (i, pair) in time.windows(2).enumerate() {
        let step = pair[1] - pair[0];
        if step <= 0.0 {
            let what = if step == 0.0 {
                "is there twice"
            } else {
                "comes after a later one"
            };
            return Err(request.error_at(
                &log.row_name(i + 1),
                column,
                format!(
                    "the time {} s {what}; repair the log, or leave time out and state sample_rate_hz if the rows are even",
                    pair[1]
                ),
            ));
        }
        steps.push(step);
    }
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    let median = *median;
    // Counting whole steps over the whole record averages out stamps that were rounded.
    let whole: f64 = time
        .windows(2)
        .map(|pair| ((pair[1] - pair[0]) / median).round())
        .sum();
    Ok(round_rate(whole / (time[time.len() - 1] - time[0])))
}

/// Finds the gaps, refuses what cannot be bridged, and says in a note what is not perfect.
pub(crate) fn gaps(
    request: &Request<'_>,
    log: &Log,
    column: &str,
    time: &[f64],
    rate: f64,
) -> Result<(Vec<Gap>, Option<String>)> {
    let mut gaps = Vec::new();
    let mut jitter: f64 = 0.0;
    for (i, pair) in time.windows(2).enumerate() {
        let steps = (pair[1] - pair[0]) * rate;
        let whole = steps.round();
        jitter = jitter.max((steps - whole).abs());
        if whole < 1.0 {
            return Err(request.error_at(
                &log.row_name(i + 1),
                column,
                format!(
                    "only {:.3e} s after the row before, where {:.3e} s are expected; the log must be sampled evenly, \
                     resample it or leave the row out with rows = […]",
                    pair[1] - pair[0],
                    1.0 / rate
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
    let missing: usize = gaps.iter().map(|g| g.missing).sum();
    let Some(longest) = gaps.iter().max_by_key(|g| g.missing).copied() else {
        let note = (jitter > JITTER_TOLD).then(|| {
            format!(
                "{}: the times in column {column:?} jitter by up to {jitter:.2} of a sample; the rows are taken as even",
                request.file
            )
        });
        return Ok((gaps, note));
    };
    let found = format!(
        "{missing} sample{} dropped in {} place{}, first after {}",
        if missing == 1 { " was" } else { "s were" },
        gaps.len(),
        if gaps.len() == 1 { "" } else { "s" },
        log.row_name(gaps[0].after)
    );
    let allowed = ((time.len() as f64 * BRIDGED_SHARE) as usize).max(LONGEST_GAP);
    if longest.missing > LONGEST_GAP || missing > allowed {
        return Err(request.error_at(
            &log.row_name(longest.after),
            column,
            format!(
                "{found}, {} in a row after this one; at most {LONGEST_GAP} in a row and {allowed} in all are bridged, so \
                 take the even parts as records of their own with rows = […]",
                longest.missing
            ),
        ));
    }
    let note = format!(
        "{}, column {column:?}: {found}; bridged by interpolation",
        request.file
    );
    Ok((gaps, Some(note)))
}

/// Rows that are even although their stamps are not: rounded, jittering, here and there doubled.
pub(crate) struct Even {
    pub(crate) rate_hz: f64,
    /// What the user is told.
    pub(crate) note: String,
}

/// Takes rows as even when no stamp is further from an even grid than half a period, or than the rounding of the stamps explains.
pub(crate) fn even_grid(request: &Request<'_>, column: &str, time: &[f64]) -> Option<Even> {
    let grid = Grid::of(time)?;
    let rounded = quantum(time).unwrap_or(0.0);
    let allowed = (0.5 * rounded * grid.rate_hz + 0.05).max(0.5);
    let doubled = time.windows(2).filter(|w| w[1] <= w[0]).count();
    (grid.jitter <= allowed).then(|| Even {
        rate_hz: round_rate(grid.rate_hz),
        note: format!(
            "{}: the times in column {column:?} are up to {:.2} of a sample off an even grid{}{}; the rows are taken as even, at \
             {} Hz",
            request.file,
            grid.jitter,
            match doubled {
                0 => String::new(),
                1 => ", one of them no later than the one before".to_owned(),
                n => format!(", {n} of them no later than the one before"),
            },
            if rounded * grid.rate_hz > 0.1 {
                format!(" (they are rounded to {rounded:.2e} s)")
            } else {
                String::new()
            },
            round_rate(grid.rate_hz)
        ),
    })
}

/// The even grid nearest to all stamps.
struct Grid {
    rate_hz: f64,
    /// Largest distance of a stamp from it, in samples.
    jitter: f64,
}

impl Grid {
    /// By least squares of time over row.
    fn of(time: &[f64]) -> Option<Self> {
        let count = time.len() as f64;
        let middle = 0.5 * (count - 1.0);
        let mean = time.iter().sum::<f64>() / count;
        let rows = time.iter().enumerate();
        let (mut square, mut product) = (0.0, 0.0);
        for (row, at) in rows.clone() {
            let from_middle = row as f64 - middle;
            square += from_middle * from_middle;
            product += from_middle * (at - mean);
        }
        let period = product / square;
        if !(period.is_finite() && period > 0.0) {
            return None;
        }
        let off = rows.map(|(row, at)| (at - mean - (row as f64 - middle) * period).abs());
        Some(Self {
            rate_hz: 1.0 / period,
            jitter: off.fold(0.0, f64::max) / period,
        })
    }
}

/// What the stamps are rounded to, when the steps of the last thousand are whole multiples of one. (Stamps of so many significant
/// digits are coarsest at the end.)
fn quantum(time: &[f64]) -> Option<f64> {
    let last = &time[time.len().saturating_sub(1000)..];
    let steps = || last.windows(2).map(|w| (w[1] - w[0]).abs());
    let size = last.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    let floor = 1e-12 * size;
    let least = steps().filter(|s| *s > floor).fold(f64::INFINITY, f64::min);
    let whole = |step: f64| {
        let times = step / least;
        (times - times.round()).abs() < 1e-3
    };
    // A log whose steps are all alike is not rounded but even.
    let differ = steps().any(|s| s > 1.5 * least || s < 0.5 * least);
    (least.is_finite() && differ && steps().all(whole)).then_some(least)
}

/// A rate within 1e-7 of a whole thousandth is meant to be that.
fn round_rate(rate: f64) -> f64 {
    let round = (rate * 1e3).round() / 1e3;
    if (rate / round - 1.0).abs() < 1e-7 {
        round
    } else {
        rate
    }
}

/// The stamps of a log that is only looked at.
pub(crate) struct Stamps {
    pub(crate) rate_hz: f64,
    /// In samples.
    pub(crate) jitter: f64,
    /// Samples that are missing, and in how many places.
    pub(crate) missing: usize,
    pub(crate) places: usize,
}

impl Stamps {
    /// `None` where the stamps do not rise.
    pub(crate) fn of(seconds: &[f64]) -> Option<Self> {
        let grid = Grid::of(seconds)?;
        let even = Self {
            rate_hz: round_rate(grid.rate_hz),
            jitter: grid.jitter,
            missing: 0,
            places: 0,
        };
        let mut steps: Vec<f64> = seconds
            .windows(2)
            .map(|w| w[1] - w[0])
            .filter(|s| *s > 0.0)
            .collect();
        let allowed = 0.5 * quantum(seconds).unwrap_or(0.0) * grid.rate_hz + 0.05;
        if grid.jitter <= allowed.max(0.5) || steps.is_empty() {
            return Some(even);
        }
        let middle = steps.len() / 2;
        let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        let median = *median;
        let wholes = || steps.iter().map(|s| (s / median).round().max(1.0));
        let whole: f64 = wholes().sum();
        let rate = whole / (seconds[seconds.len() - 1] - seconds[0]);
        let off = |s: &f64| (s * rate - (s * rate).round().max(1.0)).abs();
        Some(Self {
            rate_hz: round_rate(rate),
            jitter: steps.iter().map(off).fold(0.0, f64::max),
            missing: (whole as usize).saturating_sub(steps.len()),
            places: wholes().filter(|w| *w > 1.0).count(),
        })
    }
}

/// Fills the gaps of a series: a cubic through the two rows on each side, a straight line where there are not two.
pub(crate) fn bridge(series: &[f64], gaps: &[Gap]) -> Vec<f64> {
    let missing: usize = gaps.iter().map(|g| g.missing).sum();
    let mut whole = Vec::with_capacity(series.len() + missing);
    let mut from = 0;
    for (g, gap) in gaps.iter().enumerate() {
        let (left, right) = (gap.after, gap.after + 1);
        whole.extend_from_slice(&series[from..=left]);
        from = right;
        let wide = (gap.missing + 1) as f64;
        let mut nodes = vec![(0.0, series[left]), (wide, series[right])];
        let free_before = g == 0 || gaps[g - 1].after < left.saturating_sub(1);
        let free_after = gaps.get(g + 1).is_none_or(|next| next.after > right);
        if left > 0 && free_before && right + 1 < series.len() && free_after {
            nodes.push((-1.0, series[left - 1]));
            nodes.push((wide + 1.0, series[right + 1]));
        }
        whole.extend((1..=gap.missing).map(|k| lagrange(&nodes, k as f64)));
    }
    whole.extend_from_slice(&series[from..]);
    whole
}

/// The polynomial through all nodes, at `at`.
fn lagrange(nodes: &[(f64, f64)], at: f64) -> f64 {
    nodes
        .iter()
        .enumerate()
        .map(|(i, (x, y))| {
            let weight: f64 = nodes
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, (other, _))| (at - other) / (x - other))
                .product();
            y * weight
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_bridged_exactly() {
        let f = |i: f64| 1.0 - i + 0.5 * i * i - 0.01 * i * i * i;
        let kept: Vec<f64> = (0..30)
            .filter(|i| !(10..13).contains(i) && *i != 20)
            .map(|i| f(f64::from(i)))
            .collect();
        let gaps = [
            Gap {
                after: 9,
                missing: 3,
            },
            Gap {
                after: 16,
                missing: 1,
            },
        ];
        let whole = bridge(&kept, &gaps);
        assert_eq!(whole.len(), 30);
        for (i, y) in whole.iter().enumerate() {
            assert!((y - f(i as f64)).abs() < 1e-9, "row {i}");
        }
    }

    #[test]
    fn at_an_end_or_beside_another_gap_it_is_a_straight_line() {
        let gaps = [
            Gap {
                after: 0,
                missing: 1,
            },
            Gap {
                after: 1,
                missing: 2,
            },
        ];
        let whole = bridge(&[0.0, 2.0, 5.0], &gaps);
        assert_eq!(whole.len(), 6);
        for (i, y) in whole.iter().enumerate() {
            assert!((y - i as f64).abs() < 1e-12, "row {i}: {y}");
        }
    }
}
