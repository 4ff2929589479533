//! The acceleration of a body as two instruments know it: its encoder at low frequencies, its
//! accelerometer at high ones.
//!
//! White noise of density `A` on the accelerometer and `P` on the position, which differentiation
//! makes `P·ω⁴`, are equal at the crossover `ω_c = (A/P)^¼`. Weighting each instrument with the
//! inverse of its variance gives the encoder `1/(1 + (ω/ω_c)⁴)` and the accelerometer the rest: a
//! Butterworth low-pass of second order run forwards and backwards. An accelerometer's noise that
//! grows with one over the frequency lies where the encoder is listened to.

use super::fir::apply;
use super::spectrum::Accumulator;
use super::spectrum::DISPLACEMENT_FLOOR;
use crate::signal::motion::{Filters, Motion};
use crate::study::Study;
use crate::study::series::dot;
use std::f64::consts::{PI, SQRT_2, TAU};

/// Rows per window of the spectra.
const SEGMENT: usize = 2048;
/// Lines that are averaged before the quietest place is taken.
const SMOOTHED: usize = 16;
/// A crossover below this leaves the accelerometer alone, Hz.
const LOWEST_HZ: f64 = 4.0;
/// The highest crossover, as a share of the sample rate; above it the encoder is all that is
/// listened to.
const HIGHEST: f64 = 0.4;

/// Replaces the logged accelerations of motions by the mix with what the body's encoder says, on
/// every axis whose records all have both.
///
/// The encoder's part is scaled to the accelerometer's gain, so that the mix has one gain at all
/// frequencies. `study` is the one that the motions were made of. Returns the crossover per axis,
/// Hz; none where the logged acceleration stays as it is.
pub(crate) fn mix(study: &Study, filters: &Filters, motions: &mut [Motion]) -> Vec<Option<f64>> {
    (0..study.axes.len())
        .map(|axis| mix_axis(study, filters, motions, axis))
        .collect()
}

fn mix_axis(study: &Study, filters: &Filters, motions: &mut [Motion], axis: usize) -> Option<f64> {
    let rate = study.sample_rate_hz;
    let mut derived = Vec::with_capacity(motions.len());
    for motion in motions.iter() {
        let channels = &study.records[motion.record].axes[axis];
        channels.acceleration.as_ref()?;
        derived.push(apply(
            channels.body_position.as_ref()?,
            &filters.acceleration,
        ));
    }
    let positions = motions.iter().filter_map(|m| {
        let channels = &study.records[m.record].axes[axis];
        channels.body_position.as_deref()
    });
    let logged = motions.iter().map(|m| m.acceleration[axis].as_slice());
    let beyond = DISPLACEMENT_FLOOR.map(|share| share * rate);
    let noise = quietest(positions, rate, beyond)?;
    let above = quietest(logged.clone(), rate, beyond)?;
    // What the two differ by below holds both noises and no motion; the accelerometer cannot be
    // noisier than that.
    let differences: Vec<Vec<f64>> = logged
        .zip(&derived)
        .map(|(a, d)| a.iter().zip(d).map(|(a, d)| a - d).collect())
        .collect();
    let within = quietest(
        differences.iter().map(Vec::as_slice),
        rate,
        [0.0, filters.state_band_hz],
    )?;
    let crossover =
        ((above.min(within) / noise.max(f64::MIN_POSITIVE)).powf(0.25) / TAU).min(HIGHEST * rate);
    if crossover < LOWEST_HZ {
        return None;
    }
    let low_pass = ForwardsAndBackwards::new(crossover, rate);
    let (mut both, mut encoder) = (0.0, 0.0);
    let mut parts = Vec::with_capacity(motions.len());
    for (motion, mut derived) in motions.iter().zip(derived) {
        let mut logged = motion.acceleration[axis].clone();
        low_pass.run(&mut logged);
        low_pass.run(&mut derived);
        both += dot(&logged, &derived);
        encoder += dot(&derived, &derived);
        parts.push((logged, derived));
    }
    let gain = if encoder > 0.0 { both / encoder } else { 1.0 };
    for (motion, (logged, derived)) in motions.iter_mut().zip(parts) {
        let low = logged.iter().zip(&derived);
        for (a, (l, d)) in motion.acceleration[axis].iter_mut().zip(low) {
            *a += gain * d - l;
        }
    }
    Some(crossover)
}

/// The least density between two frequencies, unit²/Hz, over all series; none without a window or a
/// line.
fn quietest<'a>(
    series: impl Iterator<Item = &'a [f64]> + Clone,
    rate: f64,
    [from_hz, to_hz]: [f64; 2],
) -> Option<f64> {
    let shortest = series.clone().map(<[f64]>::len).min()?;
    let mut sum = Accumulator::new(rate, SEGMENT.min(shortest));
    series.for_each(|s| sum.add(s));
    let spectrum = sum.finish();
    // Lines 0 and 1 hold what is left of a mean under the window.
    let lines = spectrum.density.iter().enumerate().skip(2);
    let lines: Vec<f64> = lines
        .filter(|(line, _)| (from_hz..=to_hz).contains(&(*line as f64 * spectrum.resolution_hz)))
        .map(|(_, density)| *density)
        .collect();
    let pieces = lines.chunks(SMOOTHED).filter(|p| p.len() == SMOOTHED);
    pieces
        .map(|piece| piece.iter().sum::<f64>() / SMOOTHED as f64)
        .reduce(f64::min)
}

