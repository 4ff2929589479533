//! What slowly drifts on a joint or its instruments, and what the monitor says of it: false alarms
//! where the drift is allowed for, and the time to an alarm where it is not.

use super::watched::{Learnt, RATE_HZ, Subject, Worn};
use jointwatch::simulate::{Excitation, RigParameters};
use jointwatch::study::Record;
use jointwatch_shared::monitor::{MonitorState, Onset, State};
use rayon::prelude::*;

/// The length of a record, s; when the drift begins, and when it has its whole size, which it
/// keeps.
const SECONDS: f64 = 180.0;
const BEGINS_S: f64 = 30.0;
const ENDS_S: f64 = 120.0;
/// The swept sine's frequencies, Hz, and the time of one sweep, s.
const SWEEP_HZ: [f64; 2] = [4.0, 30.0];
const SWEEP_S: f64 = 20.0;

/// What drifts, on both axes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The joint's linear stiffness, as a part of itself.
    Stiffness,
    /// The gain of the force's bridge, as a part of itself.
    Gain,
    /// The zero of the force, as a part of the RMS force.
    Zero,
    /// The joint's temperature: its damping by −1 %/K, as a part of itself.
    Temperature,
}

impl Quantity {
    /// All four quantities that may drift.
    pub const ALL: [Self; 4] = [Self::Stiffness, Self::Gain, Self::Zero, Self::Temperature];
}

/// How the rig is driven: none of them as in training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Random, one axis rising and the other falling between half and all of the training level.
    Ramps,
    /// Random, three seconds on and two off.
    Bursts,
    /// A sine of the random drive's RMS, swept up and down.
    Sweep,
}

impl Motion {
    /// All three ways to drive the rig.
    pub const ALL: [Self; 3] = [Self::Ramps, Self::Bursts, Self::Sweep];

    fn drives(self, subject: &Subject, seed: u64) -> [Excitation; 2] {
        let ramp = |axis: usize, at_s: f64| 0.5 + 0.5 * (axis as f64 - at_s / SECONDS).abs();
        match self {
            Self::Ramps => subject.drives(SECONDS, seed, ramp),
            Self::Bursts => {
                let is_on = |at_s: f64| f64::from(u8::from(at_s % 5.0 < 3.0));
                subject.drives(SECONDS, seed, |_, at_s| 0.9 * is_on(at_s))
            }
            Self::Sweep => {
                let random = subject.drives(SECONDS, seed, |_, _| 0.7);
                random.map(|random| swept(&random))
            }
        }
    }
}

/// A sine of the drive's RMS that goes through [`SWEEP_HZ`] every [`SWEEP_S`], logarithmically up
/// and down.
fn swept(like: &Excitation) -> Excitation {
    let rows = (SECONDS * RATE_HZ) as usize;
    let at = |row: usize| row as f64 / RATE_HZ;
    let power = (0..rows).map(|row| like.at(at(row)).powi(2)).sum::<f64>() / rows as f64;
    let [low, high] = SWEEP_HZ;
    let mut turns = 0.0;
    let samples = (0..rows).map(|row| {
        let part = at(row) / SWEEP_S % 2.0;
        let up = if part < 1.0 { part } else { 2.0 - part };
        turns += low * (high / low).powf(up) / RATE_HZ;
        (2.0 * power).sqrt() * (std::f64::consts::TAU * turns).sin()
    });
    Excitation::logged(samples.collect(), RATE_HZ)
}

/// The drift at a time, of one that comes to `size`.
fn at(size: f64, at_s: f64) -> f64 {
    size * ((at_s - BEGINS_S) / (ENDS_S - BEGINS_S)).clamp(0.0, 1.0)
}

/// A record of a rig on which a quantity drifts to `size` within a minute and a half.
pub fn drifting(
    subject: &Subject,
    quantity: Quantity,
    size: f64,
    motion: Motion,
    seed: u64,
) -> Record {
    let healthy = subject.healthy();
    let drives = motion.drives(subject, seed);
    let joint = |at_s: f64| -> Worn {
        let (mut worn, part) = (healthy, at(size, at_s));
        match quantity {
            Quantity::Stiffness => {
                worn.joint.stiffness = worn.joint.stiffness.map(|k| k * (1.0 + part))
            }
            Quantity::Temperature => {
                // An oil film or an elastomer gets thinner or softer as it warms up.
                worn.joint.damping = worn.joint.damping.map(|c| c * (1.0 - part))
            }
            Quantity::Gain | Quantity::Zero => {}
        }
        worn
    };
    let mut record = subject.driven(&drives, SECONDS, seed, joint);
    for (axis, channels) in record.axes.iter_mut().enumerate() {
        let [rms, _, _] = subject.rms[axis];
        for (row, force) in channels.force.iter_mut().enumerate() {
            let part = at(size, row as f64 / RATE_HZ);
            match quantity {
                Quantity::Gain => *force *= 1.0 + part,
                Quantity::Zero => *force += part * rms,
                Quantity::Stiffness | Quantity::Temperature => {}
            }
        }
    }
    record
}

/// What was said of the joint in one run: when it first became suspect and when there was an alarm,
/// s since the drift began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Said {
    /// The first *suspect* or alarm.
    pub suspect: Option<f64>,
    /// The first alarm; none where none was raised.
    pub alarm: Option<f64>,
    /// Whether that alarm was told as one that came slowly.
    pub slow: bool,
    /// An alarm or a suspicion before the drift began.
    pub early: bool,
}

