//! Whether what no model explains is noise, or a force that nobody measures.
//!
//! Noise of sensors is white, or grows towards low frequencies, or both: its density nowhere rises
//! with the frequency, and falls ever less steeply. A force has frequencies of its own: its density
//! stands above what is below them, and ends where they end. And noise of sensors is as loud where
//! a joint moves as where it does not.

use crate::signal::spectrum::{Accumulator, Spectrum, window_for};
use crate::study::series::rms;

/// Length of the windows of the spectrum, s.
const WINDOW_S: f64 = 4.0;
/// Windows that a record has to have room for, beside each other; shorter ones do in a short
/// record.
const WINDOWS: usize = 3;
/// Octaves below the band's end that are looked at; the lowest begins at two hertz in a band of 128
/// Hz. Lower ones have too few lines.
const OCTAVES: usize = 6;
/// Fewer lines than this say nothing of an octave.
const MIN_LINES: usize = 4;
/// A density has risen where it is so many times that of a lower octave: those of single octaves
/// scatter.
const ABOVE: f64 = 1.6;
/// The part of the power that has to have risen.
const PART: f64 = 0.4;
/// How far a density may bend where no force ends: the square of that of an octave beside the
/// product of those of both neighbours. Sums of white noise and of noise that grows with powers of
/// one over the frequency do not bend down at all; a low-pass of first order does, by less than
/// this.
const BEND: f64 = 2.0;
/// Standard deviations that are left to chance.
const CHANCE: f64 = 3.0;
/// The part of the rows that is calm.
const CALM: f64 = 0.25;
/// What is left follows the motion where it has so many times the power in the other rows.
const LOUDER: f64 = 1.5;

/// The lines between half a frequency and it.
struct Octave {
    /// Median of the densities, in which a single line, of the mains, does not show.
    density: f64,
    /// Standard deviation of that, as a part of it.
    scatter: f64,
    /// Width of the octave, Hz.
    width: f64,
}

/// The spectrum of residuals.
pub(super) struct Shape {
    spectrum: Spectrum,
    /// Windows beside each other that it is the mean of.
    windows: f64,
    /// Where the band ends, Hz.
    band_hz: f64,
}

impl Shape {
    /// That of residuals as they are before the low-pass of a band up to `band_hz`.
    pub(super) fn of<'a>(
        residuals: impl Iterator<Item = &'a [f64]> + Clone,
        rate: f64,
        band_hz: f64,
    ) -> Self {
        let lengths = residuals.clone().map(|series| series.len() / WINDOWS);
        let segment = window_for(lengths, (WINDOW_S * rate) as usize);
        let mut sum = Accumulator::new(rate, segment);
        residuals.clone().for_each(|series| sum.add(series));
        let rows: usize = residuals.map(<[f64]>::len).sum();
        Self {
            spectrum: sum.finish(),
            windows: rows as f64 / segment.max(1) as f64,
            band_hz,
        }
    }

    /// The octave that ends so many octaves below a frequency; nothing when it holds too few lines.
    fn octave(&self, hz: f64, below: usize) -> Option<Octave> {
        let to_hz = hz / f64::from(1_u32 << below);
        // Lines 0 and 1 hold what is left of a mean under the window.
        let from = ((0.5 * to_hz / self.spectrum.resolution_hz).ceil() as usize).max(2);
        let to = (to_hz / self.spectrum.resolution_hz).floor() as usize + 1;
        let mut lines = self.spectrum.density.get(from..to)?.to_vec();
        if lines.len() < MIN_LINES {
            return None;
        }
        lines.sort_by(f64::total_cmp);
        // A Hann window makes neighbouring lines alike, so that two of three count; a median
        // scatters a quarter more than a mean.
        Some(Octave {
            density: lines[lines.len() / 2],
            scatter: 1.25 * (1.5 / (lines.len() as f64 * self.windows)).sqrt(),
            width: 0.5 * to_hz,
        })
    }

    /// Whether much of the power in the band is not noise, because its density rises: of residuals
    /// at rest.
    pub(super) fn rises(&self) -> bool {
        let (mut all, mut risen) = (0.0, 0.0);
        let mut least = f64::INFINITY;
        let octaves = (0..OCTAVES).rev();
        for octave in octaves.filter_map(|below| self.octave(self.band_hz, below)) {
            all += octave.density * octave.width;
            if least.is_finite() {
                risen += (octave.density - ABOVE * least).max(0.0) * octave.width;
            }
            least = least.min(octave.density);
        }
        risen > PART * all
    }

    /// Whether the density ends somewhere in the band or within an octave above it: falls there
    /// much more steeply than below.
    pub(super) fn ends(&self) -> bool {
        let octaves: Vec<Option<Octave>> = (0..=OCTAVES)
            .map(|below| self.octave(2.0 * self.band_hz, below))
            .collect();
        octaves.windows(3).any(|three| match three {
            [Some(above), Some(middle), Some(below)] => {
                let bend = middle.density.powi(2) / (above.density * below.density);
                let scatter = (2.0 * middle.scatter).hypot(above.scatter.hypot(below.scatter));
                bend > BEND * (1.0 + CHANCE * scatter)
            }
            _ => false,
        })
    }
}

