//! Which band a study's logs support: the common band of fits, and the wider band of the states.
//!
//! Both are read from spectra over all records. The noise floor of a displacement is its median
//! between 0.40 and 0.48 of the sample rate, where encoder counts speak and joints do not; that of
//! a restoring force is its median between 0.10 and 0.36, because drives put single lines higher
//! up; where the acceleration is derived, that of the applied force.
//!
//! - **State band**: where the displacement's density falls to twice its floor, signal and noise
//!   are equal; a velocity cut there has the least mean square error. The most limited axis
//!   decides, and rounding of sharp contact corners below that frequency would cost more than the
//!   noise, so it is not made narrower. Where the velocity alone was logged, noise is white in it,
//!   and it stands for the displacement here and below.
//! - **Common band**: of the restoring force's power below the state band, taking only frequencies
//!   at which it stands ten times above its floor, 99.9 % lies below it. What is above adds noise
//!   to every error figure and hardly any joint. An acceleration that is derived brings the
//!   position's noise with it, (2πf)⁴ of its floor, or the velocity's, (2πf)². Three nines, because
//!   contact is in the tail: with two, the corners of a clearance are gone. Lines count wherever
//!   they are, so a stepped sine keeps its harmonics. Short records of slow motion would be left
//!   with too few independent rows to try an effect; theirs is widened to five nines, as far as
//!   they need it. Where the displacement is an acceleration integrated above some frequency, what
//!   the force does below that cannot be compared with any motion, so it does not count.

use super::design::NARROWEST_DERIVATIVE;
use super::spectrum::{Accumulator, DISPLACEMENT_FLOOR, SEGMENT, Spectrum, floor_of};
use crate::signal::motion::Motion;
use crate::study::series::mean;
use crate::study::survey::smallest_step;
use crate::study::{Channels, Role, Study};
use nalgebra::{Matrix4, Vector4};

/// Where a restoring force's noise floor is read.
const FORCE_FLOOR: [f64; 2] = [0.10, WIDEST];
/// Density over floor at which signal and noise are equal.
const EQUAL: f64 = 2.0;
/// Density over floor down to which a restoring force is compared with a model.
const STANDS_OUT: f64 = 10.0;
/// Share of the power that stands out of a restoring force's floor that the common band keeps.
const KEPT: f64 = 0.999;
/// The same where the band would leave fewer than [`WANTED_ROWS`].
const NEARLY_ALL: f64 = 0.99999;
/// Independent rows of training, two for each period of the band's end: five for each of two dozen
/// values, as many as three effects and their shapes have beside a base.
const WANTED_ROWS: f64 = 128.0;
/// Lines that are averaged before a density is compared with its floor, an odd number.
const SMOOTHED: usize = 9;
/// The states' band is at most this share of the sample rate: the differentiators need room to fall
/// to zero.
pub const WIDEST: f64 = 0.36;

/// Pass band of the differentiators in Hz, before the common band asks for more: where the
/// displacement of the most limited axis drowns in its noise, between 0.06 and 0.36 of the sample
/// rate.
pub fn state_band_hz(study: &Study) -> f64 {
    let noise_limited = (0..study.axes.len())
        .map(|axis| {
            let spectrum = spectrum_of(study, axis, |channels| logged(study, axis, channels));
            noise_limit_hz(&spectrum, EQUAL * floor_of(&spectrum, DISPLACEMENT_FLOOR))
        })
        .fold(f64::INFINITY, f64::min);
    let rate = study.sample_rate_hz;
    noise_limited.clamp(NARROWEST_DERIVATIVE * rate, WIDEST * rate)
}

