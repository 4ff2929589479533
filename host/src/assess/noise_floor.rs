//! What no model can explain: the noise floor of every axis.
//!
//! It is what is left on an axis while it rests, because sensors are as noisy then as ever. Where
//! an axis never rests the spectrum of the residual beside the motion's frequencies stands in for
//! it: above them for white noise, below them for noise that grows with one over the frequency. It
//! is no more than what is left where the axis is calm.

use super::unmeasured::{Shape, calm};
use crate::model::per_record;
use crate::model::time_history::{TimeHistory, add_forces};
use crate::signal::fir::apply;
use crate::signal::motion::Motion;
use crate::signal::spectrum::{Accumulator, window_for};
use crate::study::Axis;
use crate::study::series::{rms, spread};
use jointwatch_shared::base::terms::EffectValues;

/// An axis rests in a record where displacement, velocity and force are under these parts of their
/// largest RMS; the force channel is noisier than the encoder.
const AT_REST_BELOW: [f64; 3] = [0.03, 0.03, 0.2];
/// What is left is more than noise where it is so many times what its high frequencies suggest:
/// noise that grows towards low frequencies makes it three or four times as much.
const ACTS: f64 = 6.0;
/// The part of the spectrum that stands in for rest, as shares of half the sample rate.
const TAIL: [f64; 2] = [0.6, 0.9];
/// Into how many pieces the tail is cut, of which the quietest counts.
const PIECES: usize = 6;

/// Length of the windows in which slow noise is looked for, s.
const SLOW_WINDOW_S: f64 = 4.0;
/// The motion begins at the frequency below which this part of its power lies.
const MOVES: f64 = 1e-2;
/// Fewer lines of the spectrum than this say nothing.
const MIN_LINES: usize = 1;
/// Where noise that grows towards low frequencies is taken to end, Hz: slower than that it is a
/// drift of the zero, which a constant force takes up.
const SLOWEST_HZ: f64 = 0.1;

/// The noise floor of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Floor {
    /// RMS in the common band, N or N·m.
    pub(crate) rms: f64,
    /// RMS beyond which it is no noise of a sensor, whatever its spectrum, N or N·m.
    pub(crate) most: f64,
    /// Whether it was seen at rest.
    pub(crate) at_rest: bool,
    /// Whether what was seen at rest is too much for noise: something that nobody measures acts on
    /// the axis.
    pub(crate) acts_at_rest: bool,
    /// Whether on an axis that never rests the spectrum of what is left ends, as that of a force
    /// does and that of noise does not.
    pub(crate) ends: bool,
    /// Whether on such an axis what is left is louder where the axis moves more, as noise of
    /// sensors is not.
    pub(crate) follows_motion: bool,
}

/// The noise floor of every axis under a sum of effects; `inertia` is the one in force, per axis.
pub(crate) fn floors(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    terms: &[EffectValues],
    inertia: &[f64],
) -> Vec<Floor> {
    let conventions: Vec<_> = axes.iter().map(|a| a.restoring_force).collect();
    let predicted = |motion: &&Motion| {
        let mut forces = vec![vec![0.0; motion.rows()]; axes.len()];
        add_forces(
            terms,
            &TimeHistory::of_motion(motion, &conventions),
            &mut forces,
        );
        forces
    };
    let predicted = motions.iter().map(predicted).collect();
    floors_under(axes, motions, low_pass, predicted, terms, inertia)
}

