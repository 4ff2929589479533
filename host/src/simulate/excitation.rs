//! What drives a motion, known at the samples of a record: a broadband random drive, or a logged
//! channel.

use crate::study::series::mean_square;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use realfft::RealFftPlanner;
use std::f64::consts::TAU;

/// A quantity given at the samples of a record and smooth between them.
pub struct Excitation {
    samples: Vec<f64>,
    sample_rate_hz: f64,
}

impl Excitation {
    /// A logged channel, sample 0 at time 0.
    pub fn logged(samples: Vec<f64>, sample_rate_hz: f64) -> Self {
        Self {
            samples,
            sample_rate_hz,
        }
    }

    /// Equal amplitudes and random phases on every line k/T within `band_hz`, scaled to `rms`; it
    /// rises from zero over the first `ramp_s`, so that the record can begin at rest.
    pub(super) fn broadband(
        rows: usize,
        sample_rate_hz: f64,
        band_hz: [f64; 2],
        rms: f64,
        ramp_s: f64,
        seed: u64,
    ) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(rows);
        let mut lines = inverse.make_input_vec();
        let mut samples = inverse.make_output_vec();
        let spacing_hz = sample_rate_hz / rows as f64;
        let nyquist = lines.len() - 1;
        for (k, line) in lines.iter_mut().enumerate().take(nyquist).skip(1) {
            let frequency_hz = k as f64 * spacing_hz;
            if (band_hz[0]..=band_hz[1]).contains(&frequency_hz) {
                let phase: f64 = TAU * rng.random::<f64>();
                line.re = phase.cos();
                line.im = phase.sin();
            }
        }
        inverse
            .process(&mut lines, &mut samples)
            .expect("buffers come from the plan, and the lines at 0 and Nyquist are zero");
        let power = mean_square(&samples);
        let scale = if power > 0.0 { rms / power.sqrt() } else { 0.0 };
        for (row, sample) in samples.iter_mut().enumerate() {
            let rise = (row as f64 / (ramp_s * sample_rate_hz)).min(1.0);
            *sample *= scale * 0.5 * (1.0 - (0.5 * TAU * rise).cos());
        }
        Self {
            samples,
            sample_rate_hz,
        }
    }

    /// The value at a time: a cubic through the four samples around it, the ends repeated.
    pub fn at(&self, time_s: f64) -> f64 {
        let position = time_s * self.sample_rate_hz;
        let row = position.floor().max(0.0);
        let u = position - row;
        let last = self.samples.len() - 1;
        let row = row as usize;
        let [before, here, next, after] =
            [row.saturating_sub(1), row, row + 1, row + 2].map(|i| self.samples[i.min(last)]);
        let slope_here = 0.5 * (next - before);
        let slope_next = 0.5 * (after - here);
        let rise = next - here;
        here + u
            * (slope_here
                + u * (3.0 * rise - 2.0 * slope_here - slope_next
                    + u * (slope_here + slope_next - 2.0 * rise)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use realfft::RealFftPlanner;

    #[test]
    fn power_lies_in_the_band_and_has_the_stated_size() {
        let drive = Excitation::broadband(8000, 2000.0, [2.0, 60.0], 3.0, 1e-9, 7);
        let power = drive.samples.iter().map(|f| f * f).sum::<f64>() / 8000.0;
        assert!((power.sqrt() - 3.0).abs() < 0.01, "rms {}", power.sqrt());
        let forward = RealFftPlanner::<f64>::new().plan_fft_forward(8000);
        let mut time = drive.samples.clone();
        let mut lines = forward.make_output_vec();
        forward.process(&mut time, &mut lines).unwrap();
        let outside: f64 = lines
            .iter()
            .enumerate()
            .filter(|(k, _)| !(8..=240).contains(k))
            .map(|(_, line)| line.norm_sqr())
            .sum();
        let all: f64 = lines.iter().map(|line| line.norm_sqr()).sum();
        assert!(outside / all < 1e-3);
    }

    #[test]
    fn between_samples_it_follows_a_sine() {
        let frequency = TAU * 40.0;
        let drive = Excitation {
            samples: (0..200)
                .map(|i| (frequency * i as f64 / 2000.0).sin())
                .collect(),
            sample_rate_hz: 2000.0,
        };
        for i in 100..900 {
            let time = f64::from(i) * 1e-4;
            assert!((drive.at(time) - (frequency * time).sin()).abs() < 3e-4);
        }
    }
}
