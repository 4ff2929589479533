//! Joints in a testing machine: the motion is imposed, displacement and force alone are logged, and
//! rates, sizes, drives and lengths differ from study to study as those of published measurements
//! do.

use super::cases::case_seed;
use super::catalogue::{Kind, Planted, Subject};
use super::form::Form;
use super::judge::Truth;
use super::laws::{Law, Surroundings};
use super::rig::Base;
use super::sizes::MEMORIES;
use super::sizes::Scale;
use super::wild;
use nalgebra::{DMatrix, DVector};
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// Steps between two rows in which the hidden law is integrated.
const STEPS: usize = 8;
/// Draws until a hidden effect shows.
const MAX_DRAWS: usize = 60;
/// Of the force, what the base has to be unable to take over.
const MIN_VISIBLE: f64 = 0.01;

/// What can be hidden in one axis whose motion is imposed.
const HIDDEN: [&str; 31] = [
    "coulomb",
    "stribeck",
    "quadratic_drag",
    "cubic_hardening",
    "bilinear",
    "clearance",
    "end_stop",
    "bouc_wen",
    "jenkins",
    "dahl",
    "iwan",
    "lugre",
    "maxwell",
    "cogging",
    "preload",
    "stiffness_drift",
    "coulomb_by_direction",
    "viscous_by_direction",
    "gap_jenkins",
    "bouc_wen_by_direction",
    "bouc_wen_hardening",
    "bouc_wen_pinching",
    "power_spring",
    "power_damper",
    "digressive_damping",
    "position_friction",
    "friction that comes and goes",
    "unmeasured force",
    "position_damping",
    "spring of a random smooth shape",
    "damping on one side of the middle",
];

/// Everything outside the library that a machine can move, the laws drawn at random as well.
fn outsiders() -> Vec<&'static str> {
    let is_outside = |name: &&&str| Subject::named(name).is_some_and(|s| s.kind == Kind::Outside);
    let drawn = HIDDEN.iter().filter(is_outside);
    drawn.chain(&wild::NAMES).copied().collect()
}

/// How the machine moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// One frequency, in three amplitudes.
    Steps,
    /// A sweep over a factor of eight.
    Sweep,
    /// Constant speed to and fro, in three speeds.
    Triangles,
    /// Random tones.
    Random,
    /// Random tones in bursts, as a recorded earthquake has them.
    Earthquake,
}

const MOTIONS: [Motion; 5] = [
    Motion::Steps,
    Motion::Sweep,
    Motion::Triangles,
    Motion::Random,
    Motion::Earthquake,
];

/// A record: displacement and force as perfect sensors show them.
struct Record {
    displacement: Vec<f64>,
    force: Vec<f64>,
}

/// A study of a joint in a testing machine.
pub struct MachineCase {
    rate_hz: f64,
    motion: Motion,
    records: Vec<Record>,
    hidden: Option<&'static Subject>,
    terms: Vec<&'static str>,
    /// White noise of the displacement, and signal-to-noise ratio of the force, dB.
    noise: [f64; 2],
    /// Part of the force that is hidden, and that the base cannot take over.
    shares: [f64; 2],
    /// Whether the spring that the user takes for linear is not quite.
    bent: bool,
    seed: u64,
}

