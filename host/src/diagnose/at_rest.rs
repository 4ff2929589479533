//! Whether what an axis shows at rest is noise, or a force that nobody measures.
//!
//! Noise of sensors is white, or grows towards low frequencies, or both: its density nowhere rises with the frequency. A force has
//! frequencies of its own, and its density stands above what is below them.

use crate::signal::spectrum::Accumulator;

/// Length of the windows of the spectrum, s.
const WINDOW_S: f64 = 4.0;
/// Windows that a record has to have room for, beside each other; shorter ones do in a short record.
const WINDOWS: usize = 3;
/// Octaves below the band's end that are looked at; the lowest begins at two hertz in a band of 128 Hz. Lower ones have too few lines.
const OCTAVES: usize = 6;
/// Fewer lines than this say nothing of an octave.
const LEAST_LINES: usize = 4;
/// A density has risen where it is so many times that of a lower octave: those of single octaves scatter.
const ABOVE: f64 = 1.6;
/// The part of the power that has to have risen.
const PART: f64 = 0.4;

/// Whether much of the power of residuals at rest, up to `band_hz`, is not noise.
pub(super) fn acts<'a>(
    residuals: impl Iterator<Item = &'a [f64]> + Clone,
    rate: f64,
    band_hz: f64,
) -> bool {
    let shortest = residuals.clone().map(<[f64]>::len).min().unwrap_or(0);
    let mut sum = Accumulator::new(rate, ((WINDOW_S * rate) as usize).min(shortest / WINDOWS));
    residuals.for_each(|series| sum.add(series));
    let spectrum = sum.finish();
    let (mut all, mut risen) = (0.0, 0.0);
    let mut least = f64::INFINITY;
    for octave in (0..OCTAVES).rev() {
        let to_hz = band_hz / f64::from(1_u32 << octave);
        // Lines 0 and 1 hold what is left of a mean under the window.
        let from = ((0.5 * to_hz / spectrum.resolution_hz).ceil() as usize).max(2);
        let to = (to_hz / spectrum.resolution_hz).floor() as usize + 1;
        let mut lines = match spectrum.density.get(from..to) {
            Some(lines) if lines.len() >= LEAST_LINES => lines.to_vec(),
            _ => continue,
        };
        // In the median of its lines a single one, of the mains, does not show.
        lines.sort_by(f64::total_cmp);
        let density = lines[lines.len() / 2];
        let width = 0.5 * to_hz;
        all += density * width;
        if least.is_finite() {
            risen += (density - ABOVE * least).max(0.0) * width;
        }
        least = least.min(density);
    }
    risen > PART * all
}

#[cfg(test)]
mod tests {
    use super::acts;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    const RATE: f64 = 1000.0;

    /// White noise, the same summed up so that it grows towards low frequencies, and the same in a band about 20 Hz.
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
            for noise in [&white, &slow, &both] {
                assert!(!acts([noise.as_slice()].into_iter(), RATE, 120.0), "{seed}");
            }
            assert!(acts([pushed.as_slice()].into_iter(), RATE, 120.0), "{seed}");
            assert!(!acts([&white[..100]].into_iter(), RATE, 120.0));
        }
    }
}
