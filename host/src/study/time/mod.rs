//! Time stamps: the even grid nearest to them, what they are rounded to, and how missing samples
//! are bridged.

mod alignment;
pub(super) mod clock;
#[cfg(test)]
pub(super) mod noise;
pub(crate) mod pieces;
pub(crate) mod resample;
pub(super) mod sampling;
pub(super) mod second_logger;
mod stretches;

use crate::study::series::median;
use std::borrow::Cow;

/// Missing samples in a row that may be bridged.
pub const LONGEST_GAP: usize = 5;
/// Share of a record's rows that may be bridged in all; five rows may be in any record.
pub const BRIDGED_SHARE: f64 = 1e-3;
/// How far the time column may be from the stated sample rate, relative.
pub const RATE_TOLERANCE: f64 = 1e-3;
/// Share of stamps equal to the one before from which on they are rounded, and the rows were even.
const MANY_DOUBLED: f64 = 0.1;
/// How far the steps of a slow clock may be from whole ticks, in ticks.
const OFF_A_TICK: f64 = 0.1;

/// Samples that are missing after a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gap {
    /// The last row before the gap.
    pub(crate) after: usize,
    pub(crate) missing: usize,
}

/// The even grid nearest to all stamps.
pub(crate) struct Grid {
    pub(crate) rate_hz: f64,
    /// Largest distance of a stamp from it, in samples.
    pub(crate) jitter: f64,
    /// When row 0 is due, s.
    pub(crate) start_s: f64,
}

impl Grid {
    /// By least squares of time over row.
    pub(crate) fn of(time: &[f64]) -> Option<Self> {
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
        let jitter = off.fold(0.0, f64::max) / period;
        Some(Self {
            // No stamp moves the slope by more than its own jitter over the length.
            rate_hz: round_rate(1.0 / period, jitter / count),
            jitter,
            start_s: mean - middle * period,
        })
    }

    /// Whether the rows may be taken as even: no stamp is further from the grid than half a period,
    /// or than its rounding explains.
    pub(crate) fn is_even(&self, rounded_s: f64) -> bool {
        let rounded = rounded_s * self.rate_hz;
        // Rounding moves stamps within an interval of its own length, in which the grid lies
        // somewhere. Where each stamp should be another one, a row whose stamp is that of
        // its neighbour is not rounded but wrong.
        let allowed = if rounded > 1.5 {
            rounded
        } else {
            0.5 * rounded
        };
        self.jitter <= (allowed + 0.05).max(0.5)
    }
}

/// What the stamps are rounded to, when the steps of the last thousand are whole multiples of one.
/// (Stamps of so many significant digits are coarsest at the end.)
pub(crate) fn quantum(time: &[f64]) -> Option<f64> {
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
    if least.is_finite() && differ && steps().all(whole) {
        return Some(least);
    }
    ticks(last, floor)
}

/// The period of a clock that ticks several times slower than rows come, such as one of 15.6 ms
/// whose stamps are written in whole milliseconds.
fn ticks(time: &[f64], floor: f64) -> Option<f64> {
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let rising: Vec<f64> = steps.iter().copied().filter(|s| *s > floor).collect();
    let rows_a_tick = steps.len() as f64 / rising.len() as f64;
    let tick = median(rising.clone())?;
    let whole = |step: &f64| (step / tick - (step / tick).round()).abs() < OFF_A_TICK;
    (rows_a_tick > 1.5 && rising.iter().all(whole)).then_some(tick)
}

/// The values that are there, and their times.
pub(super) fn sampled(logged: &[f64], clock: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let rows = logged.iter().zip(clock).map(|(v, t)| (*v, *t));
    rows.filter(|(v, t)| v.is_finite() && t.is_finite()).unzip()
}

/// The times of rows between the ticks of a clock: evenly from one stamp to the next, or over one
/// tick where the next is a gap away, or is the last.
fn spread(stamps: &[f64]) -> Vec<f64> {
    let steps = stamps.windows(2).map(|w| w[1] - w[0]);
    let tick = median(steps.filter(|s| *s > 0.0).collect()).unwrap_or(0.0);
    let mut times = Vec::with_capacity(stamps.len());
    for rows in stamps.chunk_by(|a, b| a == b) {
        let next = stamps.get(times.len() + rows.len());
        let step = next.map(|next| next - rows[0]);
        let step = step.filter(|step| *step < 1.5 * tick).unwrap_or(tick);
        let pace = step / rows.len() as f64;
        times.extend((0..rows.len()).map(|row| rows[0] + pace * row as f64));
    }
    times
}

