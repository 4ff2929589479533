//! What the sensors make of the motion: encoder counts, and noise on accelerometers and strain
//! gauges.

use super::joint::JointLaw;
use super::motion::{Bodies, BodyState, joint_state};
use crate::study::{Channels, Record, Role};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// The columns of a log after the time, in SI units; a one-axis log leaves out those of the
/// rotation.
pub const COLUMNS: [&str; 10] = [
    "x2_m",
    "x3_m",
    "phi2_rad",
    "phi3_rad",
    "a2_m_s2",
    "a3_m_s2",
    "alpha2_rad_s2",
    "alpha3_rad_s2",
    "force_N",
    "torque_Nm",
];

/// One encoder count: 2 µm on x; 2¹⁸ counts per turn on φ.
pub const ENCODER_STEP: [f64; 2] = [2e-6, std::f64::consts::TAU / 262_144.0];

/// Columns that are encoders, and the axis of each.
const ENCODERS: [(usize, usize); 4] = [(0, 0), (1, 0), (2, 1), (3, 1)];

/// What the sensors would read at one instant if they were free of noise, one value per entry of
/// [`COLUMNS`].
pub(super) fn reading<L: JointLaw>(bodies: &Bodies<'_, L>, y: &BodyState) -> [f64; 10] {
    // The drive acts on body 1 only, so the accelerations of bodies 2 and 3 do not need it.
    let contacts = bodies.joint.contacts(joint_state(y));
    let rate = bodies.derivative(y, contacts, [0.0; 2]);
    [
        y[1],
        y[2],
        y[5],
        y[6],
        rate[9],
        rate[10],
        rate[13],
        rate[14],
        bodies.shaft_force(0, y),
        bodies.shaft_force(1, y),
    ]
}

/// The noise of each channel, SI, root mean square: `snr_db` below the channel's root mean square
/// over all training records together, as one sensor has one noise whatever it measures; none on
/// encoders.
pub(super) fn noise_rms(training: &[&Vec<Vec<f64>>], snr_db: Option<f64>) -> [f64; 10] {
    let Some(snr_db) = snr_db else {
        return [0.0; 10];
    };
    std::array::from_fn(|column| {
        if ENCODERS.iter().any(|&(encoder, _)| encoder == column) {
            return 0.0;
        }
        let rows: usize = training.iter().map(|record| record[column].len()).sum();
        let power: f64 = training
            .iter()
            .flat_map(|record| &record[column])
            .map(|value| value * value)
            .sum();
        (power / rows as f64).sqrt() * 10f64.powf(-snr_db / 20.0)
    })
}

/// Adds white Gaussian noise to the channels that have any.
pub(super) fn add_noise(columns: &mut [Vec<f64>], noise_rms: &[f64; 10], seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for (column, &rms) in columns.iter_mut().zip(noise_rms) {
        if rms > 0.0 {
            let noise = Normal::new(0.0, rms).expect("a finite positive spread");
            for value in column {
                *value += noise.sample(&mut rng);
            }
        }
    }
}

/// Rounds the encoders to whole counts.
pub(super) fn quantise(columns: &mut [Vec<f64>]) {
    for (column, axis) in ENCODERS {
        for value in &mut columns[column] {
            *value = (*value / ENCODER_STEP[axis]).round() * ENCODER_STEP[axis];
        }
    }
}

/// The columns of a log as a study's record.
pub(super) fn record(file: &str, role: Role, columns: &[Vec<f64>], axes: usize) -> Record {
    Record {
        inputs: Vec::new(),
        file: file.into(),
        role,
        first_row: 0,
        rows: columns[0].len(),
        axes: (0..axes)
            .map(|axis| Channels {
                displacement_first: columns[2 * axis + 1].clone(),
                displacement_second: Some(columns[2 * axis].clone()),
                velocity: None,
                body_position: Some(columns[2 * axis].clone()),
                acceleration: Some(columns[4 + 2 * axis].clone()),
                force: columns[8 + axis].clone(),
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_stated_ratio_and_spares_the_encoders() {
        let signal: Vec<f64> = (0..50_000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        let clean = vec![signal; 10];
        let rms = noise_rms(&[&clean], Some(40.0));
        let mut noisy = clean.clone();
        add_noise(&mut noisy, &rms, 11);
        assert_eq!(noisy[..4], clean[..4]);
        let power = |column: usize| {
            clean[column]
                .iter()
                .zip(&noisy[column])
                .map(|(a, b)| (b - a) * (b - a))
                .sum::<f64>()
        };
        let size: f64 = clean[9].iter().map(|a| a * a).sum();
        let ratio_db = 10.0 * (size / power(9)).log10();
        assert!((ratio_db - 40.0).abs() < 0.2, "{ratio_db} dB");
    }

    #[test]
    fn encoders_read_whole_counts() {
        let mut columns = vec![vec![1.234_567e-3]; 10];
        quantise(&mut columns);
        assert!((columns[0][0] - 1.234e-3).abs() < 1e-12);
        let counts = columns[2][0] / ENCODER_STEP[1];
        assert!((counts - counts.round()).abs() < 1e-9);
        assert_eq!(columns[4][0], 1.234_567e-3);
    }
}
