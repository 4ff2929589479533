//! Power spectra by Welch's method: which frequencies a logged signal holds, and where its noise
//! floor lies.

use crate::study::series::mean;
use realfft::RealFftPlanner;
use std::f64::consts::PI;

/// A spectrum of no more lines does not tell a sine, which stands in five of them, from a band.
pub const MIN_LINES: usize = 20;

/// Rows per window of the spectra; a record shorter than this sets the length.
pub(super) const SEGMENT: usize = 4096;
/// Where a displacement's noise floor is read, as shares of the sample rate; an anti-aliasing
/// filter takes down what is above.
pub(crate) const DISPLACEMENT_FLOOR: [f64; 2] = [0.40, 0.48];

/// A one-sided power spectral density.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// Distance of two lines, Hz; line `i` stands at `i · resolution_hz`.
    pub resolution_hz: f64,
    /// Unit² per Hz of each line, from 0 to half the sample rate.
    pub density: Vec<f64>,
}

impl Spectrum {
    /// Welch's estimate: Hann windows of `segment` rows overlapping by half, each with its mean
    /// removed, averaged.
    ///
    /// The densities times `resolution_hz` sum to the variance. `segment` is made even and no
    /// longer than the series; the series needs at least 8 rows, else the spectrum has no line.
    pub fn welch(series: &[f64], sample_rate_hz: f64, segment: usize) -> Self {
        let mut spectrum = Accumulator::new(sample_rate_hz, segment.min(series.len()));
        spectrum.add(series);
        spectrum.finish()
    }

    /// Power in unit² between two frequencies (inclusive lines).
    pub fn power(&self, from_hz: f64, to_hz: f64) -> f64 {
        self.density
            .iter()
            .enumerate()
            .filter(|(i, _)| (from_hz..=to_hz).contains(&(*i as f64 * self.resolution_hz)))
            .map(|(_, d)| d * self.resolution_hz)
            .sum()
    }

    /// The strongest line: its frequency, Hz, and its part of the whole power, 0 to 1. A sine
    /// stands in five lines of a Hann window; `None` where there are no more than
    /// [`MIN_LINES`].
    pub fn strongest(&self) -> Option<(f64, f64)> {
        let lines = self.density.len();
        if lines <= MIN_LINES {
            return None;
        }
        let of = |from: usize, to: usize| -> f64 { self.density[from..to].iter().sum() };
        let strongest = (1..lines).max_by(|a, b| self.density[*a].total_cmp(&self.density[*b]))?;
        let (from, to) = (strongest.saturating_sub(2), (strongest + 3).min(lines));
        let (own, whole) = (of(from, to), of(0, lines));
        let moment = (from..to).map(|i| i as f64 * self.density[i]);
        (own > 0.0).then(|| (self.resolution_hz * moment.sum::<f64>() / own, own / whole))
    }
}

/// Rows of a window that is to have `wanted` of them: fewer where less than half of all rows stand
/// in series that are as long. A short series between long ones takes no resolution from them; it
/// has no part in the spectrum.
pub fn window_for(lengths: impl Iterator<Item = usize>, wanted: usize) -> usize {
    let mut lengths: Vec<usize> = lengths.collect();
    lengths.sort_unstable_by(|a, b| b.cmp(a));
    let whole: usize = lengths.iter().sum();
    let mut rows = 0;
    let long = lengths.into_iter().find(|length| {
        rows += length;
        2 * rows >= whole
    });
    wanted.min(long.unwrap_or(0))
}

/// Averages the windows of several records into one spectrum.
#[derive(Clone, Debug)]
pub struct Accumulator {
    sample_rate_hz: f64,
    window: Vec<f64>,
    sum: Vec<f64>,
    windows: usize,
}

impl Accumulator {
    /// Windows of `segment` rows, made even.
    pub fn new(sample_rate_hz: f64, segment: usize) -> Self {
        let segment = segment / 2 * 2;
        let window: Vec<f64> = (0..segment)
            .map(|i| 0.5 - 0.5 * (2.0 * PI * i as f64 / segment as f64).cos())
            .collect();
        Self {
            sample_rate_hz,
            sum: vec![0.0; if segment >= 8 { segment / 2 + 1 } else { 0 }],
            window,
            windows: 0,
        }
    }

