//! Samples at any times brought to an even grid: the band-limited series that comes nearest to all
//! of them.
//!
//! A series of a given rate that holds nothing above half of it is Σ x_k·h(t/T − k), with h a
//! windowed sinc that is 1 at 0 and 0 at the other whole numbers, so that x_k are its values on the
//! grid. They are found by least squares over all samples, wherever these lie: two samples at
//! almost one time are averaged, and where there are more samples than grid points, what the grid
//! cannot hold is filtered out. Where samples are few, a small weight on the fourth difference
//! keeps the series smooth.

use std::f64::consts::PI;

/// Half-width of the kernel, in grid points.
const HALF_WIDTH: usize = 10;
/// Shape of the kernel's window, exp(β(√(1 − (t/W)²) − 1)).
const BETA: f64 = 12.0;
/// Diagonals of the normal matrix below its main one.
const BAND: usize = 2 * HALF_WIDTH - 1;
/// Weight of the fourth difference at half the grid's rate, where the samples' own weight is 1; it
/// falls with the eighth power of the frequency. With it a tone sampled at times off by up to 0.45
/// of a period comes back within 1e-5 at 0.1 of the rate, 4e-4 at 0.2, and 1e-2 at 0.35.
const SMOOTH: f64 = 1e-3;
/// Grid points beyond either end, so that samples just beyond it count as well.
const MARGIN: usize = 2 * HALF_WIDTH;

/// A row of the lower triangle: the main diagonal last.
type Row = [f64; BAND + 1];

/// The factored normal equations for samples at certain times, to be used for every channel that
/// was sampled then.
pub(crate) struct Resampler {
    /// Times of the samples in grid points from the first unknown; `None` for those too far
    /// outside to say anything.
    places: Vec<Option<f64>>,
    /// The Cholesky factor of the normal equations, row by row.
    root: Vec<Row>,
    /// Points of the grid that was asked for.
    points: usize,
}

impl Resampler {
    /// For samples at `seconds`, in any order, and a grid of `points` points from `start_s` on.
    pub(crate) fn new(seconds: &[f64], start_s: f64, rate_hz: f64, points: usize) -> Self {
        let unknowns = points + 2 * MARGIN;
        let reach = HALF_WIDTH as f64..(unknowns - HALF_WIDTH) as f64;
        let places: Vec<Option<f64>> = seconds
            .iter()
            .map(|t| Some((t - start_s) * rate_hz + MARGIN as f64).filter(|p| reach.contains(p)))
            .collect();
        let mut root = vec![[0.0; BAND + 1]; unknowns];
        for place in places.iter().flatten() {
            let (first, weights) = kernel(*place);
            for (i, a) in weights.iter().enumerate() {
                let row = &mut root[first + i][BAND - i..];
                for (sum, b) in row.iter_mut().zip(&weights[..=i]) {
                    *sum += a * b;
                }
            }
        }
        let density = (seconds.len() as f64 / points as f64).max(1e-3);
        add_smoothness(&mut root, SMOOTH * density / 256.0);
        factor(&mut root);
        Self {
            places,
            root,
            points,
        }
    }

    /// The series on the grid, from one value per sample.
    pub(crate) fn apply(&self, values: &[f64]) -> Vec<f64> {
        let unknowns = self.root.len();
        let mut series = vec![0.0; unknowns];
        for (place, value) in self.places.iter().zip(values) {
            let Some(place) = place else { continue };
            let (first, weights) = kernel(*place);
            for (sum, weight) in series[first..].iter_mut().zip(weights) {
                *sum += weight * value;
            }
        }
        for i in 0..unknowns {
            let from = i.saturating_sub(BAND);
            let known: f64 = (from..i)
                .map(|j| self.root[i][BAND + j - i] * series[j])
                .sum();
            series[i] = (series[i] - known) / self.root[i][BAND];
        }
        for i in (0..unknowns).rev() {
            let to = (i + BAND).min(unknowns - 1);
            let known: f64 = (i + 1..=to)
                .map(|j| self.root[j][BAND + i - j] * series[j])
                .sum();
            series[i] = (series[i] - known) / self.root[i][BAND];
        }
        series.drain(..MARGIN);
        series.truncate(self.points);
        series
    }
}

