//! Applying a linear-phase FIR filter with zero phase, and the integer taps that the device shares.

use crate::text::error::{Error, Result};
use jointwatch_shared::wire::rig::Taps;
use pulp::{Arch, Simd, WithSimd};

/// Rows filtered at a time: as many as vector registers hold beside what they are made of.
const BLOCK: usize = 32;
/// Bound on the sum of the integer taps' magnitudes: with 32-bit counts no sum then leaves 62 bits.
const TAP_SUM: i64 = (1 << 31) - 1;

/// Filters `series` with zero phase: `y[i] = Σ taps[half + m]·x[i + half − m]` over `m = −half …
/// half`.
///
/// Only rows with full support are returned: `series.len() − taps.len() + 1` of them, none when the
/// series is shorter than the filter; row 0 of the result belongs to row `taps.len() / 2` of the
/// series. The taps must be an odd number and symmetric or antisymmetric, which halves the work and
/// makes the derivative of a constant exactly zero.
pub fn apply(series: &[f64], taps: &[f64]) -> Vec<f64> {
    Arch::new().dispatch(Whole { series, taps })
}

/// The loop of [`apply`], which `pulp` compiles for the vector registers that the processor turns
/// out to have. Every row is summed in the same order in each of them, so the bits do not depend on
/// the processor.
struct Whole<'a> {
    series: &'a [f64],
    taps: &'a [f64],
}

impl WithSimd for Whole<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) -> Vec<f64> {
        let Self { series, taps } = self;
        let half = taps.len() / 2;
        if series.len() < taps.len() {
            return Vec::new();
        }
        let antisymmetric = half > 0 && taps[half - 1] == -taps[half + 1] && taps[half] == 0.0;
        let mut out = vec![0.0; series.len() - 2 * half];
        if antisymmetric {
            filter(series, taps, &mut out, |newer, older| newer - older);
        } else {
            filter(series, taps, &mut out, |newer, older| newer + older);
        }
        out
    }
}

/// Fills `out`; `pair` is what two rows as far from the middle count together.
#[inline(always)]
fn filter(series: &[f64], taps: &[f64], out: &mut [f64], pair: impl Fn(f64, f64) -> f64 + Copy) {
    let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
    let whole = BLOCK * blocks.len();
    for (block, rows) in blocks.iter_mut().enumerate() {
        *rows = filtered(&series[block * BLOCK..], taps, pair);
    }
    for (row, y) in rest.iter_mut().enumerate() {
        [*y] = filtered(&series[whole + row..], taps, pair);
    }
}

/// The first rows of a filtered series, side by side in registers while all taps pass over them.
#[inline(always)]
fn filtered<const ROWS: usize>(
    series: &[f64],
    taps: &[f64],
    pair: impl Fn(f64, f64) -> f64,
) -> [f64; ROWS] {
    let half = taps.len() / 2;
    let shifted = |offset: usize| -> &[f64; ROWS] {
        let rows = series[offset..].first_chunk();
        rows.expect("the series is as long as taps and rows")
    };
    let mut sums = shifted(half).map(|x| taps[half] * x);
    for m in 1..=half {
        let tap = taps[half - m];
        let pairs = shifted(half + m).iter().zip(shifted(half - m));
        for (sum, (newer, older)) in sums.iter_mut().zip(pairs) {
            *sum += tap * pair(*newer, *older);
        }
    }
    sums
}

/// Every `step`-th row of what [`apply`] gives, beginning with the first; the taps must be
/// symmetric.
pub fn apply_every(series: &[f64], taps: &[f64], step: usize) -> Vec<f64> {
    Arch::new().dispatch(Thinned { series, taps, step })
}

/// The loop of [`apply_every`], which `pulp` compiles for the vector registers that the processor
/// turns out to have.
struct Thinned<'a> {
    series: &'a [f64],
    taps: &'a [f64],
    step: usize,
}