/// The common band in Hz: the widest that an axis's restoring force asks for, at most half of the
/// widest state band (a study may state a wider one).
///
/// Where the inertia is not known yet, the one that explains the force best together with the
/// states stands in for it.
pub fn common_band_hz(study: &Study, motions: &[Motion], state_band_hz: f64) -> f64 {
    let shortest = motions.iter().map(Motion::rows).min().unwrap_or(0);
    let rate = study.sample_rate_hz;
    let training: usize = motions
        .iter()
        .filter(|m| study.records[m.record].role == Role::Train)
        .map(Motion::rows)
        .sum();
    let enough_hz = 0.5 * rate * WANTED_ROWS / training.max(1) as f64;
    let edge = study
        .axes
        .iter()
        .enumerate()
        .map(|(index, axis)| {
            let inertia = axis
                .inertia
                .unwrap_or_else(|| likely_inertia(study, motions, index));
            let with_inertia = |inertia: f64| {
                let mut sum = Accumulator::new(rate, SEGMENT.min(shortest));
                for motion in motions {
                    sum.add(&motion.restoring_force(index, inertia, axis.restoring_force));
                }
                sum.finish()
            };
            let spectrum = with_inertia(inertia);
            let (floor, derivatives) = match inertia {
                0.0 => (0.0, 0),
                _ => derived_floor(study, index),
            };
            let of_motion = inertia * inertia * floor;
            // A derived acceleration has no floor, but a slope, which stands for it below.
            let of_force = match of_motion {
                0.0 => floor_of(&spectrum, FORCE_FLOOR),
                _ => floor_of(&with_inertia(0.0), FORCE_FLOOR),
            };
            let known_hz = axis.integrated_above_hz.unwrap_or(0.0);
            let level = |hz: f64| {
                if hz < known_hz {
                    return f64::INFINITY;
                }
                let derived = of_motion * (std::f64::consts::TAU * hz).powi(2 * derivatives);
                STANDS_OUT * of_force.max(derived)
            };
            let edge = power_edge(&spectrum, level, state_band_hz, KEPT);
            let clear = power_edge(&spectrum, level, state_band_hz, NEARLY_ALL);
            match edge > 0.0 {
                true => edge.max(clear.min(enough_hz)),
                // Nothing stands out: no band is better than another, but some have too few rows,
                // or none of the motion.
                false if known_hz > 0.0 => state_band_hz,
                false => enough_hz,
            }
        })
        .fold(0.0, f64::max);
    edge.clamp(1e-3 * rate, 0.5 * WIDEST * rate)
}

/// What was logged of an axis's relative motion: the displacement, else the velocity.
fn logged(study: &Study, axis: usize, channels: &Channels) -> Vec<f64> {
    match (study.axes[axis].velocity_alone, &channels.velocity) {
        (true, Some(velocity)) => velocity.clone(),
        _ => channels.relative_displacement(),
    }
}

/// Noise floor of the position or velocity of which an axis's acceleration is derived, and how
/// often it is differentiated; 0 where the acceleration is measured.
fn derived_floor(study: &Study, axis: usize) -> (f64, i32) {
    let channels = || study.records.iter().map(|record| &record.axes[axis]);
    if channels().any(|channels| channels.acceleration.is_some()) {
        return (0.0, 0);
    }
    let of_velocity =
        study.axes[axis].velocity_alone && channels().all(|c| c.body_position.is_none());
    let position = |channels: &Channels| match &channels.body_position {
        Some(position) => position.clone(),
        None => logged(study, axis, channels),
    };
    let floor = floor_of(&spectrum_of(study, axis, position), DISPLACEMENT_FLOOR);
    let rounding = channels().map(|channels| rounding(&position(channels), study.sample_rate_hz));
    let floor = rounding.fold(floor, f64::max);
    (floor, if of_velocity { 1 } else { 2 })
}

/// Density of the rounding of a channel that counts in steps, unit² per Hz: a twelfth of a step
/// squared, up to half of the rate at which the count changes. A channel that moves by less than a
/// step a row has more of it at low frequencies than its floor at high ones shows.
fn rounding(series: &[f64], rate_hz: f64) -> f64 {
    let changes = series.windows(2).filter(|w| w[0] != w[1]).count();
    let changes_hz = changes as f64 / series.len().max(1) as f64 * rate_hz;
    match smallest_step(series) {
        Some(step) if changes > 0 => step * step / 12.0 / (0.5 * changes_hz),
        _ => 0.0,
    }
}

/// The spectrum over all records of what an axis's channels give.
fn spectrum_of(study: &Study, axis: usize, series: impl Fn(&Channels) -> Vec<f64>) -> Spectrum {
    let shortest = study.records.iter().map(|r| r.rows).min().unwrap_or(0);
    let mut sum = Accumulator::new(study.sample_rate_hz, SEGMENT.min(shortest));
    for record in &study.records {
        sum.add(&series(&record.axes[axis]));
    }
    sum.finish()
}

