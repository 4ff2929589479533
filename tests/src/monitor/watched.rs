//! A simulated rig, what was learnt of its joint, and the monitor that watches it: for tests of the
//! monitor and its campaign.

use jointwatch::device::export::export;
use jointwatch::device::monitor_limits::{self, Calibration, Purpose};
use jointwatch::device::replay::SetUp;
use jointwatch::fit::identify;
use jointwatch::fit::polynomial::PolynomialOptions;
use jointwatch::model::file::ModelFile;
use jointwatch::simulate::{
    Bodies, BodyState, Contact, Excitation, Joint, JointLaw, RigParameters, Simulation,
    SimulationOptions, joint_state, record_drives, simulate,
};
use jointwatch::study::{Channels, Record, Role};
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::{Monitor, MonitorState, Verdict};
use jointwatch_shared::wire::blob;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Integration steps per row at 1 kHz: a quarter of a millisecond resolves the rig, as the
/// simulator's own test shows.
const SUBSTEPS: usize = 4;
/// Samples per second of every record.
pub const RATE_HZ: f64 = 1000.0;
/// Seconds of each record from which model and limits come.
const STUDY_S: f64 = 20.0;
/// Drive of the record from which limits come, as a part of the training records'.
pub const STUDY_LEVEL: f64 = 0.85;

/// Kinds of a healthy minute ([`Shaking::minute`]): one number in so many is driven alike.
pub const DRIVES: u64 = 9;

/// What is learnt of the joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learnt {
    /// The effects of the joint, with their values.
    Physical,
    /// A polynomial alone, without effects.
    Polynomial,
}

/// A rig, what was learnt of its joint, and the device that watches it.
pub struct Subject {
    /// The study from which all else follows.
    pub simulation: Simulation,
    /// The rig that was simulated.
    pub rig: RigParameters,
    /// As the device holds it.
    pub model: Model,
    /// The chain and its filters, as `replay` sets them up.
    pub set_up: SetUp,
    /// With limits from the study.
    pub monitor: Monitor,
    /// What the limits were made from.
    pub calibration: Calibration,
    /// RMS(r−r̂)/RMS(r) per axis on the validation record.
    pub relative_error: [f64; 2],
    /// RMS of force, displacement and velocity per axis on the validation record.
    pub rms: [[f64; 3]; 2],
    /// What stands in the force log of x besides the force.
    pub hum: Option<Hum>,
}

/// A line of the mains in a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hum {
    /// Frequency of the line, Hz.
    pub hz: f64,
    /// Its amplitude, as a part of the RMS force of the first training record.
    pub part: f64,
}

/// Adds a line to a force log of so many samples a second, with this phase in turns.
pub fn add_line(force: &mut [f64], rate_hz: f64, hz: f64, amplitude: f64, phase: f64) {
    for (row, value) in force.iter_mut().enumerate() {
        let turns = hz * row as f64 / rate_hz + phase;
        *value += amplitude * (std::f64::consts::TAU * turns).sin();
    }
}