/// Imposed displacements, at every step, in units of the largest.
fn imposed(motion: Motion, cycles: f64, rows: usize, rng: &mut impl Rng) -> Vec<f64> {
    let steps = rows * STEPS;
    let normal = Normal::new(0.0, 1.0).expect("a positive spread");
    let tones: Vec<[f64; 3]> = (0..40)
        .map(|_| {
            let frequency = cycles * 8f64.powf(rng.random_range(-0.7..0.3));
            [frequency, normal.sample(rng), rng.random_range(0.0..TAU)]
        })
        .collect();
    let bursts: Vec<f64> = (0..3).map(|_| rng.random_range(0.1..0.9)).collect();
    let mut phase = rng.random_range(0.0..TAU);
    let mut out: Vec<f64> = (0..steps)
        .map(|step| {
            let along = step as f64 / steps as f64;
            let third = (3.0 * along).floor();
            // From one amplitude to the next within a tenth of the record.
            let smooth = |at: f64| {
                let u = ((along - at) / 0.1 + 0.5).clamp(0.0, 1.0);
                u * u * (3.0 - 2.0 * u)
            };
            let level = 0.4 + 0.3 * (smooth(1.0 / 3.0) + smooth(2.0 / 3.0));
            let turn = |per_record: f64| TAU * per_record / steps as f64;
            match motion {
                Motion::Steps => {
                    phase += turn(cycles);
                    level * phase.sin()
                }
                Motion::Sweep => {
                    phase += turn(cycles * 8f64.powf(along - 0.5));
                    phase.sin()
                }
                Motion::Triangles => {
                    phase += turn(cycles * 0.5 * 2f64.powf(third));
                    // The corners of a real machine are rounded.
                    (phase.sin() * 0.995).asin() / 0.995f64.asin()
                }
                Motion::Random | Motion::Earthquake => tones
                    .iter()
                    .map(|[frequency, size, shift]| size * (TAU * frequency * along + shift).sin())
                    .sum(),
            }
        })
        .collect();
    for (step, value) in out.iter_mut().enumerate() {
        let along = step as f64 / steps as f64;
        let rise = (along * 30.0).min(1.0);
        *value *= rise * rise * (3.0 - 2.0 * rise);
        if motion == Motion::Earthquake {
            let shape = |at: &f64| (-((along - at) / 0.04).powi(2)).exp();
            *value *= 0.05 + bursts.iter().map(shape).sum::<f64>();
        }
    }
    let peak = out.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    out.iter_mut().for_each(|v| *v /= peak);
    out
}

fn rms<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// An imposed motion with its velocity, at every step.
struct Imposed {
    x: Vec<f64>,
    v: Vec<f64>,
    step_s: f64,
}

impl Imposed {
    fn new(x: Vec<f64>, step_s: f64) -> Self {
        let last = x.len() - 1;
        let v = (0..=last).map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (x[b] - x[a]) / ((b - a) as f64 * step_s)
        });
        Self {
            v: v.collect(),
            x,
            step_s,
        }
    }

    /// What a law of strength 1 exerts, row by row.
    fn force_of(&self, form: Form, unlogged: &[f64]) -> Vec<f64> {
        let law = Law {
            form,
            axis: 0,
            strength: 1.0,
        };
        let mut memory = [0.0; MEMORIES];
        let mut largest = 0.0f64;
        let mut force = Vec::with_capacity(self.x.len() / STEPS);
        let joint = |i: usize| [[self.x[i], self.v[i]], [0.0; 2]];
        for i in 0..self.x.len() {
            largest = largest.max(self.x[i].abs());
            if i % STEPS == 0 {
                let around = Surroundings {
                    time_s: i as f64 * self.step_s,
                    delayed: 0.0,
                    largest,
                    unlogged: unlogged[i / STEPS],
                };
                force.push(law.force(&joint(i), &memory, &around)[0]);
            }
            let next = (i + 1).min(self.x.len() - 1);
            let slope = law.rates(&joint(i), &memory);
            let ahead = std::array::from_fn(|m| memory[m] + self.step_s * slope[m]);
            let end = law.rates(&joint(next), &ahead);
            memory = std::array::from_fn(|m| memory[m] + 0.5 * self.step_s * (slope[m] + end[m]));
        }
        force
    }
}

/// Every value at a row.
fn at_rows(values: &[f64]) -> Vec<f64> {
    values.iter().step_by(STEPS).copied().collect()
}

/// A subject's form to suit a motion; its times follow the motion's own pace.
fn form(subject: &Subject, scale: &Scale, long_s: f64, rng: &mut impl Rng) -> Option<Form> {
    let base = Base {
        spring: [0.0; 2],
        damper: [0.0; 2],
        gap: [scale.reach * rng.random_range(0.15..0.5); 2],
        contact: [0.0; 2],
        coupling: [0.0; 2],
        lever: 0.0,
        rounding: 0.0,
    };
    match subject.plant(0, &base, scale, long_s, rng) {
        Planted::Law(Form::SpringDamper { .. }) => Some(Form::SpringDamper {
            relaxation_s: scale.displacement / scale.velocity * rng.random_range(0.3..3.0),
        }),
        Planted::Law(Form::FrictionInBouts { edge, phase, .. }) => Some(Form::FrictionInBouts {
            edge,
            phase,
            period_s: long_s / rng.random_range(2.0..6.0),
        }),
        Planted::Law(form) => Some(form),
        Planted::InstrumentFault(_) => None,
    }
}

