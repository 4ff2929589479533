//! What the instruments make of a motion: counts, noise, tolerances, and the instrument effects
//! that can be hidden.

use super::drive::RATE_HZ;
use super::rig::Trace;
use rand::Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;

/// What can be wrong with an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InstrumentFault {
    /// The study names an inertia that is too large by the share `strength`.
    WrongInertia,
    /// The force channel reads too much by the share `strength`.
    WrongGain,
    /// The force channel is late by `strength` seconds.
    Late,
    /// The force channel takes up `strength` times the other axis's force.
    Crosstalk,
    /// The zero of the force channel rises by `strength` from the beginning of every record to its
    /// end.
    Drift,
    /// The force channel hums with an amplitude of `strength`.
    Hum {
        /// Frequency of the mains, Hz.
        frequency_hz: f64,
        /// Phase at the beginning of each record, rad.
        phase: f64,
    },
}

/// A fault on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faulty {
    /// The instrument error, of those that the campaign can hide.
    pub fault: InstrumentFault,
    /// 0 for the translation, 1 for the rotation.
    pub axis: usize,
    /// How much, in the unit that [`InstrumentFault`] says.
    pub strength: f64,
}

/// Errors of the instruments within their data sheets: no effect is missing because of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative gain error of body 2's encoder, body 3's, both accelerometers, and the force, per
    /// axis.
    pub gain: [[f64; 5]; 2],
    /// Zero error of the accelerometers and the force, as a share of the channel's RMS, per axis.
    pub zero: [[f64; 3]; 2],
    /// Relative error of the inertia that the study names.
    pub inertia: [f64; 2],
}

/// One logged axis: body 2 and 3's position and acceleration, and the force on body 2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// Encoders of bodies 2 and 3.
    pub position: [Vec<f64>; 2],
    /// Accelerometers on bodies 2 and 3.
    pub acceleration: [Vec<f64>; 2],
    /// Strain gauges: the force on body 2.
    pub force: Vec<f64>,
}

/// Noise of an axis's accelerometers (bodies 2, 3) and force, RMS.
pub type Noise = [f64; 3];

/// Root mean square over several series.
pub fn rms<'a>(series: impl IntoIterator<Item = &'a Vec<f64>>) -> f64 {
    let (mut sum, mut rows) = (0.0, 0);
    for s in series {
        sum += s.iter().map(|v| v * v).sum::<f64>();
        rows += s.len();
    }
    (sum / rows.max(1) as f64).sqrt()
}

/// A series `delay_s` later, by Lagrange's form through eight rows; the first rows repeat the
/// first.
fn later(series: &[f64], delay_s: f64) -> Vec<f64> {
    let delay = delay_s * RATE_HZ;
    let whole = delay.floor();
    let u = delay - whole;
    // Weights of rows whole − 3 … whole + 4 ago.
    let weights: [f64; 8] = std::array::from_fn(|j| {
        let node = j as f64 - 3.0;
        (0..8)
            .filter(|&k| k != j)
            .map(|k| (u - (k as f64 - 3.0)) / (node - (k as f64 - 3.0)))
            .product()
    });
    let last = series.len() as i64 - 1;
    let at = |row: i64| series[row.clamp(0, last) as usize];
    (0..=last)
        .map(|row| {
            let terms = weights.iter().enumerate();
            terms
                .map(|(j, w)| w * at(row - whole as i64 - (j as i64 - 3)))
                .sum()
        })
        .collect()
}

/// What a fault adds to the restoring force m·a − F that its axis shows, row by row, for the true
/// inertia given.
pub fn error(faulty: &Faulty, trace: &Trace, inertia: f64) -> Vec<f64> {
    let (a, s) = (faulty.axis, faulty.strength);
    let force = &trace.force[a];
    match faulty.fault {
        InstrumentFault::WrongInertia => {
            let acceleration = trace.acceleration[a][0].iter();
            acceleration.map(|x| s * inertia * x).collect()
        }
        _ => {
            let wrong = logged_force(faulty, trace);
            force.iter().zip(wrong).map(|(f, w)| f - w).collect()
        }
    }
}

/// The force channel of the fault's axis as the fault leaves it.
fn logged_force(faulty: &Faulty, trace: &Trace) -> Vec<f64> {
    let (a, s) = (faulty.axis, faulty.strength);
    let force = &trace.force[a];
    match faulty.fault {
        InstrumentFault::WrongInertia => force.clone(),
        InstrumentFault::WrongGain => force.iter().map(|f| f * (1.0 + s)).collect(),
        InstrumentFault::Late => later(force, s),
        InstrumentFault::Drift => {
            let rows = force.len() as f64;
            let line = force.iter().enumerate();
            line.map(|(row, f)| f + s * (row as f64 / rows - 0.5))
                .collect()
        }
        InstrumentFault::Crosstalk => {
            let other = trace.force[1 - a].iter();
            force.iter().zip(other).map(|(f, o)| f + s * o).collect()
        }
        InstrumentFault::Hum {
            frequency_hz,
            phase,
        } => {
            let hum = |row: usize| (TAU * frequency_hz * row as f64 / RATE_HZ + phase).sin();
            let rows = force.iter().enumerate();
            rows.map(|(row, f)| f + s * hum(row)).collect()
        }
    }
}

