//! Shaking the simulated rig: which records are taken, and the study they make.

use super::excitation::Excitation;
use super::hidden::{self, Hidden, HiddenJoint, Hide};
use super::joint::JointLaw;
use super::motion::{Bodies, BodyState, DRIVE_RAMP_S, joint_state};
use super::rig::RigParameters;
use super::sensors::{COLUMNS, ENCODER_STEP, add_noise, noise_rms, quantise, reading, record};
use super::truth::{Taken, Truth};
use crate::study::{Axis, AxisKind, Controller, Convention, Role, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::terms::EffectValues;
use rayon::prelude::*;
use std::path::PathBuf;

/// Runge–Kutta steps per logged row; the test in `motion` shows that twice as many change nothing.
pub(crate) const SUBSTEPS: usize = 4;

/// The rig to simulate, how it is shaken and with which sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationOptions {
    /// Masses, springs and contacts of the rig.
    pub rig: RigParameters,
    /// 1 (x only) or 2.
    pub axes: usize,
    /// Signal-to-noise ratio of accelerometers, force and torque, dB; `None` is no noise.
    pub snr_db: Option<f64>,
    /// Round the encoders to whole counts, as a rig does.
    pub quantised: bool,
    /// Seed of drives and noise.
    pub seed: u64,
    /// Length of each record, s.
    pub duration_s: f64,
    /// Sample rate of the logs, Hz.
    pub sample_rate_hz: f64,
    /// The drive's band, Hz.
    pub band_hz: [f64; 2],
    /// Drive of the validation record, as a multiple of the training records'.
    pub validation_level: f64,
    /// An effect that the rig has and its study does not list.
    pub hidden: Option<Hide>,
}

impl Default for SimulationOptions {
    /// Two axes, 60 dB, 5 s at 2000 Hz per record (30,000 training rows in all), 2 to 60 Hz,
    /// validation at 0.85 of the training level.
    fn default() -> Self {
        Self {
            rig: RigParameters::default(),
            axes: 2,
            snr_db: Some(60.0),
            quantised: true,
            seed: 1,
            duration_s: 5.0,
            sample_rate_hz: 2000.0,
            band_hz: [2.0, 60.0],
            validation_level: 0.85,
            hidden: None,
        }
    }
}

/// A simulated study with the truth beside it.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The study as it would be read from its folder.
    pub study: Study,
    /// Per record, the channels as logged, in the order of [`COLUMNS`](super::COLUMNS); a one-axis
    /// log uses the first of each pair.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Per record, the joint's true force and motion.
    pub truth: Vec<Truth>,
    /// Noise per column, root mean square, SI.
    pub noise_rms: [f64; 10],
    /// The effect that was hidden in the joint; `None` where none was.
    pub hidden: Option<Hidden>,
}

/// The physics that a user of this rig would believe in.
fn base_terms(axes: usize) -> Vec<String> {
    let mut terms = Vec::new();
    for axis in ["x", "phi"].iter().take(axes) {
        for effect in ["stiffness", "viscous", "clearance"] {
            terms.push(format!("{effect}@{axis}"));
        }
    }
    if axes == 2 {
        terms.push("clearance_coupling".into());
    }
    terms
}

/// One run: its file, its role, and the level of each axis's drive.
struct Run {
    file: &'static str,
    role: Role,
    level: [f64; 2],
}

fn runs(options: &SimulationOptions) -> Vec<Run> {
    let run = |file, role, level| Run { file, role, level };
    let v = options.validation_level;
    if options.axes == 2 {
        vec![
            run("train_x.csv", Role::Train, [1.0, 0.0]),
            run("train_phi.csv", Role::Train, [0.0, 1.0]),
            run("train_both.csv", Role::Train, [1.0, 1.0]),
            run("valid.csv", Role::Validate, [v, v]),
        ]
    } else {
        vec![
            run("train_x.csv", Role::Train, [1.0, 0.0]),
            run("train_x_low.csv", Role::Train, [0.6, 0.0]),
            run("valid.csv", Role::Validate, [v, 0.0]),
        ]
    }
}

fn check(options: &SimulationOptions) -> Result<usize> {
    if !(1..=2).contains(&options.axes) {
        return Err(Error::usage(format!(
            "a simulated rig has 1 or 2 axes, not {}",
            options.axes
        )));
    }
    if options
        .snr_db
        .is_some_and(|snr| !(0.0..=200.0).contains(&snr))
    {
        return Err(Error::usage(
            "the signal-to-noise ratio must lie between 0 and 200 dB; leave it out for no noise",
        ));
    }
    let rate = options.sample_rate_hz;
    let [low, high] = options.band_hz;
    if !(low > 0.0 && low < high && high <= 0.1 * rate && rate <= 1e5) {
        return Err(Error::usage(format!(
            "the drive's band of {low} to {high} Hz must rise and end at or below a tenth of the sample rate of {rate} Hz"
        )));
    }
    if !(DRIVE_RAMP_S..=3600.0).contains(&options.duration_s) || options.duration_s * low < 2.0 {
        return Err(Error::usage(format!(
            "a record of {} s cannot hold a drive from {low} Hz on; try at least {} s",
            options.duration_s,
            (2.0 / low).max(DRIVE_RAMP_S)
        )));
    }
    if !(options.validation_level > 0.0 && options.validation_level <= 10.0) {
        return Err(Error::usage(
            "the level of the validation record must lie above 0 and at or below 10",
        ));
    }
    Ok((options.duration_s * rate).round() as usize)
}