    /// Adds windows that overlap by half, and a last one that ends with the series.
    pub fn add(&mut self, series: &[f64]) {
        let segment = self.window.len();
        if segment < 8 {
            return;
        }
        let transform = RealFftPlanner::new().plan_fft_forward(segment);
        let mut input = transform.make_input_vec();
        let mut output = transform.make_output_vec();
        let Some(last) = series.len().checked_sub(segment) else {
            return;
        };
        let starts = (0..last).step_by(segment / 2).chain([last]);
        for start in starts {
            let part = &series[start..start + segment];
            let mean = mean(part);
            for ((x, &value), weight) in input.iter_mut().zip(part).zip(&self.window) {
                *x = (value - mean) * weight;
            }
            transform
                .process(&mut input, &mut output)
                .expect("both buffers were made by this transform");
            for (sum, line) in self.sum.iter_mut().zip(&output) {
                *sum += line.norm_sqr();
            }
            self.windows += 1;
        }
    }

    /// The mean over all windows; all zero when there was none.
    pub fn finish(self) -> Spectrum {
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        let last = self.sum.len().saturating_sub(1);
        let scale = 1.0 / (energy * self.sample_rate_hz * self.windows.max(1) as f64);
        Spectrum {
            resolution_hz: self.sample_rate_hz / self.window.len().max(1) as f64,
            density: self
                .sum
                .iter()
                .enumerate()
                .map(|(i, s)| s * scale * if i == 0 || i == last { 1.0 } else { 2.0 })
                .collect(),
        }
    }
}

/// Median density between two shares of the sample rate, where only noise is expected.
pub(super) fn floor_of(spectrum: &Spectrum, [from, to]: [f64; 2]) -> f64 {
    let lines = 2.0 * spectrum.density.len().saturating_sub(1) as f64;
    let range = (from * lines) as usize..(to * lines) as usize;
    let mut densities = spectrum.density.get(range).unwrap_or_default().to_vec();
    densities.sort_by(f64::total_cmp);
    densities.get(densities.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_short_series_between_long_ones_takes_no_resolution_from_them() {
        let of = |lengths: &[usize]| window_for(lengths.iter().copied(), 1000);
        assert_eq!(of(&[5000, 4000, 12]), 1000);
        assert_eq!(of(&[400, 300, 300]), 300);
        assert_eq!(of(&[800, 700, 600, 12]), 700);
        assert_eq!(of(&[12]), 12);
        assert_eq!(of(&[]), 0);
    }

    #[test]
    fn power_of_a_sine_is_half_its_amplitude_squared_and_lies_at_its_frequency() {
        let series: Vec<f64> = (0..20_000)
            .map(|i| 4.0 + 3.0 * (2.0 * PI * 50.0 * i as f64 / 1000.0).sin())
            .collect();
        let spectrum = Spectrum::welch(&series, 1000.0, 1000);
        assert!((spectrum.power(48.0, 52.0) - 4.5).abs() < 1e-9);
        assert!(spectrum.power(60.0, 500.0) < 1e-9);
        let (hz, share) = spectrum.strongest().unwrap();
        assert!(
            (hz - 50.0).abs() < 1e-6 && share > 0.999,
            "{hz} Hz, {share}"
        );
        assert_eq!(Spectrum::welch(&series, 1000.0, 38).strongest(), None);
    }

    #[test]
    fn white_noise_is_flat_and_sums_to_its_variance() {
        let seed = 7;
        println!("seed {seed}");
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let series: Vec<f64> = (0..200_000)
            .map(|_| random.random_range(-0.5..0.5))
            .collect();
        let spectrum = Spectrum::welch(&series, 2000.0, 512);
        let total = spectrum.power(0.0, 1000.0);
        assert!((total * 12.0 - 1.0).abs() < 0.02, "{total}");
        let low = spectrum.power(100.0, 200.0);
        let high = spectrum.power(800.0, 900.0);
        assert!((low / high - 1.0).abs() < 0.1, "{low} {high}");
    }

    #[test]
    fn a_few_rows_have_no_spectrum() {
        assert!(Spectrum::welch(&[1.0; 5], 100.0, 64).density.is_empty());
    }
}