impl WithSimd for Thinned<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) -> Vec<f64> {
        // Sums side by side, which vector registers can hold; one running sum would wait for every
        // addition.
        const LANES: usize = 16;
        let Self { series, taps, step } = self;
        let mut out =
            Vec::with_capacity((series.len() + 1).saturating_sub(taps.len()).div_ceil(step));
        for window in series.windows(taps.len()).step_by(step) {
            let mut sums = [0.0; LANES];
            let (values, values_rest) = window.as_chunks::<LANES>();
            let (weights, weights_rest) = taps.as_chunks::<LANES>();
            for (values, weights) in values.iter().zip(weights) {
                for ((sum, value), weight) in sums.iter_mut().zip(values).zip(weights) {
                    *sum += value * weight;
                }
            }
            let rest = values_rest.iter().zip(weights_rest).map(|(v, w)| v * w);
            // By halves, which vector registers add side by side.
            let mut count = LANES / 2;
            while count > 0 {
                let (low, high) = sums.split_at_mut(count);
                low.iter_mut().zip(high).for_each(|(l, h)| *l += *h);
                count /= 2;
            }
            out.push(sums[0] + rest.sum::<f64>());
        }
        out
    }
}

/// Of so many rows behind a low-pass one is enough: neighbours say nearly the same. At least 1.
pub(crate) fn thinning(taps: &[f64], sample_rate_hz: f64) -> usize {
    let every = 0.5 * sample_rate_hz / shut_from_hz(taps, sample_rate_hz);
    every.floor().max(1.0) as usize
}

/// The frequency in Hz from which a symmetric low-pass lets through less than a thousandth, up to
/// half the sample rate.
pub fn shut_from_hz(taps: &[f64], sample_rate_hz: f64) -> f64 {
    const STEPS: usize = 512;
    let half = taps.len() / 2;
    let gain = |step: usize| {
        let phase = std::f64::consts::PI * step as f64 / STEPS as f64;
        let sides = (1..=half).map(|m| 2.0 * taps[half + m] * (phase * m as f64).cos());
        (taps[half] + sides.sum::<f64>()).abs()
    };
    let open = (0..=STEPS).rev().find(|&step| gain(step) > 1e-3);
    0.5 * sample_rate_hz * (open.map_or(0, |step| step + 1)).min(STEPS) as f64 / STEPS as f64
}

/// Rounds `taps` to integers times a power of two, as the device holds them.
///
/// The exponent is the largest at which the magnitudes of the integer taps sum to less than 2³¹, so
/// that a sum over 32-bit counts fits 64 bits whatever they are. Rounding errors are gathered in
/// the centre tap of a symmetric filter, so that its gain at rest (1 of a low-pass, 0 of a second
/// derivative) is exact. Taps that came from [`to_f64`] are returned with exactly the values they
/// had.
///
/// # Errors
/// When there are more than `MOST` taps, or when they cannot be scaled (all zero, not finite, or an
/// exponent beyond ±127).
pub fn quantise<const MOST: usize>(taps: &[f64]) -> Result<Taps<MOST>> {
    let magnitude: f64 = taps.iter().map(|t| t.abs()).sum();
    if taps.len() > MOST {
        return Err(Error::failed(format!(
            "a filter of {} taps does not fit the device, which holds {MOST}; try a wider band_hz",
            taps.len()
        )));
    }
    if !(magnitude.is_finite() && magnitude > 0.0) {
        return Err(Error::failed(
            "a filter whose taps are all zero or not finite cannot be put on the device; try another band_hz",
        ));
    }
    let mut shift = (TAP_SUM as f64 / magnitude).log2().floor() as i32 + 1;
    let integers = loop {
        let integers = round_to(taps, shift);
        if integers.iter().map(|t| t.abs()).sum::<i64>() <= TAP_SUM {
            break integers;
        }
        shift -= 1;
    };
    let shift = i8::try_from(shift).map_err(|_| {
        Error::failed(format!(
            "the filter's taps need an exponent of {shift}, beyond the device's ±127; check sample_rate_hz"
        ))
    })?;
    Ok(Taps {
        // Each is below the bound on their sum, which is the largest i32, and their number was
        // checked above.
        taps: integers.into_iter().map(|t| t as i32).collect(),
        shift,
    })
}