fn axes(options: &SimulationOptions) -> Vec<Axis> {
    let axis = |index: usize, name: &str, kind, inertia| Axis {
        name: name.into(),
        kind,
        inertia: Some(inertia),
        restoring_force: Convention::InertiaMinusForce,
        ground_stiffness: 0.0,
        ground_damping: 0.0,
        controller: Controller::default(),
        encoder_step: options.quantised.then_some(ENCODER_STEP[index]),
        velocity_alone: false,
        integrated_above_hz: None,
    };
    let rig = &options.rig;
    let mut axes = vec![
        axis(0, "x", AxisKind::Translation, rig.translation.inertia[1]),
        axis(1, "phi", AxisKind::Rotation, rig.rotation.inertia[1]),
    ];
    axes.truncate(options.axes);
    axes
}

/// Takes the records of a study on the simulated rig, in memory.
///
/// Records of a two-axis rig: x driven, φ driven, both driven by uncorrelated drives, and a
/// validation record with another seed and level; of a one-axis rig: two levels and a validation
/// record.
///
/// # Errors
/// One sentence when an option lies outside its range, or when the rig is unstable with the
/// parameters given.
pub fn simulate(options: &SimulationOptions) -> Result<Simulation> {
    let rows = check(options)?;
    let runs = runs(options);
    let axes = axes(options);
    let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
    let base = base_terms(options.axes);
    // Every simulated axis states its inertia.
    let inertia: Vec<f64> = axes.iter().map(|a| a.inertia.unwrap_or_default()).collect();
    let rig = hidden::Rig {
        axes: &names,
        base: &base,
        inertia: &inertia,
        sample_rate_hz: options.sample_rate_hz,
        take: &|effect| take(options, &runs, rows, effect, |run| run.role == Role::Train),
    };
    let hide = options.hidden.as_ref();
    let hidden = hide.map(|what| rig.hide(what)).transpose()?;
    let effect = hidden.as_ref().map(|h| &h.in_si);
    let taken = take(options, &runs, rows, effect, |_| true)?;
    let (mut columns, truth): (Vec<_>, Vec<_>) =
        taken.into_iter().map(|t| (t.columns, t.truth)).unzip();
    let mut axes = axes;
    if let Some(term) = effect {
        for (index, columns) in columns.iter_mut().enumerate() {
            let right = record("", Role::Train, columns, axes.len());
            let logged =
                hidden::in_the_log(term, index, &right, options.sample_rate_hz, axes.len())?;
            for (axis, channels) in logged.axes.into_iter().enumerate() {
                columns[8 + axis] = channels.force;
            }
        }
        for (index, axis) in axes.iter_mut().enumerate() {
            axis.inertia = Some(hidden::stated_inertia(term, index, inertia[index])?);
        }
    }
    let training: Vec<_> = columns
        .iter()
        .zip(&runs)
        .filter(|(_, run)| run.role == Role::Train)
        .map(|(record, _)| record)
        .collect();
    let noise = noise_rms(&training, options.snr_db);
    for (index, record) in columns.iter_mut().enumerate() {
        add_noise(record, &noise, stream(options.seed, index, 2));
        if options.quantised {
            quantise(record);
        }
    }
    let study = Study {
        leave_out_standstill: false,
        inputs: Vec::new(),
        name: "simulated rig".into(),
        path: PathBuf::from("study.toml"),
        sample_rate_hz: options.sample_rate_hz,
        band_hz: None,
        records: runs
            .iter()
            .zip(&columns)
            .map(|(run, columns)| record(run.file, run.role, columns, options.axes))
            .collect(),
        axes,
        quasi_static: false,
        sources: Vec::new(),
        base_terms: base,
        unused: Vec::new(),
        notes: Vec::new(),
    };
    Ok(Simulation {
        study,
        columns,
        truth,
        noise_rms: noise,
        hidden,
    })
}

/// Takes those of the runs that are wanted, free of noise, with an effect in the joint.
fn take(
    options: &SimulationOptions,
    runs: &[Run],
    rows: usize,
    effect: Option<&EffectValues>,
    wanted: impl Fn(&Run) -> bool + Sync,
) -> Result<Vec<Taken>> {
    let step_s = 1.0 / (options.sample_rate_hz * SUBSTEPS as f64);
    let taken: Vec<Taken> = runs
        .par_iter()
        .enumerate()
        .filter(|(_, run)| wanted(run))
        .map(|(index, run)| {
            let drive = drives(options, run, index, rows);
            let bodies = Bodies {
                parameters: &options.rig,
                joint: HiddenJoint::new(&options.rig, options.axes, effect, step_s),
            };
            shake(bodies, &drive, options.axes, rows, options.sample_rate_hz)
        })
        .collect();
    let mut values = taken.iter().flat_map(|t| &t.columns).flatten();
    if !values.all(|value| value.is_finite()) {
        return Err(Error::failed(
            "the simulated rig is unstable with these parameters: try a smaller coupling, more damping, or to hide a smaller share",
        ));
    }
    Ok(taken)
}