/// A Butterworth low-pass of second order, run forwards and backwards: no phase, gain `1/(1 +
/// (f/f_c)⁴)`.
struct ForwardsAndBackwards {
    gain: f64,
    back: [f64; 2],
}

impl ForwardsAndBackwards {
    fn new(crossover_hz: f64, rate: f64) -> Self {
        let k = (PI * crossover_hz / rate).tan();
        let norm = 1.0 / (1.0 + SQRT_2 * k + k * k);
        Self {
            gain: k * k * norm,
            back: [
                2.0 * (k * k - 1.0) * norm,
                (1.0 - SQRT_2 * k + k * k) * norm,
            ],
        }
    }

    fn run(&self, series: &mut [f64]) {
        self.once(series.iter_mut());
        self.once(series.iter_mut().rev());
    }

    /// Begins as if the first value had always been there.
    fn once<'a>(&self, series: impl Iterator<Item = &'a mut f64>) {
        let mut past: Option<[f64; 4]> = None;
        for value in series {
            let [x1, x2, y1, y2] = past.unwrap_or([*value; 4]);
            let x = *value;
            let y = self.gain * (x + 2.0 * x1 + x2) - self.back[0] * y1 - self.back[1] * y2;
            past = Some([x, x1, y, y1]);
            *value = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::motion::motions;
    use crate::simulate::{Simulation, SimulationOptions, simulate};

    const RATE: f64 = 2000.0;

    /// A tone behind the low-pass, as a part of what it was.
    fn passed(crossover_hz: f64, hz: f64) -> f64 {
        let tone = |row: usize| (TAU * hz * row as f64 / RATE).sin();
        let mut series: Vec<f64> = (0..20_000).map(tone).collect();
        ForwardsAndBackwards::new(crossover_hz, RATE).run(&mut series);
        let middle = 8_000..12_000;
        let both: f64 = middle.clone().map(|row| series[row] * tone(row)).sum();
        both / middle.map(|row| tone(row) * tone(row)).sum::<f64>()
    }

    #[test]
    fn the_encoder_has_the_weight_of_its_variance() {
        for (crossover, hz) in [(50.0, 10.0), (50.0, 50.0), (50.0, 100.0), (20.0, 5.0)] {
            let warped = |f: f64| (PI * f / RATE).tan();
            let expected = 1.0 / (1.0 + (warped(hz) / warped(crossover)).powi(4));
            let seen = passed(crossover, hz);
            assert!((seen - expected).abs() < 2e-3, "{seen} {expected}");
        }
    }

    #[test]
    fn the_mix_is_nearer_to_the_truth_than_the_accelerometer() {
        for (snr_db, part) in [(30.0, 0.15), (50.0, 0.8)] {
            let options = SimulationOptions {
                seed: 7,
                snr_db: Some(snr_db),
                ..SimulationOptions::default()
            };
            let Simulation { study, truth, .. } = simulate(&options).unwrap();
            let filters = Filters::design(&study).unwrap();
            let logged = motions(&study, &filters).unwrap();
            let mut mixed = logged.clone();
            let crossovers = mix(&study, &filters, &mut mixed);
            for (axis, crossover) in crossovers.iter().enumerate() {
                let whole = truth[0].motion(0, study.sample_rate_hz);
                let error = |motion: &Motion| {
                    let rows = motion.acceleration[axis].iter();
                    let right = &whole.acceleration[axis][motion.first_row..];
                    let error: Vec<f64> = rows.zip(right).map(|(a, t)| a - t).collect();
                    let passed = apply(&error, &filters.band);
                    let square: f64 = passed.iter().map(|e| e * e).sum();
                    (square / passed.len() as f64).sqrt()
                };
                let (before, after) = (error(&logged[0]), error(&mixed[0]));
                println!(
                    "{snr_db} dB, axis {axis}: {before:.4} to {after:.4}, crossover {crossover:?} Hz"
                );
                assert!(after < part * before, "{after} of {before}");
            }
        }
    }

    #[test]
    fn what_has_no_second_instrument_stays_as_it_was_logged() {
        let mut study = simulate(&SimulationOptions::default()).unwrap().study;
        study.records[0].axes[0].body_position = None;
        let filters = Filters::design(&study).unwrap();
        let logged = motions(&study, &filters).unwrap();
        let mut mixed = logged.clone();
        assert_eq!(mix(&study, &filters, &mut mixed)[0], None);
        for (l, m) in logged.iter().zip(&mixed) {
            assert_eq!(l.acceleration[0], m.acceleration[0]);
        }
    }

    #[test]
    fn a_constant_stays_and_the_quietest_place_of_a_spectrum_is_found() {
        let mut constant = vec![3.0; 500];
        ForwardsAndBackwards::new(30.0, RATE).run(&mut constant);
        assert!(constant.iter().all(|v| (v - 3.0).abs() < 1e-9));
        // A tone in one place, nothing elsewhere.
        let tone: Vec<f64> = (0..8192)
            .map(|row| (TAU * 100.0 * row as f64 / RATE).sin())
            .collect();
        let series = || [tone.as_slice()].into_iter();
        assert!(quietest(series(), RATE, [400.0, 900.0]).is_some_and(|d| d < 1e-9));
        assert!(quietest(series(), RATE, [99.0, 101.0]).is_none());
    }
}
