//! What shakes body 1 of the campaign's rig: random tones of a band, or sweeps, with a soft start.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;

/// Rows per second of every record.
pub const RATE_HZ: f64 = 2000.0;

/// Tones in a random drive; enough for a near-Gaussian force whose peaks are not cut.
const TONES: usize = 90;

/// Time over which a drive rises from nothing, s.
const RISE_S: f64 = 0.4;

/// A force known at the rows of a record and smooth between them.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    rows: Vec<f64>,
}

/// How a drive moves through its band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Manner {
    /// Tones of random frequency, amplitude and phase.
    Random,
    /// Exponential sweeps up and down, one way each in the time given, s.
    Sweep(f64),
}

impl Drive {
    /// No force at any time.
    pub fn none() -> Self {
        Self::default()
    }

    /// A drive that is known at its rows.
    pub fn logged(rows: Vec<f64>) -> Self {
        Self { rows }
    }

    /// A drive of `rms` over `rows` rows; its envelope grows from 0.25 to its full size where
    /// `growing`.
    pub fn new(
        rows: usize,
        band_hz: [f64; 2],
        rms: f64,
        manner: Manner,
        growing: bool,
        rng: &mut impl Rng,
    ) -> Self {
        let mut force = match manner {
            Manner::Random => tones(rows, band_hz, rng),
            Manner::Sweep(way_s) => sweep(rows, band_hz, way_s, rng),
        };
        for (row, f) in force.iter_mut().enumerate() {
            let rise = (row as f64 / (RISE_S * RATE_HZ)).min(1.0);
            *f *= rise * rise * (3.0 - 2.0 * rise);
            if growing {
                *f *= 0.25 + 0.75 * row as f64 / rows as f64;
            }
        }
        let size = (force.iter().map(|f| f * f).sum::<f64>() / rows as f64).sqrt();
        for f in &mut force {
            *f *= rms / size;
        }
        Self { rows: force }
    }

    /// Its value a fraction `u` of a row after a row, by the cubic through the four rows around.
    pub fn at(&self, row: usize, u: f64) -> f64 {
        if self.rows.is_empty() {
            return 0.0;
        }
        let last = self.rows.len() - 1;
        let [p, a, b, q] =
            [row.saturating_sub(1), row, row + 1, row + 2].map(|i| self.rows[i.min(last)]);
        // Lagrange's form at −1, 0, 1, 2.
        let (m, n, o) = (u + 1.0, u - 1.0, u - 2.0);
        -p * u * n * o / 6.0 + a * m * n * o / 2.0 - b * m * u * o / 2.0 + q * m * u * n / 6.0
    }
}

/// Sums rotating pointers: no sine is computed per row.
fn tones(rows: usize, band_hz: [f64; 2], rng: &mut impl Rng) -> Vec<f64> {
    let normal = Normal::new(0.0, 1.0).expect("a positive spread");
    let mut force = vec![0.0; rows];
    for _ in 0..TONES {
        let frequency = rng.random_range(band_hz[0]..band_hz[1]);
        let (sin, cos) = (TAU * frequency / RATE_HZ).sin_cos();
        let (mut re, mut im): (f64, f64) = (normal.sample(rng), normal.sample(rng));
        for f in &mut force {
            *f += re;
            (re, im) = (re * cos - im * sin, re * sin + im * cos);
        }
    }
    force
}

fn sweep(rows: usize, [low, high]: [f64; 2], way_s: f64, rng: &mut impl Rng) -> Vec<f64> {
    let mut phase = rng.random_range(0.0..TAU);
    let begin = rng.random_range(0.0..2.0);
    (0..rows)
        .map(|row| {
            let ways = begin + row as f64 / (way_s * RATE_HZ);
            let along = 1.0 - (ways.rem_euclid(2.0) - 1.0).abs();
            phase += TAU * low * (high / low).powf(along) / RATE_HZ;
            phase.sin()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_drive_has_its_size_begins_softly_and_is_smooth_between_rows() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for manner in [Manner::Random, Manner::Sweep(3.0)] {
            let drive = Drive::new(20_000, [3.0, 50.0], 7.0, manner, false, &mut rng);
            let power = drive.rows.iter().map(|f| f * f).sum::<f64>() / 20_000.0;
            assert!((power.sqrt() - 7.0).abs() < 1e-9);
            assert!(drive.at(0, 0.0).abs() < 1e-12);
            for row in 1000..1100 {
                assert!((drive.at(row, 1.0) - drive.at(row + 1, 0.0)).abs() < 1e-9);
                // A coarse record of twice the period must give the middle row back.
                let coarse = Drive {
                    rows: drive.rows.iter().step_by(2).copied().collect(),
                };
                let there = coarse.at(row, 0.5);
                assert!((there - drive.rows[2 * row + 1]).abs() < 0.02);
            }
        }
    }
}
