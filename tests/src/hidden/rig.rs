//! The campaign's own rig: four bodies in a row, the joint between the second and the third, and
//! what is hidden in it.
//!
//! Written apart from the program's simulator. Bodies and memories of the hidden laws are one state
//! vector under one Runge–Kutta scheme of fixed steps, short enough for the stiffest law at work.

use super::drive::{Drive, RATE_HZ};
use super::form::Form;
use super::laws::{Law, Surroundings, dead_zone};
use super::sizes::{MEMORIES, Memory};

/// Displacement and velocity of body 3 against body 2, translation first: [[x, ẋ], [φ, φ̇]].
pub type JointState = [[f64; 2]; 2];

/// One axis of the rig outside the joint, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// Bodies 1 to 4.
    pub inertia: [f64; 4],
    /// Springs between bodies 1–2, 3–4, and 4 and ground.
    pub spring: [f64; 3],
    /// Dampers beside the springs, in the same order.
    pub damper: [f64; 3],
}

/// The joint as the user believes it to be; arrays hold the translation first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// Spring through the whole range.
    pub spring: [f64; 2],
    /// Damper through the whole range, N·s/m and N·m·s/rad.
    pub damper: [f64; 2],
    /// Half the free play.
    pub gap: [f64; 2],
    /// Spring beyond the free play, N/m and N·m/rad.
    pub contact: [f64; 2],
    /// Coefficients of the two products of Eq. (16), N·s/(m·rad).
    pub coupling: [f64; 2],
    /// Lever arm of the coupling, m.
    pub lever: f64,
    /// Radius over which contact corners are rounded, as a share of the gap; 0 is sharp.
    pub rounding: f64,
}

/// A rig with what is hidden in its joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// What is outside the joint: translation, then rotation.
    pub chains: [Chain; 2],
    /// What the user knows.
    pub base: Base,
    /// What the user does not know.
    pub hidden: Vec<Law>,
}

/// What drives one record.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Rows to log, at [`RATE_HZ`].
    pub rows: usize,
    /// On body 1, translation first.
    pub drives: [Drive; 2],
    /// The force of [`Form::Unlogged`], RMS 1.
    pub unlogged: Drive,
}

/// A record as perfect sensors would log it, per axis and row, with the truth beside it.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Absolute displacement of bodies 2 and 3.
    pub position: [[Vec<f64>; 2]; 2],
    /// Absolute acceleration of bodies 2 and 3.
    pub acceleration: [[Vec<f64>; 2]; 2],
    /// What the shaft exerts on body 2.
    pub force: [Vec<f64>; 2],
    /// Displacement and velocity of the joint, row by row.
    pub joint: Vec<JointState>,
    /// What each hidden law exerts along and about x.
    pub hidden: Vec<[Vec<f64>; 2]>,
}

/// The most hidden laws in one joint.
pub const MAX_LAWS: usize = 2;
const BODIES: usize = 16;
const SIZE: usize = BODIES + MEMORIES * MAX_LAWS;

/// Positions of bodies 1–4 along and about x, their velocities, the laws' memories.
type State = [f64; SIZE];

/// Fewest steps per row: corners of the base must not show.
const MIN_STEPS: usize = 6;
/// Steps per row at which a law counts as too stiff to be followed.
const MAX_STEPS: usize = 60;

impl Base {
    /// x beyond the gap, with the corner rounded as the base says.
    fn pressed(&self, x: f64, gap: f64) -> f64 {
        if self.rounding == 0.0 {
            return dead_zone(x, gap);
        }
        let round = |u: f64| u.hypot(self.rounding * gap);
        x + 0.5 * (round(x - gap) - round(x + gap))
    }

    /// How far contact is made, 0 to 1.
    fn touching(&self, x: f64, gap: f64) -> f64 {
        let over = x.abs() - gap;
        if self.rounding == 0.0 {
            f64::from(u8::from(over >= 0.0))
        } else {
            0.5 + 0.5 * over / over.hypot(self.rounding * gap)
        }
    }

    /// The restoring force of the joint the user knows, N and N·m.
    pub fn force(&self, joint: &JointState) -> [f64; 2] {
        let [[x, v], [turn, spin]] = *joint;
        let g = -(self.coupling[0] * v * turn * self.touching(x, self.gap[0])
            + self.coupling[1] * spin * x * self.touching(turn, self.gap[1]))
            / 3.0;
        let axis = |a: usize| {
            let [x, v] = joint[a];
            self.spring[a] * x + self.damper[a] * v + self.contact[a] * self.pressed(x, self.gap[a])
        };
        [axis(0) + g, axis(1) + self.lever * g]
    }
}

/// Bodies 2 and 3 against each other.
fn joint_of(y: &State) -> JointState {
    [0, 1].map(|a| [y[4 * a + 2] - y[4 * a + 1], y[4 * a + 10] - y[4 * a + 9]])
}