fn round_to(taps: &[f64], shift: i32) -> Vec<i64> {
    let scale = 2.0_f64.powi(shift);
    let mut integers: Vec<i64> = taps.iter().map(|t| (t * scale).round() as i64).collect();
    let half = taps.len() / 2;
    let symmetric = half == 0 || taps[half - 1] == taps[half + 1];
    if symmetric {
        let exact = (taps.iter().sum::<f64>() * scale).round() as i64;
        let rest: i64 = integers.iter().sum();
        integers[half] += exact - rest;
    }
    integers
}

/// The values that integer taps stand for, exactly; the host filters with these.
pub fn to_f64<const MOST: usize>(taps: &Taps<MOST>) -> Vec<f64> {
    let step = 2.0_f64.powi(-i32::from(taps.shift));
    taps.taps.iter().map(|&t| f64::from(t) * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::design::{Ideal, design};

    fn filters() -> [Vec<f64>; 3] {
        [
            Ideal::LowPass,
            Ideal::FirstDerivative,
            Ideal::SecondDerivative,
        ]
        .map(|ideal| design(ideal, 2000.0, 300.0, 420.0, 101))
    }

    #[test]
    fn blocks_agree_with_the_plain_convolution() {
        let series: Vec<f64> = (0..3000).map(|i| ((i * i) as f64 * 1e-3).sin()).collect();
        for taps in filters() {
            let fast = apply(&series, &taps);
            assert_eq!(fast.len(), series.len() - taps.len() + 1);
            let scale: f64 = taps.iter().map(|t| t.abs()).sum();
            for (i, y) in fast.iter().enumerate() {
                let newest = i + taps.len() - 1;
                let plain: f64 = taps
                    .iter()
                    .enumerate()
                    .map(|(k, t)| t * series[newest - k])
                    .sum();
                assert!(
                    (y - plain).abs() < 1e-13 * scale,
                    "row {i}: {y} and {plain}"
                );
            }
        }
    }

    #[test]
    fn a_series_shorter_than_the_filter_has_no_row_left() {
        assert!(apply(&[1.0; 100], &filters()[0]).is_empty());
        assert_eq!(apply(&[1.0; 101], &filters()[0]).len(), 1);
    }

    #[test]
    fn integer_taps_keep_the_gain_at_rest_and_survive_a_second_rounding() {
        let sums = [1.0, 0.0, 0.0];
        for (taps, sum) in filters().iter().zip(sums) {
            let held = quantise::<129>(taps).unwrap();
            let back = to_f64(&held);
            let magnitude: i64 = held.taps.iter().map(|&t| i64::from(t).abs()).sum();
            assert!(magnitude <= TAP_SUM && magnitude > TAP_SUM / 2 - 200);
            assert_eq!(back.iter().sum::<f64>(), sum);
            let largest = taps.iter().fold(0.0_f64, |a, t| a.max(t.abs()));
            for (a, b) in taps.iter().zip(&back) {
                assert!((a - b).abs() < 1e-7 * largest);
            }
            assert_eq!(to_f64(&quantise::<129>(&back).unwrap()), back);
        }
    }

    #[test]
    fn what_cannot_be_held_is_refused() {
        assert!(quantise::<129>(&[0.1; 131]).is_err());
        assert!(quantise::<129>(&[0.0; 3]).is_err());
        assert!(quantise::<129>(&[f64::NAN, 1.0, 1.0]).is_err());
        assert!(quantise::<129>(&[1e-60, 1e-60, 1e-60]).is_err());
    }
}
