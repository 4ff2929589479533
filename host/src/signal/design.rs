//! Design of the low-pass and of the band-limited first and second differentiators, by least
//! squares.
//!
//! Why not a windowed ideal filter: a window leaves an error that is constant over the pass band,
//! and what counts for a derivative is the error *relative* to `ω` or `ω²`, which must vanish at
//! rest. Here each filter is the least-squares solution in relative error over the pass band, with
//! zero gain above the stop edge, so a constant has derivative zero exactly and slow motion is
//! differentiated as well as fast motion.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// What a filter does to a slow signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ideal {
    /// Leaves it as it is; symmetric taps with sum 1.
    LowPass,
    /// d/dt, in 1/s; antisymmetric taps.
    FirstDerivative,
    /// d²/dt², in 1/s²; symmetric taps with sum 0.
    SecondDerivative,
}

/// Rounds of reweighting; more bring the ripple no lower by a decibel.
const REWEIGHTINGS: usize = 8;
/// Least pass band of a differentiator as a share of the sample rate: a second derivative over
/// fewer hertz needs more taps than the device has to keep its promise on errors.
pub const NARROWEST_DERIVATIVE: f64 = 0.06;

/// Weight in the transition band, where any smooth fall will do; it keeps the equations well
/// conditioned.
const TRANSITION_WEIGHT: f64 = 1e-6;
/// Frequencies per tap on which the error is summed.
const GRID_PER_TAP: usize = 8;
/// Attenuation the length estimate aims at, dB (Kaiser's rule).
const ATTENUATION_DB: f64 = 90.0;

/// The odd number of taps that reaches 90 dB over a transition of `transition_hz` (Kaiser 1974), at
/// least 9.
pub fn taps_for(transition_hz: f64, sample_rate_hz: f64) -> usize {
    let width = 2.0 * PI * transition_hz / sample_rate_hz;
    let half = ((ATTENUATION_DB - 7.95) / (2.285 * width) / 2.0).ceil();
    2 * (half.clamp(4.0, 1e6) as usize) + 1
}

/// The transition in Hz that `taps` taps need for 90 dB; the inverse of [`taps_for`].
pub fn transition_for(taps: usize, sample_rate_hz: f64) -> f64 {
    (ATTENUATION_DB - 7.95) / (2.285 * (taps - 1) as f64) * sample_rate_hz / (2.0 * PI)
}

/// Designs a filter of an odd number of `taps`, flat from 0 to `pass_hz` and zero from `stop_hz` to
/// half the sample rate.
///
/// The taps are ordered for `y[n] = Σ taps[i]·x[n − i]`. With `pass_hz < stop_hz ≤ sample_rate_hz /
/// 2` and a transition as wide as [`transition_for`] says, the relative error in the pass band
/// stays below 1e-4 and the stop band lies 80 dB or more below the gain at the pass edge: for a
/// low-pass always, for a differentiator when `pass_hz` is at least [`NARROWEST_DERIVATIVE`] of the
/// sample rate and the transition is no wider than the pass band (asserted by the tests).
///
/// # Panics
/// When `taps` is even or below 3, or when the edges are out of order: the caller chooses them, not
/// the user.
pub fn design(
    ideal: Ideal,
    sample_rate_hz: f64,
    pass_hz: f64,
    stop_hz: f64,
    taps: usize,
) -> Vec<f64> {
    assert!(
        taps % 2 == 1 && taps >= 3,
        "an odd number of taps, not {taps}"
    );
    assert!(
        0.0 < pass_hz && pass_hz < stop_hz && stop_hz <= 0.5 * sample_rate_hz,
        "pass {pass_hz} Hz, stop {stop_hz} Hz at {sample_rate_hz} Hz"
    );
    let half = taps / 2;
    let unknowns = if ideal == Ideal::LowPass {
        half + 1
    } else {
        half
    };
    let pass = 2.0 * PI * pass_hz / sample_rate_hz;
    let stop = 2.0 * PI * stop_hz / sample_rate_hz;
    let grid = GRID_PER_TAP * taps;
    let mut rows = DMatrix::zeros(grid, unknowns);
    let mut wanted = DVector::zeros(grid);
    let mut counted = vec![true; grid];
    for g in 0..grid {
        let omega = PI * (g as f64 + 0.5) / grid as f64;
        // The gain a derivative must have, 1 for the low-pass; errors count relative to it, above
        // the pass band relative to its value at the pass edge.
        let gain = |w: f64| match ideal {
            Ideal::LowPass => 1.0,
            Ideal::FirstDerivative => w,
            Ideal::SecondDerivative => w * w,
        };
        // The first frequency past an edge still counts, so that the ripple is held up to the edge
        // itself.
        let (weight, shape) = if omega <= pass + PI / grid as f64 {
            (1.0, 1.0)
        } else if omega >= stop - PI / grid as f64 {
            (1.0, 0.0)
        } else {
            counted[g] = false;
            let fall = 0.5 + 0.5 * (PI * (omega - pass) / (stop - pass)).cos();
            (TRANSITION_WEIGHT, fall)
        };
        let weight = weight / gain(omega.min(pass));
        wanted[g] = weight * shape * gain(omega);
        for u in 0..unknowns {
            rows[(g, u)] = weight * basis(ideal, u, omega);
        }
    }
    let solution = nearly_equal_ripple(&rows, &wanted, &counted);
    expand(ideal, solution.as_slice(), half, sample_rate_hz)
}