/// What is left of a force beside the base's columns, over its own size.
fn beyond(columns: &[Vec<f64>], force: &[f64]) -> f64 {
    let lengths: Vec<f64> = columns
        .iter()
        .map(|c| rms(c).max(f64::MIN_POSITIVE))
        .collect();
    let design = DMatrix::from_fn(force.len(), columns.len(), |r, c| {
        columns[c][r] / lengths[c]
    });
    let wanted = DVector::from_column_slice(force);
    let gram = design.tr_mul(&design) + DMatrix::identity(columns.len(), columns.len()) * 1e-9;
    let Some(factor) = gram.cholesky() else {
        return 0.0;
    };
    let left = &wanted - &design * factor.solve(&design.tr_mul(&wanted));
    left.norm() / wanted.norm().max(f64::MIN_POSITIVE)
}

impl MachineCase {
    /// Draws case `number` of a campaign; nothing is hidden in 15 % of them.
    ///
    /// # Errors
    /// When sixty draws in a row hide nothing that can be seen.
    pub fn draw(seed: u64, number: usize, only: Option<&str>) -> Result<Self, String> {
        let seed = case_seed(seed, number);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let name = match only {
            Some("none") => None,
            Some("outsiders") => outsiders().choose(&mut rng).copied(),
            Some(name) => Some(name),
            None if rng.random_bool(0.15) => None,
            None => HIDDEN.choose(&mut rng).copied(),
        };
        let subject = name.and_then(Subject::named);
        for _ in 0..MAX_DRAWS {
            if let Some(case) = Self::attempt(subject, seed, &mut rng) {
                return Ok(case);
            }
        }
        Err(format!(
            "case {number}: nothing that can be seen in {MAX_DRAWS} draws"
        ))
    }

    fn attempt(subject: Option<&'static Subject>, seed: u64, rng: &mut ChaCha8Rng) -> Option<Self> {
        let mut within = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let rate_hz = within(200.0, 20_000.0).round();
        let (reach, size) = (within(2e-5, 0.05), within(1.0, 1e5));
        let (per_cycle, cycles) = (within(40.0, 600.0), within(8.0, 40.0));
        let noise = [within(2e-5, 5e-4), within(25.0, 60.0)];
        let (bend, wanted) = (within(0.005, 0.02), within(0.04, 0.6));
        let rows = ((per_cycle * cycles) as usize).clamp(600, 30_000);
        let motion = *MOTIONS.choose(rng)?;
        let count = [1, 2, 3][rng.random_range(0..3)];
        let paths: Vec<Imposed> = [1.0, 0.8, 0.9]
            .iter()
            .take(count)
            .map(|level| {
                let cycles = cycles * rng.random_range(0.8..1.25);
                let x = imposed(motion, cycles, rows, rng).into_iter();
                let x = x.map(|v| v * reach * level).collect();
                Imposed::new(x, 1.0 / rate_hz / STEPS as f64)
            })
            .collect();
        let x: Vec<f64> = paths.iter().flat_map(|p| at_rows(&p.x)).collect();
        let v: Vec<f64> = paths.iter().flat_map(|p| at_rows(&p.v)).collect();
        let scale = Scale {
            displacement: rms(&x),
            reach,
            velocity: rms(&v),
        };
        let bent = rng.random_bool(0.3);
        let damping = rng.random_range(0.1..1.0);
        let base = |x: f64, v: f64| {
            let bent = if bent {
                bend * (x / reach).powi(2)
            } else {
                0.0
            };
            size * ((x / scale.displacement) * (1.0 + bent) + damping * v / scale.velocity)
        };
        let healthy = paths.iter().map(|p| {
            let rows = at_rows(&p.x).into_iter().zip(at_rows(&p.v));
            rows.map(|(x, v)| base(x, v)).collect()
        });
        let healthy: Vec<Vec<f64>> = healthy.collect();
        let mut terms = vec!["stiffness@x", "viscous@x"];
        let mut columns = vec![x, v];
        if subject.is_none_or(|s| s.name != "preload") && rng.random() {
            terms.push("preload@x");
            columns.push(vec![1.0; columns[0].len()]);
        }
        let mut hidden: Vec<Vec<f64>> = match subject {
            None => healthy.iter().map(|h| vec![0.0; h.len()]).collect(),
            Some(subject) => {
                let form = form(subject, &scale, rows as f64 / rate_hz, rng)?;
                let force = paths.iter().map(|path| {
                    let unlogged = imposed(Motion::Random, 2.3 * cycles, rows, rng);
                    path.force_of(form, &at_rows(&unlogged))
                });
                force.collect()
            }
        };
        let strength = wanted * rms(healthy.iter().flatten()) / rms(hidden.iter().flatten());
        if subject.is_some() {
            hidden.iter_mut().flatten().for_each(|h| *h *= strength);
        }
        let records: Vec<Record> = paths
            .iter()
            .zip(healthy)
            .zip(&hidden)
            .map(|((path, healthy), hidden)| Record {
                displacement: at_rows(&path.x),
                force: healthy.iter().zip(hidden).map(|(a, b)| a + b).collect(),
            })
            .collect();
        let hidden = hidden.concat();
        let share = rms(&hidden) / rms(records.iter().flat_map(|r| &r.force));
        let shares = [share, share * beyond(&columns, &hidden)];
        let shows = (MIN_VISIBLE..1.0).contains(&shares[1]);
        (shows || subject.is_none()).then_some(Self {
            rate_hz,
            motion,
            records,
            hidden: subject,
            terms,
            noise,
            shares,
            bent,
            seed,
        })
    }