/// Where the joint was, for laws that act late; one entry per step.
struct Past {
    steps: Vec<[f64; 2]>,
    step_s: f64,
}

impl Past {
    fn at(&self, axis: usize, time_s: f64) -> f64 {
        let place = time_s / self.step_s;
        if place <= 0.0 || self.steps.is_empty() {
            return 0.0;
        }
        let before = (place as usize).min(self.steps.len() - 1);
        let after = (before + 1).min(self.steps.len() - 1);
        let u = place - before as f64;
        self.steps[before][axis] * (1.0 - u) + self.steps[after][axis] * u
    }
}

impl Rig {
    /// Inertia that moves when the joint does.
    pub fn moving_inertia(&self, axis: usize) -> f64 {
        let [_, m2, m3, _] = self.chains[axis].inertia;
        m2 * m3 / (m2 + m3)
    }

    fn steps_per_row(&self, top_speed: [f64; 2]) -> Option<usize> {
        let fastest = self
            .hidden
            .iter()
            .map(|law| law.fastest_rate(self.moving_inertia(law.axis), top_speed[law.axis]))
            .fold(0.0, f64::max);
        // The scheme is stable to 2.8 over the rate; accuracy asks for less.
        let steps = (fastest / (1.2 * RATE_HZ)).ceil() as usize;
        (steps <= MAX_STEPS).then(|| steps.max(MIN_STEPS))
    }

    fn shaft(&self, axis: usize, y: &State) -> f64 {
        let (c, i) = (&self.chains[axis], 4 * axis);
        c.spring[0] * (y[i] - y[i + 1]) + c.damper[0] * (y[i + 8] - y[i + 9])
    }

    /// What each hidden law exerts on the translation and the rotation.
    fn hidden_forces(&self, y: &State, around: &[Surroundings; MAX_LAWS]) -> [[f64; 2]; MAX_LAWS] {
        let joint = joint_of(y);
        let mut forces = [[0.0; 2]; MAX_LAWS];
        for (i, law) in self.hidden.iter().enumerate() {
            let [own, other] = law.force(&joint, &memory(y, i), &around[i]);
            forces[i] = if law.axis == 0 {
                [own, other]
            } else {
                [other, own]
            };
        }
        forces
    }

    fn rate(&self, y: &State, drive: [f64; 2], around: &[Surroundings; MAX_LAWS]) -> State {
        let joint = joint_of(y);
        let mut force = self.base.force(&joint);
        for [along, about] in self.hidden_forces(y, around) {
            force[0] += along;
            force[1] += about;
        }
        let mut rate = [0.0; SIZE];
        for axis in 0..2 {
            let (c, i) = (&self.chains[axis], 4 * axis);
            let shaft = self.shaft(axis, y);
            let far = c.spring[1] * (y[i + 3] - y[i + 2]) + c.damper[1] * (y[i + 11] - y[i + 10]);
            let ground = c.spring[2] * y[i + 3] + c.damper[2] * y[i + 11];
            let net = [
                drive[axis] - shaft,
                shaft + force[axis],
                far - force[axis],
                -far - ground,
            ];
            for body in 0..4 {
                rate[i + body] = y[i + body + 8];
                rate[i + body + 8] = net[body] / c.inertia[body];
            }
        }
        for (i, law) in self.hidden.iter().enumerate() {
            let m = law.rates(&joint, &memory(y, i));
            rate[BODIES + MEMORIES * i..BODIES + MEMORIES * (i + 1)].copy_from_slice(&m);
        }
        rate
    }

    fn around(
        &self,
        run: &Run,
        past: &Past,
        largest: [f64; 2],
        row: usize,
        u: f64,
    ) -> [Surroundings; MAX_LAWS] {
        let time_s = (row as f64 + u) / RATE_HZ;
        let mut all = [Surroundings::default(); MAX_LAWS];
        for (around, law) in all.iter_mut().zip(&self.hidden) {
            around.time_s = time_s;
            around.largest = largest[law.axis];
            match law.form {
                Form::LateSpring { delay_s } => {
                    around.delayed = past.at(law.axis, time_s - delay_s)
                }
                Form::Unlogged => around.unlogged = run.unlogged.at(row, u),
                _ => {}
            }
        }
        all
    }

