//! The public hysteretic benchmark, simulated from its published equations and parameters: J.-P.
//! Noël, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop on Nonlinear
//! System Identification Benchmarks, Brussels 2016.
//!
//! 2·ÿ + 10·ẏ + 5·10⁴·y + z = u with ż = 5·10⁴·ẏ − 10³·(0.8·|ẏ|·z − 1.1·ẏ·|z|), in N, m and s.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Sample rate of the records, Hz.
pub const RATE_HZ: f64 = 750.0;
/// Rows of one period of a multisine.
const PERIOD: usize = 8192;
/// Periods of a multisine.
const PERIODS: usize = 2;
/// Rows at rest before a record's force begins, so that the hysteresis starts at zero.
const REST: usize = 750;
/// Integration steps per row.
const STEPS: usize = 20;
/// RMS noise of the displacement in the training record, m.
const NOISE_M: f64 = 8e-6;
/// The training record: a multisine, with noise on the displacement.
pub const TRAINING: &str = "train.csv";
/// The test records: another multisine, and a sweep of 40 N from 20 to 50 Hz at 10 Hz a minute.
pub const TESTS: [&str; 2] = ["multisine.csv", "sweep.csv"];

/// Writes the three records, as columns t, u and y, into a folder.
///
/// # Errors
/// One sentence when a file cannot be written.
pub fn records(folder: &Path) -> Result<(), String> {
    let sweep_s = 180.0;
    let sweep = |time_s: f64| {
        let turns = 20.0 * time_s + 0.5 * (50.0 - 20.0) / sweep_s * time_s * time_s;
        40.0 * (TAU * turns).sin()
    };
    let fine = (sweep_s * RATE_HZ) as usize * 2 * STEPS;
    let sweep = (0..fine).map(|i| sweep(i as f64 / (RATE_HZ * 2.0 * STEPS as f64)));
    record(&folder.join(TRAINING), &multisine(1), NOISE_M)?;
    record(&folder.join(TESTS[0]), &multisine(2), 0.0)?;
    record(&folder.join(TESTS[1]), &sweep.collect::<Vec<_>>(), 0.0)
}

/// Periods of random phases from 5 to 150 Hz, of 50 N RMS, at every half step.
fn multisine(seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let points = PERIOD * 2 * STEPS;
    let tone = |hz: f64| (hz * PERIOD as f64 / RATE_HZ).round() as usize;
    let mut period = vec![0.0; points];
    for harmonic in tone(5.0)..=tone(150.0) {
        let phase = rng.random_range(0.0..TAU);
        // A phasor turned step by step, two products instead of a sine.
        let (turn_im, turn_re) = (TAU * harmonic as f64 / points as f64).sin_cos();
        let (mut im, mut re) = phase.sin_cos();
        for value in &mut period {
            *value += im;
            (re, im) = (re * turn_re - im * turn_im, re * turn_im + im * turn_re);
        }
    }
    let square: f64 = period.iter().map(|v| v * v).sum();
    let scale = 50.0 / (square / points as f64).sqrt();
    let whole = period.iter().cycle().take(PERIODS * points);
    whole.map(|v| scale * v).collect()
}

/// The motion under a force that is given at every half step, after a rest, at the record's rate.
fn record(file: &Path, force: &[f64], noise_m: f64) -> Result<(), String> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let noise = Normal::new(0.0, noise_m).map_err(|e| e.to_string())?;
    let rest = REST * 2 * STEPS;
    let at = |i: usize| {
        i.checked_sub(rest)
            .and_then(|i| force.get(i))
            .unwrap_or(&0.0)
    };
    let mut state = [0.0; 3];
    let mut text = String::from("t,u,y\n");
    for row in 0..REST + force.len() / (2 * STEPS) {
        let begin = row * 2 * STEPS;
        let seen = state[0] + noise.sample(&mut rng);
        let _ = writeln!(text, "{},{:e},{seen:e}", row as f64 / RATE_HZ, at(begin));
        for step in 0..STEPS {
            let i = begin + 2 * step;
            state = stepped(state, [*at(i), *at(i + 1), *at(i + 2)]);
        }
    }
    fs::write(file, text).map_err(|e| format!("{}: {e}", file.display()))
}

/// y, ẏ and z one step later, by the classical method of Runge and Kutta.
fn stepped(state: [f64; 3], [begin, middle, end]: [f64; 3]) -> [f64; 3] {
    let step_s = 1.0 / (RATE_HZ * STEPS as f64);
    let rate = |[y, v, z]: [f64; 3], u: f64| {
        let memory = 5e4 * v - 1e3 * (0.8 * v.abs() * z - 1.1 * v * z.abs());
        [v, (u - 10.0 * v - 5e4 * y - z) / 2.0, memory]
    };
    let ahead = |slope: [f64; 3], by: f64| std::array::from_fn(|i| state[i] + by * slope[i]);
    let first = rate(state, begin);
    let second = rate(ahead(first, 0.5 * step_s), middle);
    let third = rate(ahead(second, 0.5 * step_s), middle);
    let fourth = rate(ahead(third, step_s), end);
    std::array::from_fn(|i| {
        state[i] + step_s / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_motion_is_that_of_the_linear_oscillator() {
        // Where z hardly bends the stiffness is 10⁵ N/m: 10⁻³ N bend it by 10⁻⁸ m.
        let mut state = [0.0; 3];
        for _ in 0..200_000 {
            state = stepped(state, [1e-3; 3]);
        }
        assert!((state[0] / 1e-8 - 1.0).abs() < 1e-3, "{state:?}");
    }
}