/// What a monitor says of a record.
pub fn said(subject: &Subject, record: &Record) -> Said {
    let seen = subject.watch(&mut MonitorState::default(), record, |_| ());
    let first = |least: State| {
        let mut seen = seen.iter();
        let found = seen.find(|(_, v)| v.state >= least && v.cause.is_damage());
        found.map(|(time, verdict)| (time - BEGINS_S, verdict.onset()))
    };
    let suspect = first(State::Suspect).map(|(time, _)| time);
    let alarm = first(State::Alarm);
    Said {
        suspect,
        alarm: alarm.map(|(time, _)| time),
        slow: alarm.is_some_and(|(_, onset)| onset == Onset::Slow),
        early: suspect.is_some_and(|time| time < 0.0),
    }
}

/// Rigs with the monitors that watch them, one for each allowed drift.
pub struct Fleet {
    /// Per rig its seed and a subject for each allowed drift.
    pub rigs: Vec<(u64, Vec<Subject>)>,
}

impl Fleet {
    /// Draws rigs of seeds from `seed` on, with limits for each of these drifts.
    ///
    /// # Errors
    /// When hardly any rig of the seeds is stable and has limits.
    pub fn new(
        learnt: Learnt,
        seed: u64,
        rigs: usize,
        drifts: &[f64],
        hours: u32,
    ) -> Result<Self, String> {
        let mut fleet = Self { rigs: Vec::new() };
        let mut refused = String::new();
        for seed in (seed..).take(4 * rigs) {
            let of = |drift: &f64| {
                Subject::drifting(learnt, RigParameters::draw(seed), seed, hours, *drift)
            };
            match drifts.iter().map(of).collect() {
                Ok(subjects) => fleet.rigs.push((seed, subjects)),
                Err(why) => refused = why,
            }
            if fleet.rigs.len() == rigs {
                return Ok(fleet);
            }
        }
        Err(format!(
            "only {} rigs can be watched: {refused}",
            fleet.rigs.len()
        ))
    }

    /// What is said of a drift by this size and by its negative on every rig in every motion, for
    /// each allowed drift.
    pub fn curve(&self, quantity: Quantity, size: f64) -> Vec<Vec<Said>> {
        let signs = if size == 0.0 {
            &[1.0][..]
        } else {
            &[1.0, -1.0]
        };
        let runs = self.rigs.iter().flat_map(|(seed, subjects)| {
            let motions = Motion::ALL.iter().enumerate();
            motions.flat_map(move |(number, &motion)| {
                let seed = seed * 1000 + number as u64;
                signs
                    .iter()
                    .map(move |sign| (subjects, motion, seed, sign * size))
            })
        });
        let runs: Vec<_> = runs.collect();
        let runs = runs.into_par_iter();
        self.said(runs.map(|(subjects, motion, seed, size)| {
            // The rig is the same for all of them.
            let record = drifting(&subjects[0], quantity, size, motion, seed);
            (subjects, record)
        }))
    }

    /// What the monitors of one rig say of each of these records of it, for each allowed drift.
    fn said<'a>(
        &self,
        runs: impl ParallelIterator<Item = (&'a Vec<Subject>, Record)>,
    ) -> Vec<Vec<Said>> {
        let of_all = |(subjects, record): (&Vec<Subject>, Record)| -> Vec<Said> {
            let subjects = subjects.iter();
            subjects.map(|subject| said(subject, &record)).collect()
        };
        let seen: Vec<Vec<Said>> = runs.map(of_all).collect();
        let allowed = self.rigs.first().map_or(0, |(_, subjects)| subjects.len());
        let of = |place: usize| seen.iter().map(|all| all[place]).collect();
        (0..allowed).map(of).collect()
    }

    /// Watches every rig for about so many hours in all, each record with another quantity that
    /// drifts by up to `size` either way: the hours, and what was said for each allowed drift.
    pub fn hours(&self, hours: f64, size: f64) -> (f64, Vec<Vec<Said>>) {
        let records = (hours * 3600.0 / SECONDS).ceil() as u64;
        let said = self.said((0..records).into_par_iter().map(|number| {
            let (rig, subjects) = &self.rigs[number as usize % self.rigs.len()];
            let turn = number as usize / self.rigs.len();
            let (quantity, turn) = (Quantity::ALL[turn % 4], turn / 4);
            let (motion, turn) = (Motion::ALL[turn % 3], turn / 3);
            let part = [1.0, -1.0, 0.5, -0.5][turn % 4];
            let seed = rig * 1_000_000 + number;
            let record = drifting(&subjects[0], quantity, part * size, motion, seed);
            (subjects, record)
        }));
        (records as f64 * SECONDS / 3600.0, said)
    }
}

/// The runs that were suspect and that raised an alarm, and the time in which half of the alarms
/// came; for a person to read.
pub fn line(said: &[Said]) -> String {
    let count = |of: fn(&Said) -> Option<f64>| said.iter().filter_map(of).count();
    let early = said.iter().filter(|s| s.early).count();
    let mut times: Vec<f64> = said.iter().filter_map(|s| s.alarm).collect();
    times.sort_by(f64::total_cmp);
    let half = times.get(times.len() / 2);
    let half = half.map_or(String::new(), |time| {
        let slow = said.iter().filter(|s| s.slow).count();
        format!(", half of the alarms within {time:.0} s, {slow} told as slow")
    });
    let early = match early {
        0 => String::new(),
        n => format!(", {n} before the drift"),
    };
    format!(
        "{} suspect and {} alarms of {}{half}{early}",
        count(|s| s.suspect),
        count(|s| s.alarm),
        said.len()
    )
}