    /// Shakes the rig from rest; nothing when a law is too stiff to be followed or the motion
    /// leaves `bound` (the largest |x| and |φ| that count as plausible).
    pub fn shake(&self, run: &Run, top_speed: [f64; 2], bound: [f64; 2]) -> Option<Trace> {
        let steps = self.steps_per_row(top_speed)?;
        let h = 1.0 / (RATE_HZ * steps as f64);
        let mut y = self.rest()?;
        let mut largest = [0.0; 2];
        let mut past = Past {
            steps: Vec::new(),
            step_s: h,
        };
        let remembers = self
            .hidden
            .iter()
            .any(|l| matches!(l.form, Form::LateSpring { .. }));
        let mut trace = Trace::for_rows(run.rows, self.hidden.len());
        for row in 0..run.rows {
            let around = self.around(run, &past, largest, row, 0.0);
            trace.log(self, &y, &around);
            for step in 0..steps {
                if remembers {
                    past.steps.push(joint_of(&y).map(|[x, _]| x));
                }
                let instant = |part: f64| {
                    let u = (step as f64 + part) / steps as f64;
                    let drive = [0, 1].map(|a| run.drives[a].at(row, u));
                    (drive, self.around(run, &past, largest, row, u))
                };
                y = self.step(&y, h, [instant(0.0), instant(0.5), instant(1.0)]);
                for (l, [x, _]) in largest.iter_mut().zip(joint_of(&y)) {
                    *l = x.abs().max(*l);
                }
            }
            let plausible = (0..2).all(|a| largest[a] <= bound[a]);
            if !plausible || y.iter().any(|v| !v.is_finite()) {
                return None;
            }
        }
        Some(trace)
    }

    /// One classical Runge–Kutta step; what acts from outside is given at its beginning, middle and
    /// end.
    fn step(&self, y: &State, h: f64, outside: [([f64; 2], [Surroundings; MAX_LAWS]); 3]) -> State {
        let [begin, middle, end] = &outside;
        let moved = |k: &State, by: f64| -> State { std::array::from_fn(|i| y[i] + by * k[i]) };
        let k1 = self.rate(y, begin.0, &begin.1);
        let k2 = self.rate(&moved(&k1, 0.5 * h), middle.0, &middle.1);
        let k3 = self.rate(&moved(&k2, 0.5 * h), middle.0, &middle.1);
        let k4 = self.rate(&moved(&k3, h), end.0, &end.1);
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    /// Where the rig rests before a record: a constant force in the joint shifts it, and the bodies
    /// before the joint with it, until the joint's springs carry it.
    fn rest(&self) -> Option<State> {
        let mut y = [0.0; SIZE];
        for axis in 0..2 {
            let held = |x: f64| {
                let mut joint = [[0.0; 2]; 2];
                joint[axis][0] = x;
                let still = Surroundings::default();
                let laws = self.hidden.iter().filter(|law| law.axis == axis);
                self.base.force(&joint)[axis]
                    + laws
                        .map(|l| l.force(&joint, &[0.0; MEMORIES], &still)[0])
                        .sum::<f64>()
            };
            if held(0.0) == 0.0 {
                continue;
            }
            let (mut low, mut high) = (-1.0, 1.0);
            if held(low) >= 0.0 || held(high) <= 0.0 {
                return None;
            }
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if held(middle) < 0.0 {
                    low = middle
                } else {
                    high = middle
                }
            }
            y[4 * axis] = -0.5 * (low + high);
            y[4 * axis + 1] = y[4 * axis];
        }
        Some(y)
    }
}

fn memory(y: &State, law: usize) -> Memory {
    std::array::from_fn(|i| y[BODIES + MEMORIES * law + i])
}

impl Trace {
    fn for_rows(rows: usize, laws: usize) -> Self {
        let empty = || Vec::with_capacity(rows);
        let pairs = || [[empty(), empty()], [empty(), empty()]];
        Self {
            position: pairs(),
            acceleration: pairs(),
            force: [empty(), empty()],
            joint: Vec::with_capacity(rows),
            hidden: (0..laws).map(|_| [empty(), empty()]).collect(),
        }
    }

    fn log(&mut self, rig: &Rig, y: &State, around: &[Surroundings; MAX_LAWS]) {
        // The drive acts on body 1, which no sensor sees.
        let rate = rig.rate(y, [0.0; 2], around);
        for axis in 0..2 {
            for body in 0..2 {
                self.position[axis][body].push(y[4 * axis + body + 1]);
                self.acceleration[axis][body].push(rate[4 * axis + body + 9]);
            }
            self.force[axis].push(rig.shaft(axis, y));
        }
        self.joint.push(joint_of(y));
        for (series, force) in self.hidden.iter_mut().zip(rig.hidden_forces(y, around)) {
            series[0].push(force[0]);
            series[1].push(force[1]);
        }
    }

    /// The restoring force that perfect sensors would show, per axis.
    pub fn restoring_force(&self, rig: &Rig, axis: usize) -> Vec<f64> {
        let m = rig.chains[axis].inertia[1];
        let pairs = self.acceleration[axis][0].iter().zip(&self.force[axis]);
        pairs.map(|(a, f)| m * a - f).collect()
    }
}