/// Least squares, repeated with more weight where the error was large (Lawson's method): plain
/// least squares leaves most of its error at the two edges, ten times what it is elsewhere.
fn nearly_equal_ripple(
    rows: &DMatrix<f64>,
    wanted: &DVector<f64>,
    counted: &[bool],
) -> DVector<f64> {
    let unknowns = rows.ncols();
    let mut weights = DVector::from_element(rows.nrows(), 1.0);
    let mut solution = DVector::zeros(unknowns);
    for _ in 0..REWEIGHTINGS {
        let mut weighted = rows.clone();
        for mut column in weighted.column_iter_mut() {
            column.component_mul_assign(&weights);
        }
        let mut right = wanted.component_mul(&weights);
        let qr = weighted.qr();
        qr.q_tr_mul(&mut right);
        solution = qr
            .r()
            .solve_upper_triangular(&right.rows(0, unknowns).into_owned())
            .expect("the transition weight keeps every column independent");
        let error = rows * &solution - wanted;
        let largest = error
            .iter()
            .zip(counted)
            .filter(|(_, c)| **c)
            .fold(f64::MIN_POSITIVE, |most, (e, _)| most.max(e.abs()));
        for ((weight, e), counts) in weights.iter_mut().zip(&error).zip(counted) {
            if *counts {
                *weight *= (0.25 + e.abs() / largest).sqrt();
            } else {
                // Stays a millionth of its neighbours while they are rescaled.
                *weight *= 0.5;
            }
        }
    }
    solution
}

/// The response of unknown `u` at `omega` rad/sample, real after the delay (and the j of a first
/// derivative) is taken off.
fn basis(ideal: Ideal, u: usize, omega: f64) -> f64 {
    match ideal {
        Ideal::LowPass => (u as f64 * omega).cos(),
        Ideal::FirstDerivative => ((u + 1) as f64 * omega).sin(),
        // 1 − cos, written so that it keeps its digits near rest.
        Ideal::SecondDerivative => 2.0 * (0.5 * (u + 1) as f64 * omega).sin().powi(2),
    }
}