/// The band-limited series through samples of an even grid, at `factor` times their rate. Beyond
/// its ends it is taken to stay as it was there.
pub(crate) fn finer(series: &[f64], factor: usize) -> Vec<f64> {
    let phase = |part: usize| {
        let (_, mut weights) = kernel(HALF_WIDTH as f64 + part as f64 / factor as f64);
        // The window takes a little of what does not vary at all.
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        weights
    };
    let phases: Vec<_> = (0..factor).map(phase).collect();
    let last = series.len().saturating_sub(1);
    let at = |place: usize| -> f64 {
        let row = place / factor;
        let near = phases[place % factor].iter().enumerate();
        let near =
            near.map(|(i, w)| w * series[(row + 1 + i).saturating_sub(HALF_WIDTH).min(last)]);
        near.sum()
    };
    (0..series.len() * factor).map(at).collect()
}

/// The first grid point that a sample speaks of, and its weight on that and the following ones.
fn kernel(place: f64) -> (usize, [f64; 2 * HALF_WIDTH]) {
    let before = place.floor();
    let share = place - before;
    let first = before as usize + 1 - HALF_WIDTH;
    let mut weights = [0.0; 2 * HALF_WIDTH];
    // Neighbouring points differ by π in the sine, that is in its sign.
    let sine = (PI * share).sin() / PI;
    for (i, weight) in weights.iter_mut().enumerate() {
        let steps = i as isize - HALF_WIDTH as isize + 1;
        let distance = share - steps as f64;
        let inside = 1.0 - (distance / HALF_WIDTH as f64).powi(2);
        let window = (BETA * (inside.max(0.0).sqrt() - 1.0)).exp();
        let sign = if steps % 2 == 0 { 1.0 } else { -1.0 };
        *weight = if distance.abs() < 1e-9 {
            1.0
        } else {
            sign * sine / distance * window
        };
    }
    (first, weights)
}

/// Adds the squares of the fourth differences, weighted.
fn add_smoothness(root: &mut [Row], weight: f64) {
    const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
    for start in 0..root.len().saturating_sub(FOURTH.len() - 1) {
        for (i, a) in FOURTH.iter().enumerate() {
            for (j, b) in FOURTH[..=i].iter().enumerate() {
                root[start + i][BAND + j - i] += weight * a * b;
            }
        }
    }
}