/// Noise `snr_db` below each channel's RMS over all training records, per axis.
pub fn noise_of(training: &[Trace], snr_db: Option<f64>) -> [Noise; 2] {
    [0, 1].map(|axis| {
        let Some(snr_db) = snr_db else {
            return [0.0; 3];
        };
        let share = 10f64.powf(-snr_db / 20.0);
        let of = |body: usize| rms(training.iter().map(|t| &t.acceleration[axis][body]));
        let force = rms(training.iter().map(|t| &t.force[axis]));
        [of(0) * share, of(1) * share, force * share]
    })
}

/// Noise whose power falls with one over the frequency from 0.1 Hz on, of unit RMS: eight
/// relaxations, each twice as fast as the one before.
fn pink(rows: usize, rng: &mut impl Rng) -> Vec<f64> {
    let normal = Normal::new(0.0, 1.0).expect("a positive spread");
    let mut sum = vec![0.0; rows];
    for octave in 0..8 {
        let keep = (-TAU * 0.1 * f64::from(1 << octave) / RATE_HZ).exp();
        let fresh = (1.0 - keep * keep).sqrt() / 8f64.sqrt();
        let mut state = normal.sample(rng) / 8f64.sqrt();
        for value in &mut sum {
            *value += state;
            state = keep * state + fresh * normal.sample(rng);
        }
    }
    sum
}

/// Logs one axis of a record. Beside the noise stand the RMS of accelerations and force over the
/// training records, of which tolerances are shares.
pub fn log(
    trace: &Trace,
    axis: usize,
    faults: &[Faulty],
    [noise, sizes]: &[Noise; 2],
    tolerances: Option<&Tolerances>,
    encoder_step: f64,
    rng: &mut impl Rng,
) -> Log {
    let mut force = trace.force[axis].clone();
    for faulty in faults.iter().filter(|f| f.axis == axis) {
        let wrong = logged_force(faulty, trace);
        for ((f, w), truth) in force.iter_mut().zip(wrong).zip(&trace.force[axis]) {
            *f += w - truth;
        }
    }
    let mut log = Log {
        position: trace.position[axis].clone(),
        acceleration: trace.acceleration[axis].clone(),
        force,
    };
    let normal = Normal::new(0.0, 1.0).expect("a positive spread");
    let [first, second] = &mut log.acceleration;
    for (channel, series) in [first, second, &mut log.force].into_iter().enumerate() {
        if let Some(t) = tolerances {
            let slow = if noise[channel] > 0.0 {
                noise[channel]
            } else {
                1e-3 * sizes[channel]
            };
            let drift = pink(series.len(), rng);
            for (value, drift) in series.iter_mut().zip(drift) {
                *value = *value * (1.0 + t.gain[axis][channel + 2])
                    + t.zero[axis][channel] * sizes[channel]
                    + slow * drift;
            }
        }
        if noise[channel] > 0.0 {
            for value in series.iter_mut() {
                *value += noise[channel] * normal.sample(rng);
            }
        }
    }
    for (body, series) in log.position.iter_mut().enumerate() {
        let gain = 1.0 + tolerances.map_or(0.0, |t| t.gain[axis][body]);
        for value in series {
            *value = (*value * gain / encoder_step).round() * encoder_step;
        }
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_late_channel_is_late_by_parts_of_a_row() {
        let sine = |row: f64| (TAU * 60.0 * row / RATE_HZ).sin();
        let series: Vec<f64> = (0..400).map(|row| sine(f64::from(row))).collect();
        for delay_s in [0.0, 0.13e-3, 0.5e-3, 1.77e-3] {
            let late = later(&series, delay_s);
            for (row, value) in late.iter().enumerate().take(380).skip(20) {
                let expected = sine(row as f64 - delay_s * RATE_HZ);
                assert!((value - expected).abs() < 1e-6, "{delay_s} s, row {row}");
            }
        }
    }

    #[test]
    fn slow_noise_has_unit_size_and_more_power_at_low_frequencies() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let noise = pink(200_000, &mut rng);
        let size = rms([&noise]);
        assert!((size - 1.0).abs() < 0.2, "{size}");
        let means: Vec<f64> = noise
            .chunks(2000)
            .map(|c| c.iter().sum::<f64>() / 2000.0)
            .collect();
        // White noise would leave 1/√2000 = 0.02 in a mean over a second.
        assert!(rms([&means]) > 0.3);
    }
}
