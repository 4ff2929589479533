//! What no model can explain: the noise floor of every axis.
//!
//! It is what is left on an axis while it rests, because sensors are as noisy then as ever. Where an axis never rests the
//! spectrum of the residual above the motion's frequencies stands in for it; that floor is lower than the true one when
//! the noise grows towards low frequencies.

use crate::lines;
use crate::model::effects::{Course, add_forces};
use crate::motion::Motion;
use crate::signal::fir::apply;
use crate::study::Axis;
use jointwatch_shared::model::terms::InSi;

/// An axis rests in a record where displacement, velocity and force are under this part of their largest RMS.
const RESTS_BELOW: f64 = 0.03;
/// The part of the spectrum that stands in for rest, as shares of half the sample rate.
const TAIL: [f64; 2] = [0.6, 0.9];
/// Into how many pieces the tail is cut, of which the quietest counts.
const PIECES: usize = 6;

/// The noise floor of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Floor {
    /// RMS in the common band, N or N·m.
    pub(crate) rms: f64,
    /// Whether it was seen at rest.
    pub(crate) at_rest: bool,
}

/// The noise floor of every axis under a sum of effects; `inertia` is the one in force, per axis.
pub(crate) fn floors(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    terms: &[InSi],
    inertia: &[f64],
) -> Vec<Floor> {
    let conventions: Vec<_> = axes.iter().map(|a| a.restoring_force).collect();
    // Residuals of every record and axis, wide-band.
    let residuals: Vec<Vec<Vec<f64>>> = motions
        .iter()
        .map(|motion| {
            let mut forces = vec![vec![0.0; motion.rows()]; axes.len()];
            add_forces(terms, &Course::of_motion(motion, &conventions), &mut forces);
            let axes = forces.into_iter().enumerate();
            axes.map(|(axis, predicted)| {
                let mut left = motion.restoring_force(axis, inertia[axis], conventions[axis]);
                left.iter_mut().zip(&predicted).for_each(|(r, p)| *r -= p);
                lines::take_out(terms, axis, &mut left, 1.0 / motion.sample_rate_hz);
                left
            })
            .collect()
        })
        .collect();
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
            let largest: [f64; 3] =
                std::array::from_fn(|i| activity.iter().map(|a| a[i]).fold(0.0, f64::max));
            let rests = |record: usize| {
                let mut pairs = activity[record].iter().zip(&largest);
                pairs.all(|(a, most)| *a < RESTS_BELOW * most)
            };
            let quiet: Vec<Vec<f64>> = (0..motions.len())
                .filter(|&record| rests(record))
                .map(|record| apply(&residuals[record][axis], low_pass))
                .collect();
            let rows: usize = quiet.iter().map(Vec::len).sum();
            if rows > 0 {
                let sum: f64 = quiet.iter().flatten().map(|e| e * e).sum();
                return Floor {
                    rms: (sum / rows as f64).sqrt(),
                    at_rest: true,
                };
            }
            let of_axis = residuals.iter().map(|record| record[axis].as_slice());
            Floor {
                rms: from_tail(of_axis, low_pass),
                at_rest: false,
            }
        })
        .collect()
}

/// RMS about the mean.
fn spread(series: &[f64]) -> f64 {
    let count = series.len().max(1) as f64;
    let mean = series.iter().sum::<f64>() / count;
    (series.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count).sqrt()
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

/// A symmetric band-pass about a frequency, both as shares of half the sample rate: a cosine under a Hann window.
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