/// Cholesky in place. The matrix is positive: what the samples leave open, the smoothness settles.
fn factor(root: &mut [Row]) {
    for i in 0..root.len() {
        let from = i.saturating_sub(BAND);
        for j in from..=i {
            let shared = from.max(j.saturating_sub(BAND));
            let known: f64 = (shared..j)
                .map(|k| root[i][BAND + k - i] * root[j][BAND + k - j])
                .sum();
            let left = root[i][BAND + j - i] - known;
            root[i][BAND + j - i] = if i == j {
                left.max(f64::MIN_POSITIVE).sqrt()
            } else {
                left / root[j][BAND]
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 1000.0;

    /// Tones up to a quarter of the rate.
    fn signal(t: f64) -> f64 {
        (2.0 * PI * 7.0 * t).sin() + 0.5 * (2.0 * PI * 93.0 * t).cos()
            - 0.2 * (2.0 * PI * 240.0 * t).sin()
    }

    /// Even noise from −1 to 1.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 7_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        }
    }

    /// Largest error on the grid, twenty points at either end left out.
    fn error(seconds: &[f64], rate_hz: f64, points: usize, signal: impl Fn(f64) -> f64) -> f64 {
        let values: Vec<f64> = seconds.iter().map(|t| signal(*t)).collect();
        let found = Resampler::new(seconds, 0.0, rate_hz, points).apply(&values);
        assert_eq!(found.len(), points);
        (20..points - 20).fold(0.0, |most: f64, k| {
            most.max((found[k] - signal(k as f64 / rate_hz)).abs())
        })
    }

    #[test]
    fn on_the_grid_itself_nothing_changes() {
        let seconds: Vec<f64> = (0..2000).map(|k| f64::from(k) / RATE).collect();
        let slow = |t: f64| (2.0 * PI * 20.0 * t).sin();
        assert!(error(&seconds, RATE, 2000, slow) < 1e-9);
        assert!(error(&seconds, RATE, 2000, signal) < 1e-3);
    }

    #[test]
    fn jitter_of_half_a_period_leaves_the_signal_as_it_was() {
        let mut noise = noise();
        let seconds: Vec<f64> = (0..2000)
            .map(|k| (f64::from(k) + 0.45 * noise()) / RATE)
            .collect();
        let slow = |t: f64| (2.0 * PI * 30.0 * t).sin();
        let even = error(&seconds, RATE, 2000, slow);
        assert!(even < 1e-5, "{even}");
        let fast = error(&seconds, RATE, 2000, signal);
        assert!(fast < 2e-3, "{fast}");
    }

    #[test]
    fn other_rates_up_and_down_and_any_order() {
        let mut seconds: Vec<f64> = (0..3000).map(|k| f64::from(k) / 1500.0).collect();
        assert!(error(&seconds, RATE, 1990, signal) < 1e-3);
        for pair in seconds.chunks_exact_mut(2) {
            pair.swap(0, 1);
        }
        assert!(error(&seconds, RATE, 1990, signal) < 1e-3);
        let slow = |t: f64| (2.0 * PI * 40.0 * t).sin();
        let finer = error(&seconds, 4000.0, 7900, slow);
        assert!(finer < 1e-4, "{finer}");
    }

    #[test]
    fn a_finer_grid_holds_what_the_coarse_one_held() {
        let coarse: Vec<f64> = (0..500).map(|k| signal(f64::from(k) / RATE)).collect();
        let series = finer(&coarse, 4);
        for (k, value) in series.iter().enumerate().take(1900).skip(100) {
            let wanted = signal(k as f64 / (4.0 * RATE));
            assert!((value - wanted).abs() < 1e-3, "{k}: {value} for {wanted}");
        }
        let level = finer(&[2.5; 30], 3);
        assert!(level.iter().all(|v| (v - 2.5).abs() < 1e-12));
    }

    #[test]
    fn what_the_grid_cannot_hold_is_filtered_out() {
        let seconds: Vec<f64> = (0..8000).map(|k| f64::from(k) / 4000.0).collect();
        let values: Vec<f64> = seconds
            .iter()
            .map(|t| (2.0 * PI * 5.0 * t).sin() + (2.0 * PI * 1310.0 * t).sin())
            .collect();
        let found = Resampler::new(&seconds, 0.0, RATE, 2000).apply(&values);
        for (k, value) in found.iter().enumerate().take(1980).skip(20) {
            let wanted = (2.0 * PI * 5.0 * k as f64 / RATE).sin();
            assert!((value - wanted).abs() < 3e-3, "{k}: {value} for {wanted}");
        }
    }

    #[test]
    fn a_third_of_the_samples_may_be_missing() {
        let mut noise = noise();
        let seconds: Vec<f64> = (0..3000)
            .filter(|_| noise() > -0.4)
            .map(|k| f64::from(k) / RATE)
            .collect();
        let slow = |t: f64| (2.0 * PI * 30.0 * t).sin();
        let worst = error(&seconds, RATE, 2990, slow);
        assert!(worst < 2e-3, "{worst}");
    }
}