    /// What is hidden in the joint, and the verdict that it deserves.
    pub fn truth(&self) -> Truth {
        let hidden: Vec<(&Subject, usize)> = self.hidden.iter().map(|s| (*s, 0)).collect();
        let name = self.hidden.map_or("nothing", |s| s.name);
        let case = format!(
            "{name} {:.1} % ({:.2} % beyond the base), {:?}, {} records of {} rows at {} Hz, {:.0} dB{}",
            100.0 * self.shares[0],
            100.0 * self.shares[1],
            self.motion,
            self.records.len(),
            self.records[0].force.len(),
            self.rate_hz,
            self.noise[1],
            if self.bent { ", spring bent" } else { "" },
        );
        Truth::new(&hidden, case)
    }

    /// Writes the study into a folder that exists.
    ///
    /// # Errors
    /// When the files cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ 1);
        let normal = Normal::new(0.0, 1.0).expect("a positive spread");
        let mut text = String::from(
            "name = \"testing machine\"\ntime = \"t_s\"\n\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x_m\"\nforce = \"force_N\"\ninertia = 0\n",
        );
        let of = |series: fn(&Record) -> &Vec<f64>| rms(self.records.iter().flat_map(series));
        let sizes = [
            of(|r| &r.displacement) * self.noise[0],
            of(|r| &r.force) * 10f64.powf(-self.noise[1] / 20.0),
        ];
        for (number, record) in self.records.iter().enumerate() {
            let last = number > 0 && number + 1 == self.records.len();
            let role = if last { "validate" } else { "train" };
            let name = format!("run{number}.csv");
            let _ = write!(text, "\n[[record]]\nfile = \"{name}\"\nrole = \"{role}\"\n");
            let mut file = io::BufWriter::new(fs::File::create(folder.join(name))?);
            writeln!(file, "t_s,x_m,force_N")?;
            for (row, (x, f)) in record.displacement.iter().zip(&record.force).enumerate() {
                let x = x + sizes[0] * normal.sample(&mut rng);
                let f = f + sizes[1] * normal.sample(&mut rng);
                writeln!(file, "{:.9},{x:.8e},{f:.8e}", row as f64 / self.rate_hz)?;
            }
            file.flush()?;
        }
        let terms: Vec<String> = self.terms.iter().map(|t| format!("\"{t}\"")).collect();
        let _ = write!(text, "\n[base]\nterms = [{}]\n", terms.join(", "));
        fs::write(folder.join("study.toml"), text)
    }
}
