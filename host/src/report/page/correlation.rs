//! Correlations of a residual with itself, the force and the motion, with bounds that hold for
//! coloured residuals.
//!
//! The usual bound ±2.58/√N holds for white residuals. A low-passed residual is coloured:
//! neighbours resemble each other, so it holds fewer independent rows than N, and nearly any
//! residual would look guilty. Here the bound comes from surrogates: the residual is cut into
//! blocks longer than the largest lag, which keep its colour, and the blocks are put together in
//! random order with random signs. A surrogate has nothing to do with the force any more; 99 of 100
//! of its coefficients set the bound.

use super::contents::{Correlation, SpectrumContents};
use crate::report::axis_history::AxisHistory;
use crate::signal::spectrum::Accumulator;
use crate::study::series::about_mean;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rows per second that are looked at, as multiples of the common band: the residual has next to no
/// power above twice the band.
const RATE_OVER_BAND: f64 = 4.0;
/// Rows per record that are looked at: the middle of longer records.
const MAX_ROWS: usize = 16_384;
/// The largest lag, rows.
const MAX_LAG: usize = 160;
/// A lag is at most this part of the shortest record.
const SHARE_OF_RECORD: usize = 8;
/// Surrogates that the bounds are made from.
const SURROGATES: usize = 120;
/// Lags at which every surrogate is looked at.
const LOOKS: usize = 6;
/// The part of the surrogates' coefficients inside the bound.
const INSIDE: f64 = 0.99;
/// Lines of the spectrum within the common band.
const LINES: f64 = 150.0;
/// The spectrum is drawn to this many times the common band, where the low-pass has ended.
const SPECTRUM_OVER_BAND: f64 = 2.0;

/// The residual's correlations with itself and with what drives the joint, all records together.
pub(super) fn correlations(histories: &[AxisHistory], rate: f64, band_hz: f64) -> Vec<Correlation> {
    let step = ((rate / (RATE_OVER_BAND * band_hz)) as usize).max(1);
    let records: Vec<Vec<Vec<f64>>> = histories
        .iter()
        .map(|history| {
            let residual = history.residual();
            let series = [
                &residual,
                &history.measured,
                &history.displacement,
                &history.velocity,
            ];
            series.map(|s| thinned(s, step)).to_vec()
        })
        .collect();
    let shortest = records.iter().map(|r| r[0].len()).min().unwrap_or(0);
    let lags = MAX_LAG.min(shortest / SHARE_OF_RECORD);
    if lags == 0 {
        return Vec::new();
    }
    let step_s = step as f64 / rate;
    let names = ["residual", "force", "displacement", "velocity"];
    let bounds = bounds(&records, lags);
    let all = names.into_iter().enumerate();
    all.map(|(at, with)| {
        let first = if at == 0 { 0 } else { -(lags as isize) };
        let size = size(&records, at);
        let coefficient = (first..=lags as isize)
            .map(|lag| coefficient(&records, at, lag, size, None) as f32)
            .collect();
        Correlation {
            with,
            step_s,
            coefficient,
            bound: bounds[at],
        }
    })
    .collect()
}

/// Every `step`-th row about the mean, the middle of what is long.
fn thinned(series: &[f64], step: usize) -> Vec<f64> {
    let all: Vec<f64> = series.iter().step_by(step).copied().collect();
    let spare = all.len().saturating_sub(MAX_ROWS) / 2;
    about_mean(&all[spare..all.len() - spare])
}

/// The coefficient of the residual (or of surrogates in its place), `lag` rows later, with series
/// `with` of every record, of this size.
fn coefficient(
    records: &[Vec<Vec<f64>>],
    with: usize,
    lag: isize,
    size: f64,
    surrogates: Option<&[Vec<f64>]>,
) -> f64 {
    let mut product = 0.0;
    for (index, record) in records.iter().enumerate() {
        let e = surrogates.map_or(&record[0], |s| &s[index]);
        let u = &record[with];
        let late = lag.unsigned_abs();
        let (e_cut, u_cut) = match lag >= 0 {
            true => (&e[late..], &u[..u.len() - late]),
            false => (&e[..e.len() - late], &u[late..]),
        };
        product += dot(e_cut, u_cut);
    }
    match size > 0.0 {
        true => product / size,
        false => 0.0,
    }
}

/// What the residual and series `with` have at most in common: the roots of their sums of squares.
/// Surrogates have the residual's.
fn size(records: &[Vec<Vec<f64>>], with: usize) -> f64 {
    let squares = |series: usize| -> f64 {
        let records = records.iter().map(|record| &record[series]);
        records.map(|s| dot(s, s)).sum()
    };
    (squares(0) * squares(with)).sqrt()
}

/// The sum of products, in eight sums side by side, which the processor forms at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (left, right) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = left.remainder().iter().zip(right.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 8];
    for (a, b) in left.zip(right) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Per series, what 99 of 100 coefficients of surrogates stay below.