/// RMS of residuals behind the low-pass of a band up to `band_hz` in the calm rows of a motion,
/// those of the least displacement and velocity, where the residuals follow the motion: are less
/// there than in the others by more than chance.
pub(super) fn calm(
    residual: &[f64],
    [displacement, velocity]: [&[f64]; 2],
    rate: f64,
    band_hz: f64,
) -> Option<f64> {
    let units = [displacement, velocity].map(|s| rms(s).powi(2).max(f64::MIN_POSITIVE));
    let states = displacement.iter().zip(velocity);
    let moves = states.map(|(x, v)| x * x / units[0] + v * v / units[1]);
    let mut rows: Vec<(f64, f64)> = moves.zip(residual.iter().map(|r| r * r)).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (calm, others) = rows.split_at((CALM * rows.len() as f64) as usize);
    let power = |rows: &[(f64, f64)]| {
        rows.iter().map(|(_, square)| square).sum::<f64>() / rows.len().max(1) as f64
    };
    // Rows in a band are as many as twice its width allows; a mean of n squares of a normal
    // distribution scatters by √(2/n).
    let independent = calm.len() as f64 * (2.0 * band_hz / rate).min(1.0);
    let scatter = CHANCE * (2.0 / independent.max(1.0)).sqrt();
    let calm = power(calm);
    (power(others) > LOUDER * (1.0 + scatter) * calm).then_some(calm.sqrt())
}

#[cfg(test)]
mod tests {
    use super::{Shape, calm};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    const RATE: f64 = 1000.0;

    /// White noise, the same summed up so that it grows towards low frequencies, and the same in a
    /// band about 20 Hz.
    fn series(rng: &mut StdRng) -> [Vec<f64>; 3] {
        let white: Vec<f64> = (0..20_000).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (mut level, mut slow) = (0.0, Vec::new());
        let (mut past, mut band) = ([0.0; 2], Vec::new());
        for (row, value) in white.iter().enumerate() {
            level = 0.995 * level + 0.07 * value;
            slow.push(level);
            let change = value - white[row.saturating_sub(2)];
            let next = 1.885 * past[0] - 0.9025 * past[1] + 0.3 * change;
            past = [next, past[0]];
            band.push(next);
        }
        [white, slow, band]
    }

    #[test]
    fn noise_is_no_force_and_a_force_is_no_noise() {
        for seed in 0..20 {
            let mut rng = StdRng::seed_from_u64(seed);
            let [white, slow, band] = series(&mut rng);
            let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
            let both: Vec<f64> = sum(&white, &slow);
            let pushed: Vec<f64> = sum(&white, &band);
            let shape = |series: &[f64]| Shape::of([series].into_iter(), RATE, 120.0);
            for noise in [&white, &slow, &both] {
                assert!(!shape(noise).ends(), "{seed}");
                assert!(!shape(noise).rises(), "{seed}");
            }
            assert!(shape(&pushed).rises(), "{seed}");
            assert!(shape(&pushed).ends(), "{seed}");
            assert!(!shape(&white[..100]).rises());
            assert!(!shape(&white[..100]).ends());
        }
    }

    #[test]
    fn a_stiffness_that_nobody_knows_is_louder_where_the_joint_moves() {
        for seed in 0..20 {
            let mut rng = StdRng::seed_from_u64(seed);
            let [white, slow, band] = series(&mut rng);
            let swings: Vec<f64> = band
                .iter()
                .enumerate()
                .map(|(row, x)| x * (0.003 * row as f64).sin())
                .collect();
            let speed: Vec<f64> = band.windows(2).map(|w| w[1] - w[0]).collect();
            let at_rest = |residual: &[f64], rows: usize| {
                calm(
                    &residual[..rows],
                    [&band[..rows], &speed[..rows]],
                    RATE,
                    120.0,
                )
            };
            let rows = speed.len();
            assert_eq!(
                at_rest(&white, rows).or(at_rest(&slow, rows)),
                None,
                "{seed}"
            );
            let noisy: Vec<f64> = swings
                .iter()
                .zip(&white)
                .map(|(s, w)| s + 0.2 * w)
                .collect();
            let left = at_rest(&noisy, rows).expect("what follows the motion");
            // Where it moves least there is mostly noise.
            let noise = 0.2 / 3_f64.sqrt();
            let whole = noisy.iter().map(|r| r * r).sum::<f64>() / noisy.len() as f64;
            assert!(left > 0.9 * noise, "{seed}: {left}");
            assert!(left < 0.5 * whole.sqrt(), "{seed}: {left}");
        }
    }
}