/// The times of rows whose stamps are rounded so coarsely that many are alike: the grid's own where
/// they are even, else spread between the ticks.
pub(super) fn even_where_rounded(seconds: &[f64]) -> Cow<'_, [f64]> {
    let doubled = seconds.windows(2).filter(|w| w[1] == w[0]).count();
    if (doubled as f64) < MANY_DOUBLED * seconds.len() as f64 {
        return Cow::Borrowed(seconds);
    }
    match (Grid::of(seconds), quantum(seconds)) {
        (Some(grid), Some(rounded)) if grid.is_even(rounded) => (0..seconds.len())
            .map(|row| grid.start_s + row as f64 / grid.rate_hz)
            .collect(),
        (_, Some(_)) => Cow::Owned(spread(seconds)),
        _ => Cow::Borrowed(seconds),
    }
}

/// The roundest rate within a relative tolerance, or within 1e-7 of a whole thousandth: that is
/// what was meant.
pub(crate) fn round_rate(rate: f64, tolerance: f64) -> f64 {
    let near = |unit: f64, tolerance: f64| {
        let round = (rate / unit).round() * unit;
        (round > 0.0 && (rate / round - 1.0).abs() < tolerance).then_some(round)
    };
    [1000.0, 100.0, 10.0, 1.0]
        .into_iter()
        .find_map(|unit| near(unit, tolerance))
        .or_else(|| {
            let round = (rate * 1e3).round() / 1e3;
            ((rate / round - 1.0).abs() < 1e-7).then_some(round)
        })
        .unwrap_or(rate)
}

/// The stamps of a log that is only looked at.
pub(crate) struct Stamps {
    pub(crate) rate_hz: f64,
    /// Largest distance of a stamp from an even grid, in samples.
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
            rate_hz: grid.rate_hz,
            jitter: grid.jitter,
            missing: 0,
            places: 0,
        };
        let steps: Vec<f64> = seconds
            .windows(2)
            .map(|w| w[1] - w[0])
            .filter(|s| *s > 0.0)
            .collect();
        if grid.is_even(quantum(seconds).unwrap_or(0.0)) {
            return Some(even);
        }
        if let Cow::Owned(times) = even_where_rounded(seconds) {
            return Self::of(&times);
        }
        let Some(median) = median(steps.clone()) else {
            return Some(even);
        };
        let wholes = || steps.iter().map(|s| (s / median).round().max(1.0));
        let whole: f64 = wholes().sum();
        let rate = whole / (seconds[seconds.len() - 1] - seconds[0]);
        let off = |s: &f64| (s * rate - (s * rate).round().max(1.0)).abs();
        Some(Self {
            rate_hz: round_rate(rate, 0.0),
            jitter: steps.iter().map(off).fold(0.0, f64::max),
            missing: (whole as usize).saturating_sub(steps.len()),
            places: wholes().filter(|w| *w > 1.0).count(),
        })
    }
}

/// Fills the gaps of a series: a cubic through the two rows on each side, a straight line where
/// there are not two.
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
    fn rows_between_the_ticks_of_a_slow_clock_are_spread_evenly() {
        // A clock of 15.625 ms, written in whole milliseconds, and rows that come a little slower
        // now and then.
        let due = |row: usize| {
            let t = row as f64 / 427.0;
            t + 0.02 * (1.3 * t).sin()
        };
        let stamps: Vec<f64> = (0..1700)
            .map(|row| ((due(row) / 0.015_625).floor() * 15.625).round() * 1e-3)
            .collect();
        let times = even_where_rounded(&stamps);
        let off = times.iter().enumerate().skip(10).take(1680);
        let most = off.map(|(row, t)| (t - due(row)).abs()).fold(0.0, f64::max);
        assert!(most < 0.004, "{most}");
        let looked = Stamps::of(&stamps).unwrap();
        assert!(
            (looked.rate_hz / 427.0 - 1.0).abs() < 0.01,
            "{}",
            looked.rate_hz
        );
        // A stamp that is there twice now and then is no clock that ticks.
        let doubled: Vec<f64> = (0..1700)
            .map(|row| 1e-3 * (row - row / 100) as f64)
            .collect();
        assert!(ticks(&doubled, 0.0).is_none());
    }

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