fn bounds(records: &[Vec<Vec<f64>>], lags: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut seen: Vec<Vec<f64>> = vec![Vec::new(); records[0].len()];
    let sizes: Vec<f64> = (0..seen.len()).map(|with| size(records, with)).collect();
    for _ in 0..SURROGATES {
        let surrogates = records.iter();
        let surrogates: Vec<Vec<f64>> = surrogates
            .map(|record| surrogate(&record[0], 2 * lags, &mut rng))
            .collect();
        for _ in 0..LOOKS {
            let lag = rng.random_range(-(lags as i64)..=lags as i64) as isize;
            for (with, seen) in seen.iter_mut().enumerate() {
                seen.push(coefficient(records, with, lag, sizes[with], Some(&surrogates)).abs());
            }
        }
    }
    let quantile = |mut seen: Vec<f64>| {
        seen.sort_by(f64::total_cmp);
        seen[(INSIDE * (seen.len() - 1) as f64) as usize]
    };
    seen.into_iter().map(quantile).collect()
}

/// The blocks of a series, the first of a random length, in random order and with random signs.
fn surrogate(series: &[f64], block: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let block = block.min(series.len() / 4).max(1);
    let first = rng.random_range(0..block);
    let (head, tail) = series.split_at(first);
    let mut blocks: Vec<&[f64]> = std::iter::once(head).chain(tail.chunks(block)).collect();
    blocks.shuffle(rng);
    let mut mixed = Vec::with_capacity(series.len());
    for block in blocks {
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        mixed.extend(block.iter().map(|v| sign * v));
    }
    mixed
}

/// Amplitude densities of residual and measured force, all records together.
pub(super) fn spectrum(histories: &[AxisHistory], rate: f64, band_hz: f64) -> SpectrumContents {
    let shortest = histories
        .iter()
        .map(|c| c.measured.len())
        .min()
        .unwrap_or(0);
    let segment = ((LINES * rate / band_hz) as usize).clamp(16, (shortest / 2).max(16));
    let (mut residual, mut force) = (
        Accumulator::new(rate, segment),
        Accumulator::new(rate, segment),
    );
    for history in histories {
        residual.add(&history.residual());
        force.add(&history.measured);
    }
    let (residual, force) = (residual.finish(), force.finish());
    let lines = (SPECTRUM_OVER_BAND * band_hz / residual.resolution_hz) as usize + 1;
    let density = |power: &[f64]| {
        let power = power.iter().take(lines);
        power.map(|p| p.sqrt() as f32).collect()
    };
    SpectrumContents {
        resolution_hz: residual.resolution_hz,
        residual: density(&residual.density),
        force: density(&force.density),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::axis_history::Along;
    use crate::study::AxisKind;

    /// A coloured residual: noise through a first-order low-pass; it holds `share` times the force
    /// besides.
    fn history(share: f64, seed: u64) -> AxisHistory {
        println!("seed {seed}");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut coloured = |rows: usize| {
            let mut state = 0.0;
            let mut next = || {
                state = 0.9 * state + rng.random_range(-1.0..1.0);
                state
            };
            (0..rows).map(|_| next()).collect::<Vec<f64>>()
        };
        let (force, noise) = (coloured(8_000), coloured(8_000));
        let residual = force.iter().zip(&noise).map(|(f, n)| share * f + n);
        let predicted = force.iter().zip(residual).map(|(f, e)| f - e).collect();
        AxisHistory {
            axis: "x".into(),
            kind: AxisKind::Translation,
            along: Along::Time,
            at: (0..8_000).map(|i| 1e-2 * f64::from(i)).collect(),
            displacement: coloured(8_000),
            velocity: coloured(8_000),
            measured: force,
            predicted,
        }
    }

    #[test]
    fn a_coloured_residual_is_not_guilty_and_a_share_of_the_force_is() {
        let outside = |share: f64, with: usize| {
            let all = correlations(&[history(share, 5)], 100.0, 25.0);
            let bound = all[with].bound;
            let beyond = all[with].coefficient.iter();
            let beyond = beyond.filter(|c| f64::from(c.abs()) > bound).count();
            (beyond as f64 / all[with].coefficient.len() as f64, bound)
        };
        let (guilty, bound) = outside(0.0, 1);
        println!("{guilty} of the lags outside ±{bound}");
        assert!(guilty < 0.05, "{guilty}");
        // The formula for white residuals would be 2.58/√8000 = 0.029, and find many more outside.
        assert!((0.05..0.15).contains(&bound), "{bound}");
        assert!(outside(0.3, 1).0 > 0.02);
        let all = correlations(&[history(0.0, 5)], 100.0, 25.0);
        assert_eq!(all[0].coefficient[0], 1.0);
        assert!((f64::from(all[0].coefficient[1]) - 0.9).abs() < 0.02);
    }

    #[test]
    fn a_late_residual_is_correlated_at_a_positive_lag() {
        let mut history = history(0.0, 9);
        let late: Vec<f64> = (0..8_000)
            .map(|row: usize| row.checked_sub(7).map_or(0.0, |r| history.velocity[r]))
            .collect();
        history.predicted = history
            .measured
            .iter()
            .zip(late)
            .map(|(m, e)| m - e)
            .collect();
        let all = correlations(&[history], 100.0, 25.0);
        let velocity = &all[3].coefficient;
        let most = (0..velocity.len()).max_by(|a, b| velocity[*a].total_cmp(&velocity[*b]));
        assert_eq!(most, Some(velocity.len() / 2 + 7));
    }

    #[test]
    fn a_short_record_has_no_correlations() {
        let mut history = history(0.0, 1);
        for series in [
            &mut history.displacement,
            &mut history.velocity,
            &mut history.measured,
            &mut history.predicted,
        ] {
            series.truncate(6);
        }
        assert!(correlations(&[history], 100.0, 25.0).is_empty());
    }
}