/// Least squares of the force over acceleration, velocity, displacement and a constant; good enough
/// for a spectrum.
fn likely_inertia(study: &Study, motions: &[Motion], axis: usize) -> f64 {
    let mut square = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for motion in motions
        .iter()
        .filter(|m| study.records[m.record].role == Role::Train)
    {
        for row in 0..motion.rows() {
            let inputs = Vector4::new(
                motion.acceleration[axis][row],
                motion.states[2 * axis + 1][row],
                motion.states[2 * axis][row],
                1.0,
            );
            square += inputs * inputs.transpose();
            right += inputs * motion.force[axis][row];
        }
    }
    // Metres and metres per second² differ by powers of ten: scaled to a unit diagonal, the solve
    // keeps its digits.
    let scale = square
        .diagonal()
        .map(|d| if d > 0.0 { d.sqrt() } else { 1.0 });
    let scaled = Matrix4::from_fn(|i, j| square[(i, j)] / (scale[i] * scale[j]));
    scaled.cholesky().map_or(0.0, |c| {
        (c.solve(&right.component_div(&scale))[0] / scale[0]).max(0.0)
    })
}

/// The frequency below which the share `kept` of the power lies that stands above the `level`
/// there, up to `limit_hz`; 0 when none does.
fn power_edge(spectrum: &Spectrum, level: impl Fn(f64) -> f64, limit_hz: f64, kept: f64) -> f64 {
    let lines: Vec<f64> = smoothed(spectrum)
        .zip(&spectrum.density)
        .enumerate()
        .take_while(|(i, _)| *i as f64 * spectrum.resolution_hz <= limit_hz)
        .map(|(i, (mean, density))| {
            let stands_out = mean > level(i as f64 * spectrum.resolution_hz);
            if stands_out { *density } else { 0.0 }
        })
        .collect();
    let total: f64 = lines.iter().sum();
    let mut sum = 0.0;
    for (i, density) in lines.iter().enumerate() {
        sum += density;
        if sum >= kept * total {
            return i as f64 * spectrum.resolution_hz;
        }
    }
    0.0
}

/// The first frequency past the strongest line at which the smoothed density has fallen to `level`.
fn noise_limit_hz(spectrum: &Spectrum, level: f64) -> f64 {
    let means: Vec<f64> = smoothed(spectrum).collect();
    let strongest = (0..means.len())
        .max_by(|a, b| means[*a].total_cmp(&means[*b]))
        .unwrap_or(0);
    let end = (strongest..means.len()).find(|i| means[*i] <= level);
    end.unwrap_or(means.len()) as f64 * spectrum.resolution_hz
}

/// Each line's mean with its neighbours, [`SMOOTHED`] lines in all where there are so many.
fn smoothed(spectrum: &Spectrum) -> impl Iterator<Item = f64> {
    let lines = spectrum.density.len();
    (0..lines).map(move |i| {
        let near =
            &spectrum.density[i.saturating_sub(SMOOTHED / 2)..(i + SMOOTHED / 2 + 1).min(lines)];
        mean(near)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A density that falls as 1/f⁴ from 10 Hz on, over a floor of 1.
    fn falling(top: f64) -> Spectrum {
        let density = (0..=2048)
            .map(|i| 1.0 + top / (1.0 + (f64::from(i) * 0.5 / 10.0).powi(4)))
            .collect();
        Spectrum {
            resolution_hz: 0.5,
            density,
        }
    }

    #[test]
    fn displacement_is_noise_limited_where_signal_and_noise_are_equal() {
        // 1e6/(1 + (f/10)⁴) = 1 at 316 Hz.
        let edge = noise_limit_hz(&falling(1e6), EQUAL);
        assert!((edge - 316.0).abs() < 5.0, "{edge}");
    }

    #[test]
    fn the_common_band_does_not_depend_on_the_noise() {
        // ∫ of 1/(1 + u⁴) from U to ∞ is 1/(3U³), a thousandth of π/(2√2) at U = 6.70.
        for top in [1e5, 1e7] {
            let edge = power_edge(&falling(top), |_| STANDS_OUT, 1024.0, KEPT);
            assert!((edge - 67.0).abs() < 7.0, "{edge}");
        }
    }

    #[test]
    fn a_harmonic_beyond_a_silence_counts_and_one_beyond_the_limit_does_not() {
        let mut spectrum = falling(0.0);
        spectrum.density[100] = 1e4;
        spectrum.density[300] = 1e3;
        spectrum.density[900] = 1e5;
        assert_eq!(power_edge(&spectrum, |_| STANDS_OUT, 400.0, KEPT), 150.0);
    }

    #[test]
    fn a_spectrum_without_lines_has_no_edge() {
        let empty = Spectrum {
            resolution_hz: 1.0,
            density: Vec::new(),
        };
        let floor = floor_of(&empty, FORCE_FLOOR);
        assert_eq!(floor, 0.0);
        assert_eq!(power_edge(&empty, |_| floor, 100.0, KEPT), 0.0);
        assert_eq!(noise_limit_hz(&empty, floor), 0.0);
    }
}