fn options(rig: &RigParameters, seed: u64, duration_s: f64, level: f64) -> SimulationOptions {
    SimulationOptions {
        rig: *rig,
        seed,
        duration_s,
        sample_rate_hz: RATE_HZ,
        validation_level: level,
        ..SimulationOptions::default()
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

impl Subject {
    /// Shakes a rig, learns a model, and sets the monitor's limits for one false alarm in
    /// `false_alarm_hours`.
    ///
    /// # Errors
    /// A sentence, when the rig is unstable or no limits could be set.
    pub fn new(
        learnt: Learnt,
        rig: RigParameters,
        seed: u64,
        false_alarm_hours: u32,
    ) -> Result<Self, String> {
        Self::humming(learnt, rig, seed, false_alarm_hours, None)
    }

    /// As [`Subject::new`], with limits that take a drift of gain and stiffness by this part for
    /// healthy.
    ///
    /// # Errors
    /// As there.
    pub fn drifting(
        learnt: Learnt,
        rig: RigParameters,
        seed: u64,
        false_alarm_hours: u32,
        drift: f64,
    ) -> Result<Self, String> {
        Self::of(learnt, rig, seed, (false_alarm_hours, drift), None)
    }

    /// As [`Subject::new`], with a line of the mains in every force log of x, another phase in
    /// each, which is then added to the model.
    ///
    /// # Errors
    /// As there, and when the line cannot be added.
    pub fn humming(
        learnt: Learnt,
        rig: RigParameters,
        seed: u64,
        false_alarm_hours: u32,
        hum: Option<Hum>,
    ) -> Result<Self, String> {
        Self::of(learnt, rig, seed, (false_alarm_hours, 0.0), hum)
    }

    fn of(
        learnt: Learnt,
        rig: RigParameters,
        seed: u64,
        (false_alarm_hours, drift): (u32, f64),
        hum: Option<Hum>,
    ) -> Result<Self, String> {
        let said = |e: jointwatch::text::error::Error| e.sentence;
        let mut simulation = simulate(&options(&rig, seed, STUDY_S, STUDY_LEVEL)).map_err(said)?;
        if let Some(Hum { hz, part }) = hum {
            let records = &mut simulation.study.records;
            let amplitude = part * rms(&records[0].axes[0].force);
            for (number, record) in records.iter_mut().enumerate() {
                let phase = 0.37 * number as f64;
                add_line(&mut record.axes[0].force, RATE_HZ, hz, amplitude, phase);
            }
        }
        let study = &simulation.study;
        let mut file: ModelFile = match learnt {
            Learnt::Physical => identify::physical(study).map_err(said)?.model,
            Learnt::Polynomial => {
                identify::polynomial(study, &PolynomialOptions::default(), &|_| ())
                    .map_err(said)?
                    .model
            }
        };
        if hum.is_some() {
            let line = ["mains_hum@x".to_owned()];
            file = jointwatch::diagnose::add::add(study, &file, &line)
                .map_err(said)?
                .model;
        }
        let exported = export(&file, None).map_err(said)?;
        let model = blob::decode(&exported.blob).map_err(|e| e.to_string())?;
        let set_up = SetUp::new(study, &model).map_err(said)?;
        let purpose = Purpose {
            model_checksum: 0,
            false_alarm_hours,
            drift,
        };
        let calibration = monitor_limits::limits(study, &set_up, &model, purpose).map_err(said)?;
        let monitor =
            Monitor::new(calibration.limits.clone(), &set_up.chain).map_err(|e| e.to_string())?;
        let relative_error = [0, 1].map(|axis: usize| file.validation[axis].relative_error);
        let truth = simulation.truth.last().ok_or("no validation record")?;
        let rms = [0, 1].map(|axis: usize| {
            [
                &truth.restoring_force[axis],
                &truth.states[2 * axis],
                &truth.states[2 * axis + 1],
            ]
            .map(|series| rms(series))
        });
        Ok(Self {
            rig,
            model,
            set_up,
            monitor,
            calibration,
            relative_error,
            rms,
            hum,
            simulation,
        })
    }

    /// The amplitude of the line, N; 0 where there is none.
    pub fn hum_amplitude(&self) -> f64 {
        self.hum.map_or(0.0, |hum| {
            hum.part * rms(&self.simulation.study.records[0].axes[0].force)
        })
    }

    /// The joint as it was.
    pub fn healthy(&self) -> Worn {
        Worn {
            joint: self.rig.joint,
            friction: [0.0; 2],
            speed: [1.0; 2],
            gain: [1.0; 2],
            lock: [[0.0; 2]; 2],
        }
    }

    /// Every change of the joint by `part` of the RMS force, with its name: stiffness and viscous
    /// friction both ways, dry friction added.
    pub fn changes(&self, part: f64) -> Vec<(String, Worn)> {
        let mut all = Vec::new();
        let same = self.healthy();
        for axis in 0..2 {
            let [force, x, v] = self.rms[axis];
            for sign in [1.0, -1.0] {
                let mut worn = same;
                worn.joint.stiffness[axis] += sign * part * force / x;
                all.push((format!("stiffness {sign:+} on {axis}"), worn));
                let mut worn = same;
                worn.joint.damping[axis] += sign * part * force / v;
                all.push((format!("damping {sign:+} on {axis}"), worn));
            }
            let mut worn = same;
            worn.friction[axis] = part * force;
            worn.speed[axis] = 0.02 * v;
            all.push((format!("dry friction on {axis}"), worn));
        }
        all
    }

    /// A record of the rig on which the joint becomes `later` after so many seconds.
    ///
    /// # Panics
    /// When the seconds are no length of a record.
    pub fn shake(&self, shaking: Shaking, later: Option<(f64, Worn)>) -> Record {
        let Shaking {
            seconds,
            levels,
            rest_s,
            seed,
        } = shaking;
        let drives = self.drives(seconds, seed, |axis, at_s| {
            let [first, last] = levels[axis];
            match (rest_s[0]..rest_s[1]).contains(&at_s) {
                true => 0.0,
                false => first + at_s / seconds * (last - first),
            }
        });
        let healthy = self.healthy();
        self.driven(&drives, seconds, seed, |at_s| match later {
            Some((after_s, worn)) if at_s >= after_s => worn,
            _ => healthy,
        })
    }

    /// Random drives as in training, times a level over axis and time in s.
    ///
    /// # Panics
    /// When the seconds are no length of a record.
    pub fn drives(
        &self,
        seconds: f64,
        seed: u64,
        level: impl Fn(usize, f64) -> f64,
    ) -> [Excitation; 2] {
        let options = options(&self.rig, seed, seconds, 1.0);
        let drives = record_drives(&options, "valid.csv")
            .expect("options in range")
            .expect("such a record");
        [0, 1].map(|axis: usize| {
            let rows = (0..(seconds * RATE_HZ) as usize).map(|row| row as f64 / RATE_HZ);
            let driven = rows.map(|at_s| drives[axis].at(at_s) * level(axis, at_s));
            Excitation::logged(driven.collect(), RATE_HZ)
        })
    }

    /// A record of the rig under these drives, with the joint that there is at each time in s.
    ///
    /// # Panics
    /// When the study's noise is not finite.
    pub fn driven(
        &self,
        drives: &[Excitation; 2],
        seconds: f64,
        seed: u64,
        joint: impl Fn(f64) -> Worn,
    ) -> Record {
        let rows = (seconds * RATE_HZ) as usize;
        let mut bodies = Bodies {
            parameters: &self.rig,
            joint: self.healthy(),
        };
        let mut y = BodyState::zeros();
        let mut columns = vec![Vec::new(); 8];
        for row in 0..rows {
            bodies.joint = joint(row as f64 / RATE_HZ);
            let rate = bodies.derivative(&y, bodies.joint.contacts(joint_state(&y)), [0.0; 2]);
            let values = [
                y[1],
                y[2],
                y[5],
                y[6],
                rate[9],
                rate[13],
                bodies.shaft_force(0, &y),
                bodies.shaft_force(1, &y),
            ];
            for (column, value) in columns.iter_mut().zip(values) {
                column.push(value);
            }
            bodies.next_row(&mut y, drives, row, RATE_HZ, SUBSTEPS);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5EED);
        let noise_of = &self.simulation.noise_rms;
        for (column, of) in [(4, 4), (5, 6), (6, 8), (7, 9)] {
            let noise = Normal::new(0.0, noise_of[of]).expect("a finite spread");
            columns[column]
                .iter_mut()
                .for_each(|v| *v += noise.sample(&mut rng));
        }
        if let Some(hum) = self.hum {
            let phase = seed as f64 * 0.137;
            add_line(
                &mut columns[6],
                RATE_HZ,
                hum.hz,
                self.hum_amplitude(),
                phase,
            );
        }
        record(columns)
    }

    /// Every change of each axis's own verdict over a record, with its time in s.
    pub fn watch_axes(&self, record: &Record) -> [Vec<(f64, Verdict)>; 2] {
        let mut seen: [Vec<(f64, Verdict)>; 2] = Default::default();
        let mut row = 0;
        self.watch(&mut MonitorState::default(), record, |state| {
            for (axis, seen) in seen.iter_mut().enumerate() {
                let verdict = state.axis(&self.monitor, axis).verdict;
                if !seen
                    .last()
                    .is_some_and(|(_, last)| last.same_reason(&verdict))
                {
                    seen.push((f64::from(row) / RATE_HZ, verdict));
                }
            }
            row += 1;
        });
        seen
    }

    /// Every change of the verdict over a record, with its time in s; `look` sees the monitor after
    /// every sample.
    pub fn watch(
        &self,
        state: &mut MonitorState,
        record: &Record,
        mut look: impl FnMut(&MonitorState),
    ) -> Vec<(f64, Verdict)> {
        let mut seen: Vec<(f64, Verdict)> = Vec::new();
        for (row, sample) in self.set_up.samples(record, &self.model).enumerate() {
            let (raw, output) = (&sample.raw, sample.output.as_ref());
            let verdict = self.monitor.update(state, raw, output, &sample.faults);
            look(state);
            if !seen
                .last()
                .is_some_and(|(_, last)| last.same_reason(&verdict))
            {
                seen.push((row as f64 / RATE_HZ, verdict));
            }
        }
        seen
    }
}

/// The rig's logged channels as a record.
fn record(columns: Vec<Vec<f64>>) -> Record {
    let axis = |i: usize| Channels {
        displacement_first: columns[2 * i + 1].clone(),
        displacement_second: Some(columns[2 * i].clone()),
        velocity: None,
        body_position: Some(columns[2 * i].clone()),
        acceleration: Some(columns[4 + i].clone()),
        force: columns[6 + i].clone(),
    };
    Record {
        inputs: Vec::new(),
        file: "live".into(),
        role: Role::Validate,
        first_row: 0,
        rows: columns[0].len(),
        axes: vec![axis(0), axis(1)],
    }
}

/// How a rig is driven over one record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaking {
    /// Length of the record, s.
    pub seconds: f64,
    /// Per axis, the drive at the beginning and at the end as a part of the training records'; it
    /// goes from one to the other evenly.
    pub levels: [[f64; 2]; 2],
    /// Nothing is driven from the first of these to the second, s.
    pub rest_s: [f64; 2],
    /// Of drives and noise.
    pub seed: u64,
}

impl Shaking {
    /// Both axes at one level throughout.
    pub fn steady(seconds: f64, level: f64, seed: u64) -> Self {
        Self {
            seconds,
            levels: [[level; 2]; 2],
            rest_s: [0.0; 2],
            seed,
        }
    }

    /// A minute of healthy life, another one for every number: steady drives of four sizes, either
    /// axis undriven, rising and falling ones, and one with a rest of ten seconds.
    pub fn minute(number: u64, seed: u64) -> Self {
        let levels = match number % DRIVES {
            0 => [[STUDY_LEVEL; 2]; 2],
            1 => [[0.7; 2]; 2],
            2 => [[1.0; 2]; 2],
            3 => [[0.5; 2]; 2],
            4 => [[0.9; 2], [0.0; 2]],
            5 => [[0.0; 2], [0.9; 2]],
            6 => [[0.2, 1.0], [0.2, 1.0]],
            7 => [[1.0, 0.3], [0.4, 0.9]],
            _ => [[1.0, 0.8]; 2],
        };
        Self {
            seconds: 60.0,
            levels,
            rest_s: if number % DRIVES == 8 {
                [25.0, 35.0]
            } else {
                [0.0; 2]
            },
            seed: seed.wrapping_mul(100_000) + number,
        }
    }
}

/// The joint with dry friction beside it.
#[derive(Clone, Copy, Debug)]
pub struct Worn {
    /// Its springs, dampers and clearances.
    pub joint: Joint,
    /// Dry friction, N and N·m.
    pub friction: [f64; 2],
    /// Speed at which dry friction is nearly full, m/s and rad/s.
    pub speed: [f64; 2],
    /// What the whole force is multiplied by.
    pub gain: [f64; 2],
    /// Stiffness and damping beside it that lock it, N/m and N·s/m, N·m/rad and N·m·s/rad.
    pub lock: [[f64; 2]; 2],
}

impl JointLaw for Worn {
    fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        JointLaw::contacts(&self.joint, state)
    }

    fn force(&self, state: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        let [x, phi] = JointLaw::force(&self.joint, state, contacts);
        let dry =
            |axis: usize| self.friction[axis] * (state[2 * axis + 1] / self.speed[axis]).tanh();
        let locked = |axis: usize| {
            let [stiffness, damping] = self.lock[axis];
            stiffness * state[2 * axis] + damping * state[2 * axis + 1]
        };
        let whole = |axis: usize, force: f64| self.gain[axis] * (force + dry(axis)) + locked(axis);
        [whole(0, x), whole(1, phi)]
    }
}