/// From the half response to all taps, in the units of the ideal.
fn expand(ideal: Ideal, half_response: &[f64], half: usize, sample_rate_hz: f64) -> Vec<f64> {
    let mut taps = vec![0.0; 2 * half + 1];
    match ideal {
        Ideal::LowPass => {
            // Unit gain at rest exactly, so that a constant force stays what it was.
            let sum: f64 = half_response.iter().sum();
            taps[half] = half_response[0] / sum;
            for m in 1..=half {
                let tap = 0.5 * half_response[m] / sum;
                taps[half - m] = tap;
                taps[half + m] = tap;
            }
        }
        Ideal::FirstDerivative => {
            for m in 1..=half {
                let tap = 0.5 * half_response[m - 1] * sample_rate_hz;
                taps[half - m] = tap;
                taps[half + m] = -tap;
            }
        }
        Ideal::SecondDerivative => {
            for m in 1..=half {
                let tap = -0.5 * half_response[m - 1] * sample_rate_hz * sample_rate_hz;
                // 1 − cos stands for −½x[n−m] + x[n] − ½x[n+m], and ω² for minus the second
                // derivative.
                taps[half - m] = -tap;
                taps[half + m] = -tap;
                taps[half] += 2.0 * tap;
            }
        }
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDEALS: [Ideal; 3] = [
        Ideal::LowPass,
        Ideal::FirstDerivative,
        Ideal::SecondDerivative,
    ];

    /// Gain of `taps` at `frequency_hz` divided by the ideal gain there (1, ω or −ω²); 1 means a
    /// perfect filter.
    ///
    /// `frequency_hz` must be above 0 for the derivatives.
    fn relative_gain(ideal: Ideal, taps: &[f64], sample_rate_hz: f64, frequency_hz: f64) -> f64 {
        let half = taps.len() / 2;
        let omega = 2.0 * PI * frequency_hz / sample_rate_hz;
        let rate = 2.0 * PI * frequency_hz;
        let newer = |m: usize| taps[half - m];
        match ideal {
            Ideal::LowPass => {
                taps[half]
                    + (1..=half)
                        .map(|m| 2.0 * newer(m) * (m as f64 * omega).cos())
                        .sum::<f64>()
            }
            Ideal::FirstDerivative => {
                (1..=half)
                    .map(|m| 2.0 * newer(m) * (m as f64 * omega).sin())
                    .sum::<f64>()
                    / rate
            }
            Ideal::SecondDerivative => {
                let rest: f64 = taps.iter().sum();
                let moving: f64 = (1..=half)
                    .map(|m| 4.0 * newer(m) * (0.5 * m as f64 * omega).sin().powi(2))
                    .sum();
                (moving - rest) / (rate * rate)
            }
        }
    }

    /// Largest relative error in the pass band and largest gain in the stop band, relative to the
    /// gain at the pass edge.
    fn errors(ideal: Ideal, taps: &[f64], rate: f64, pass: f64, stop: f64) -> (f64, f64) {
        let order = match ideal {
            Ideal::LowPass => 0,
            Ideal::FirstDerivative => 1,
            Ideal::SecondDerivative => 2,
        };
        let (mut in_pass, mut in_stop) = (0.0_f64, 0.0_f64);
        for i in 1..=4000 {
            let f = 0.5 * rate * i as f64 / 4000.0;
            let gain = relative_gain(ideal, taps, rate, f);
            if f <= pass {
                in_pass = in_pass.max((gain - 1.0).abs());
            } else if f >= stop {
                in_stop = in_stop.max(gain.abs() * (f / pass).powi(order));
            }
        }
        (in_pass, in_stop)
    }

    #[test]
    fn pass_band_is_flat_and_stop_band_is_shut() {
        for (rate, pass, taps) in [
            (2000.0, 350.0, 129),
            (2000.0, 120.0, 65),
            (1000.0, 20.0, 129),
            (1000.0, 60.0, 129),
            (1000.0, 80.0, 97),
            (610.35, 200.0, 129),
            (50e3, 5e3, 77),
        ] {
            let stop = pass + transition_for(taps, rate);
            for ideal in IDEALS {
                if ideal != Ideal::LowPass && pass < NARROWEST_DERIVATIVE * rate {
                    continue;
                }
                let filter = design(ideal, rate, pass, stop, taps);
                let (in_pass, in_stop) = errors(ideal, &filter, rate, pass, stop);
                println!(
                    "{ideal:?} {rate} Hz, {taps} taps, pass {pass} Hz, stop {stop:.1} Hz: {in_pass:.1e}, {:.0} dB",
                    20.0 * in_stop.log10()
                );
                assert!(in_pass < 1e-4, "{in_pass}");
                assert!(in_stop < 1e-4, "{in_stop}");
            }
        }
    }

    #[test]
    fn the_two_length_rules_are_inverse() {
        for taps in [9, 33, 65, 129] {
            assert_eq!(
                taps_for(transition_for(taps, 2000.0) * 1.0000001, 2000.0),
                taps
            );
        }
    }
}