/// The same under any prediction, a series per record and axis, wide-band; of `terms` only those
/// that stand in no prediction are read, the lines of the mains.
pub(crate) fn floors_under(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    predicted: Vec<Vec<Vec<f64>>>,
    terms: &[EffectValues],
    inertia: &[f64],
) -> Vec<Floor> {
    let conventions: Vec<_> = axes.iter().map(|a| a.restoring_force).collect();
    // Residuals of every record and axis, wide-band.
    let residuals: Vec<Vec<Vec<f64>>> = motions
        .iter()
        .zip(predicted)
        .map(|(motion, forces)| {
            let axes = forces.into_iter().enumerate();
            axes.map(|(axis, predicted)| {
                let mut left = motion.restoring_force(axis, inertia[axis], conventions[axis]);
                left.iter_mut().zip(&predicted).for_each(|(r, p)| *r -= p);
                per_record::take_out(terms, axis, &mut left, 1.0 / motion.sample_rate_hz);
                left
            })
            .collect()
        })
        .collect();
    let band = Band::new(low_pass, motions.first().map_or(1.0, |m| m.sample_rate_hz));
    (0..axes.len())
        .map(|axis| {
            let activity: Vec<[f64; 3]> = motions
                .iter()
                .map(|motion| {
                    let force = motion.restoring_force(axis, inertia[axis], conventions[axis]);
                    [
                        spread(&motion.states[2 * axis]),
                        spread(&motion.states[2 * axis + 1]),
                        spread(&apply(&force, low_pass)),
                    ]
                })
                .collect();
            let at_rest = resting(&activity);
            let residuals = residuals.iter().map(|record| record[axis].as_slice());
            let at_rest = residuals
                .clone()
                .zip(&at_rest)
                .filter(|(_, at_rest)| **at_rest);
            let at_rest = at_rest.map(|(residual, _)| residual);
            band.floor_at_rest(at_rest)
                .unwrap_or_else(|| band.floor_from_spectrum(residuals, motions, axis))
        })
        .collect()
}

/// The common band, in which noise is counted.
struct Band<'a> {
    low_pass: &'a [f64],
    sample_rate_hz: f64,
    hz: f64,
}

impl<'a> Band<'a> {
    fn new(low_pass: &'a [f64], sample_rate_hz: f64) -> Self {
        let hz = 0.5 * sample_rate_hz * low_pass.iter().map(|t| t * t).sum::<f64>();
        Self {
            low_pass,
            sample_rate_hz,
            hz,
        }
    }

    /// The floor of an axis that was at rest, from its residuals there; `None` where there are no
    /// rows.
    fn floor_at_rest<'r>(
        &self,
        residuals: impl Iterator<Item = &'r [f64]> + Clone,
    ) -> Option<Floor> {
        let quiet: Vec<Vec<f64>> = residuals
            .clone()
            .map(|residual| apply(residual, self.low_pass))
            .collect();
        let rows: usize = quiet.iter().map(Vec::len).sum();
        if rows == 0 {
            return None;
        }
        let sum: f64 = quiet.iter().flatten().map(|e| e * e).sum();
        let rms = (sum / rows as f64).sqrt();
        let tail = from_tail(residuals.clone(), self.low_pass);
        Some(Floor {
            rms,
            most: rms,
            at_rest: true,
            acts_at_rest: rms > ACTS * tail
                || Shape::of(residuals, self.sample_rate_hz, self.hz).rises(),
            ends: false,
            follows_motion: false,
        })
    }

    /// The floor of an axis that never rests, from the spectrum of its residuals beside the
    /// motion's frequencies.
    fn floor_from_spectrum<'r>(
        &self,
        residuals: impl Iterator<Item = &'r [f64]> + Clone,
        motions: &[&'r Motion],
        axis: usize,
    ) -> Floor {
        let rate = self.sample_rate_hz;
        let white = from_tail(residuals.clone(), self.low_pass);
        let ends = Shape::of(residuals.clone(), rate, self.hz).ends();
        let most = ACTS * white;
        let displacements = motions.iter().map(|m| m.states[2 * axis].as_slice());
        let guessed = white.hypot(slow(residuals.clone(), displacements, self.hz, rate, white));
        let taps = self.low_pass.len();
        let counted = |motion: &Motion, series: Vec<f64>| motion.counted(series, taps, 1);
        let passed: Vec<Vec<f64>> = residuals
            .zip(motions)
            .map(|(residual, motion)| counted(motion, apply(residual, self.low_pass)))
            .collect();
        // The noise is in what is left, so it cannot be more.
        let left = passed.iter().map(|series| rms(series));
        // Sensors are as noisy where the axis is calm as where it moves.
        let calm = passed.iter().zip(motions).filter_map(|(residual, motion)| {
            let states = [0, 1].map(|i| {
                let series = motion.states[2 * axis + i].get(taps / 2..);
                counted(motion, series.unwrap_or_default().to_vec())
            });
            calm(residual, [&states[0], &states[1]], rate, self.hz)
        });
        let calm = calm.fold(f64::INFINITY, f64::min);
        Floor {
            rms: left.fold(guessed.min(most).min(calm), f64::min),
            most,
            at_rest: false,
            acts_at_rest: false,
            ends,
            follows_motion: calm.is_finite(),
        }
    }
}

