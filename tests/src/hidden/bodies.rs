//! Drawing a rig without anything hidden: bodies, springs, free play, and how it is shaken.

use super::drive::{Drive, Manner, RATE_HZ};
use super::rig::{Base, Chain, Run};
use rand::{Rng, RngExt};

/// The largest |x| (m) and |φ| (rad) that count as a plausible motion of the joint.
pub const BOUND: [f64; 2] = [0.02, 0.7];

/// A value times a factor drawn log-uniformly from 1/spread to spread.
fn about(value: f64, spread: f64, rng: &mut impl Rng) -> f64 {
    value * spread.powf(rng.random_range(-1.0..1.0))
}

fn chain(inertia: [f64; 4], spring: [f64; 3], damper: [f64; 3], rng: &mut impl Rng) -> Chain {
    Chain {
        inertia: inertia.map(|m| about(m, 1.25, rng)),
        spring: spring.map(|k| about(k, 1.4, rng)),
        damper: damper.map(|c| about(c, 1.4, rng)),
    }
}

/// The bodies of a bench-top rig of some kilogrammes, its first modes near 7 and 35 Hz.
pub fn draw_chains(rng: &mut impl Rng) -> [Chain; 2] {
    [
        chain(
            [2.0, 1.8, 1.6, 3.0],
            [45e3, 120e3, 60e3],
            [12.0, 40.0, 120.0],
            rng,
        ),
        chain(
            [3.4e-3, 2.8e-3, 2.7e-3, 5.5e-3],
            [75.0, 200.0, 100.0],
            [0.02, 0.06, 0.2],
            rng,
        ),
    ]
}

/// The joint that the user knows; without coupling on a rig of one axis.
pub fn draw_base(axes: usize, rng: &mut impl Rng) -> Base {
    let coupled = if axes == 2 { 1.0 } else { 0.0 };
    Base {
        spring: [about(1500.0, 1.5, rng), about(2.6, 1.5, rng)],
        damper: [about(45.0, 1.5, rng), about(0.045, 1.7, rng)],
        gap: [about(1.3e-3, 1.6, rng), about(0.032, 1.6, rng)],
        contact: [about(14e3, 1.4, rng), about(20.0, 1.4, rng)],
        coupling: [
            coupled * about(700.0, 1.7, rng),
            coupled * about(600.0, 1.7, rng),
        ],
        lever: about(0.03, 1.7, rng),
        rounding: 0.0,
    }
}

/// Names of a study's records with their roles, and the level of the drive along and about x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// File name of the log.
    pub file: &'static str,
    /// Whether it is learnt from.
    pub training: bool,
    /// Drive of each axis as a multiple of the full one.
    pub level: [f64; 2],
}

/// The records of a study: those of the paper's rig on two axes, two levels on one.
pub fn plans(axes: usize, validation_level: f64) -> Vec<Plan> {
    let plan = |file, training, along, about| Plan {
        file,
        training,
        level: [along, about],
    };
    let v = validation_level;
    if axes == 2 {
        vec![
            plan("train_both.csv", true, 1.0, 1.0),
            plan("train_phi.csv", true, 0.0, 1.0),
            plan("train_x.csv", true, 1.0, 0.0),
            plan("valid.csv", false, v, v),
        ]
    } else {
        vec![
            plan("train_x.csv", true, 1.0, 0.0),
            plan("train_x_low.csv", true, 0.6, 0.0),
            plan("valid.csv", false, v, 0.0),
        ]
    }
}

/// How all records of a study are shaken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaking {
    /// Length of a record, s.
    pub duration_s: f64,
    /// RMS of the full drive along (N) and about (N·m) x.
    pub size: [f64; 2],
    /// Lowest and highest frequency of the drive, Hz.
    pub band_hz: [f64; 2],
    /// Random tones of the band, or sweeps through it.
    pub manner: Manner,
    /// Whether the drive grows through a record.
    pub growing: bool,
    /// Level of the validation record.
    pub validation_level: f64,
}

impl Shaking {
    /// Mostly random drives of full size; a fifth are sweeps, some grow.
    pub fn draw(rng: &mut impl Rng) -> Self {
        Self {
            duration_s: (5.0 * 4f64.powf(rng.random::<f64>()) * 10.0).round() / 10.0,
            size: [about(32.0, 1.2, rng), about(1.3, 1.2, rng)],
            band_hz: [rng.random_range(2.0..4.0), rng.random_range(40.0..65.0)],
            manner: if rng.random_bool(0.2) {
                Manner::Sweep(rng.random_range(2.0..5.0))
            } else {
                Manner::Random
            },
            growing: rng.random_bool(0.15),
            validation_level: rng.random_range(0.8..0.95),
        }
    }

    /// The drives of one record.
    pub fn run(&self, plan: &Plan, rng: &mut impl Rng) -> Run {
        let rows = (self.duration_s * RATE_HZ).round() as usize;
        let drives = [0, 1].map(|axis| {
            let rms = self.size[axis] * plan.level[axis];
            if rms == 0.0 {
                return Drive::none();
            }
            Drive::new(rows, self.band_hz, rms, self.manner, self.growing, rng)
        });
        Run {
            rows,
            drives,
            unlogged: Drive::new(rows, [3.0, 60.0], 1.0, Manner::Random, false, rng),
        }
    }
}