/// One record from rest.
fn shake(
    mut bodies: Bodies<'_, HiddenJoint>,
    drive: &[Excitation; 2],
    axes: usize,
    rows: usize,
    sample_rate_hz: f64,
) -> Taken {
    let series = |count: usize| vec![Vec::with_capacity(rows); count];
    let push = |into: &mut Vec<Vec<f64>>, values: &[f64]| {
        into.iter_mut().zip(values).for_each(|(s, v)| s.push(*v));
    };
    let mut columns = series(COLUMNS.len());
    let (mut states, mut forces, mut hidden) = (series(2 * axes), series(axes), series(axes));
    let mut y = BodyState::zeros();
    for row in 0..rows {
        let state = joint_state(&y);
        push(&mut columns, &reading(&bodies, &y));
        push(&mut states, &state);
        let contacts = bodies.joint.contacts(state);
        push(&mut forces, &bodies.joint.force(state, contacts));
        push(&mut hidden, &bodies.joint.hidden_force(state));
        bodies.next_row(&mut y, drive, row, sample_rate_hz, SUBSTEPS);
    }
    Taken {
        truth: Truth {
            acceleration: (0..axes)
                .map(|axis| columns[4 + 2 * axis].clone())
                .collect(),
            force: (0..axes).map(|axis| columns[8 + axis].clone()).collect(),
            states,
            restoring_force: forces,
        },
        columns,
        hidden,
    }
}

/// The drives of one run, translation first.
fn drives(options: &SimulationOptions, run: &Run, index: usize, rows: usize) -> [Excitation; 2] {
    let rms = [
        options.rig.translation.drive_rms * run.level[0],
        options.rig.rotation.drive_rms * run.level[1],
    ];
    [0, 1].map(|axis| {
        Excitation::broadband(
            rows,
            options.sample_rate_hz,
            options.band_hz,
            rms[axis],
            DRIVE_RAMP_S,
            stream(options.seed, index, axis),
        )
    })
}

/// The drives on body 1 with which [`simulate`] takes the record `file`, translation first; none
/// when it takes no such record.
///
/// # Errors
/// As [`simulate`], when an option lies outside its range.
pub fn record_drives(options: &SimulationOptions, file: &str) -> Result<Option<[Excitation; 2]>> {
    let rows = check(options)?;
    let mut runs = runs(options).into_iter().enumerate();
    let run = runs.find(|(_, run)| run.file == file);
    Ok(run.map(|(index, run)| drives(options, &run, index, rows)))
}

/// A seed of its own for every drive and noise of every record.
fn stream(seed: u64, record: usize, use_of: usize) -> u64 {
    seed.wrapping_mul(64) + (record * 4 + use_of) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn short() -> SimulationOptions {
        SimulationOptions {
            duration_s: 2.0,
            snr_db: None,
            quantised: false,
            ..Default::default()
        }
    }

    #[test]
    fn the_log_gives_the_joints_force_back() {
        let simulation = simulate(&short()).unwrap();
        for (record, truth) in simulation.study.records.iter().zip(&simulation.truth) {
            for (i, axis) in simulation.study.axes.iter().enumerate() {
                let inertia = axis.inertia.unwrap();
                let channels = &record.axes[i];
                let acceleration = channels.acceleration.as_ref().unwrap();
                assert_eq!(acceleration.len(), record.rows);
                for (row, a) in acceleration.iter().enumerate() {
                    let r = inertia * a - channels.force[row];
                    let expected = truth.restoring_force[i][row];
                    let scale = channels.force[row].abs().max(1e-3);
                    assert!((r - expected).abs() < 1e-9 * scale);
                }
            }
        }
    }

    #[test]
    fn a_seed_repeats_and_records_differ() {
        let options = SimulationOptions {
            snr_db: Some(40.0),
            quantised: true,
            ..short()
        };
        let (a, b) = (simulate(&options).unwrap(), simulate(&options).unwrap());
        assert_eq!(a.columns, b.columns);
        assert_ne!(a.columns[0][0], a.columns[2][0]);
        let other = simulate(&SimulationOptions { seed: 2, ..options }).unwrap();
        assert_ne!(a.columns[0][0], other.columns[0][0]);
    }

    #[test]
    fn impossible_options_are_refused() {
        for options in [
            SimulationOptions { axes: 3, ..short() },
            SimulationOptions {
                snr_db: Some(f64::NAN),
                ..short()
            },
            SimulationOptions {
                band_hz: [60.0, 2.0],
                ..short()
            },
            SimulationOptions {
                band_hz: [2.0, f64::NAN],
                ..short()
            },
            SimulationOptions {
                duration_s: 0.1,
                ..short()
            },
            SimulationOptions {
                validation_level: 0.0,
                ..short()
            },
        ] {
            assert_eq!(simulate(&options).unwrap_err().exit_code(), 2);
        }
    }
}