/// The records in which an axis rests, by how much its displacement, its velocity and, where it is
/// given, its force vary in each.
fn resting<const N: usize>(activity: &[[f64; N]]) -> Vec<bool> {
    let largest: [f64; N] =
        std::array::from_fn(|i| activity.iter().map(|a| a[i]).fold(0.0, f64::max));
    let at_rest = |record: &[f64; N]| {
        let mut pairs = record.iter().zip(&largest).zip(AT_REST_BELOW);
        pairs.all(|((a, most), below)| *a < below * most)
    };
    activity.iter().map(at_rest).collect()
}

/// White noise of the size of the residual's quietest high frequencies, behind the low-pass.
fn from_tail<'a>(residuals: impl Iterator<Item = &'a [f64]> + Clone, low_pass: &[f64]) -> f64 {
    let power = |taps: &[f64]| {
        let (mut sum, mut rows) = (0.0, 0);
        for series in residuals.clone() {
            let passed = apply(series, taps);
            sum += passed.iter().map(|e| e * e).sum::<f64>();
            rows += passed.len();
        }
        let gain: f64 = taps.iter().map(|t| t * t).sum();
        sum / rows.max(1) as f64 / gain
    };
    let width = (TAIL[1] - TAIL[0]) / PIECES as f64;
    let quietest = (0..PIECES)
        .map(|piece| power(&band_pass(TAIL[0] + (piece as f64 + 0.5) * width, width)))
        .fold(f64::INFINITY, f64::min);
    let passed: f64 = low_pass.iter().map(|t| t * t).sum();
    (quietest * passed).sqrt()
}

/// RMS of noise whose power falls with one over the frequency, behind the low-pass, as the residual
/// shows it at frequencies lower than those of the motion; 0 where the motion leaves no room there.
/// `white` is the RMS of the white noise behind the low-pass.
fn slow<'a>(
    residuals: impl Iterator<Item = &'a [f64]> + Clone,
    motion: impl Iterator<Item = &'a [f64]>,
    band_hz: f64,
    rate: f64,
    white: f64,
) -> f64 {
    let segment = window_for(
        residuals.clone().map(<[f64]>::len),
        (SLOW_WINDOW_S * rate) as usize,
    );
    let spectrum = |series: &mut dyn Iterator<Item = &'a [f64]>| {
        let mut sum = Accumulator::new(rate, segment);
        series.for_each(|s| sum.add(s));
        sum.finish()
    };
    let moving = spectrum(&mut { motion });
    let left = spectrum(&mut { residuals });
    // Lines 0 and 1 hold what is left of a mean under the window.
    let first = 2;
    let whole: f64 = moving.density.iter().skip(first).sum();
    let mut below = 0.0;
    let begins = moving.density.iter().skip(first).position(|d| {
        below += d;
        below > MOVES * whole
    });
    let begins = first + begins.unwrap_or(0);
    // The window spreads the motion's first line over its neighbours.
    let lines = first..begins.saturating_sub(1);
    if lines.len() < MIN_LINES {
        return 0.0;
    }
    let white = white * white / band_hz;
    let count = lines.len() as f64;
    let per_octave = lines
        .map(|line| (left.density[line] - white) * line as f64 * left.resolution_hz)
        .sum::<f64>()
        / count;
    (per_octave.max(0.0) * (band_hz / SLOWEST_HZ).ln().max(0.0)).sqrt()
}

/// A symmetric band-pass about a frequency, both as shares of half the sample rate: a cosine under
/// a Hann window.
fn band_pass(center: f64, width: f64) -> Vec<f64> {
    let half = (2.0 / width).ceil() as i32;
    (-half..=half)
        .map(|m| {
            let phase = std::f64::consts::PI * f64::from(m);
            let window = 0.5 + 0.5 * (phase / f64::from(half + 1)).cos();
            window * (phase * center).cos()
        })
        .collect()
}
