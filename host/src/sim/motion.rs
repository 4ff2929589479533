//! How the rig moves: the equations of motion of the four bodies and their integration by Runge–Kutta steps.

use super::excitation::Excitation;
use super::joint::Contact;
use super::rig::{AxisParameters, RigParameters};
use nalgebra::SVector;

/// Seconds over which the drive rises from nothing at the beginning of a record.
pub const DRIVE_RAMP_S: f64 = 0.5;

/// Positions of bodies 1 to 4 (m), their rotations (rad), then the eight velocities in the same order.
pub type BodyState = SVector<f64, 16>;

/// How often a step may be cut at a stop before the rest of it is taken as it is; a real record needs two.
const MOST_CUTS: usize = 16;

/// The bodies and everything between them.
pub struct Bodies<'a> {
    /// The rig's parameters.
    pub parameters: &'a RigParameters,
}

impl Bodies<'_> {
    /// The joint's state [x, ẋ, φ, φ̇]: relative displacement and velocity of body 3 against body 2.
    pub fn joint_state(y: &BodyState) -> [f64; 4] {
        [y[2] - y[1], y[10] - y[9], y[6] - y[5], y[14] - y[13]]
    }

    fn axis_parameters(&self, axis: usize) -> &AxisParameters {
        if axis == 0 {
            &self.parameters.translation
        } else {
            &self.parameters.rotation
        }
    }

    /// What the shaft exerts on body 2, N or N·m.
    pub fn shaft_force(&self, axis: usize, y: &BodyState) -> f64 {
        let p = self.axis_parameters(axis);
        let i = 4 * axis;
        p.shaft_stiffness * (y[i] - y[i + 1]) + p.shaft_damping * (y[i + 8] - y[i + 9])
    }

    /// The time derivative of the state, with the joint's contacts held as given.
    pub fn derivative(&self, y: &BodyState, contacts: [Contact; 2], drive: [f64; 2]) -> BodyState {
        let joint = self
            .parameters
            .joint
            .force_with(Self::joint_state(y), contacts);
        let mut rate = BodyState::zeros();
        for axis in 0..2 {
            let p = self.axis_parameters(axis);
            let i = 4 * axis;
            let v = i + 8;
            let shaft = self.shaft_force(axis, y);
            let far =
                p.far_stiffness * (y[i + 3] - y[i + 2]) + p.far_damping * (y[v + 3] - y[v + 2]);
            let ground = p.ground_stiffness * y[i + 3] + p.ground_damping * y[v + 3];
            for body in 0..4 {
                rate[i + body] = y[v + body];
            }
            rate[v] = (drive[axis] - shaft) / p.inertia[0];
            rate[v + 1] = (shaft + joint[axis]) / p.inertia[1];
            rate[v + 2] = (far - joint[axis]) / p.inertia[2];
            rate[v + 3] = -(far + ground) / p.inertia[3];
        }
        rate
    }

    fn contacts(&self, y: &BodyState) -> [Contact; 2] {
        self.parameters.joint.contacts(Self::joint_state(y))
    }

    /// One classical fourth-order Runge–Kutta step with the contacts held.
    fn step(
        &self,
        y: &BodyState,
        contacts: [Contact; 2],
        drive: &[Excitation; 2],
        time_s: f64,
        step_s: f64,
    ) -> BodyState {
        let at = |t: f64| [drive[0].at(t), drive[1].at(t)];
        let (start, middle, end) = (at(time_s), at(time_s + 0.5 * step_s), at(time_s + step_s));
        let k1 = self.derivative(y, contacts, start);
        let k2 = self.derivative(&(y + 0.5 * step_s * k1), contacts, middle);
        let k3 = self.derivative(&(y + 0.5 * step_s * k2), contacts, middle);
        let k4 = self.derivative(&(y + step_s * k3), contacts, end);
        y + step_s / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    }

    /// Moves the state on by one step of fixed length. Where a stop is met or left inside the step, the
    /// step is cut there: the force law has a corner (and the coupling a jump) at the stop, and a step
    /// across it would be of first order only.
    fn advance(&self, y: &mut BodyState, drive: &[Excitation; 2], time_s: f64, step_s: f64) {
        let mut contacts = self.contacts(y);
        let mut done = 0.0;
        for _ in 0..MOST_CUTS {
            let rest = step_s - done;
            let whole = self.step(y, contacts, drive, time_s + done, rest);
            if self.contacts(&whole) == contacts {
                *y = whole;
                return;
            }
            let (mut before, mut after) = (0.0, rest);
            let mut crossed = whole;
            for _ in 0..40 {
                let middle = 0.5 * (before + after);
                let state = self.step(y, contacts, drive, time_s + done, middle);
                if self.contacts(&state) == contacts {
                    before = middle;
                } else {
                    (after, crossed) = (middle, state);
                }
            }
            *y = crossed;
            contacts = self.contacts(y);
            done += after;
            if done >= step_s {
                return;
            }
        }
        *y = self.step(y, contacts, drive, time_s + done, step_s - done);
    }

    /// The state at every row of a record that begins at rest, `substeps` equal steps per row.
    pub(super) fn run(
        &self,
        drive: &[Excitation; 2],
        rows: usize,
        sample_rate_hz: f64,
        substeps: usize,
    ) -> Vec<BodyState> {
        let step_s = 1.0 / (sample_rate_hz * substeps as f64);
        let mut y = BodyState::zeros();
        let mut states = Vec::with_capacity(rows);
        for row in 0..rows {
            states.push(y);
            for sub in 0..substeps {
                let time_s = row as f64 / sample_rate_hz + sub as f64 * step_s;
                self.advance(&mut y, drive, time_s, step_s);
            }
        }
        states
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Joint;

    fn drives(rows: usize, seed: u64, rms: [f64; 2]) -> [Excitation; 2] {
        [0, 1]
            .map(|i| Excitation::broadband(rows, 2000.0, [2.0, 60.0], rms[i], 0.1, seed + i as u64))
    }

    /// Root mean square of the difference of two runs' joint displacements over that of the first.
    fn relative_difference(a: &[BodyState], b: &[BodyState], input: usize) -> f64 {
        let (mut difference, mut size) = (0.0, 0.0);
        for (p, q) in a.iter().zip(b) {
            let (p, q) = (Bodies::joint_state(p)[input], Bodies::joint_state(q)[input]);
            difference += (p - q) * (p - q);
            size += p * p;
        }
        (difference / size).sqrt()
    }

    #[test]
    fn halving_the_step_changes_nothing_that_matters() {
        let parameters = RigParameters::default();
        let bodies = Bodies {
            parameters: &parameters,
        };
        let drive = drives(20_000, 3, [32.0, 1.4]);
        let coarse = bodies.run(&drive, 20_000, 2000.0, crate::sim::simulation::SUBSTEPS);
        let fine = bodies.run(&drive, 20_000, 2000.0, 2 * crate::sim::simulation::SUBSTEPS);
        for input in 0..4 {
            let change = relative_difference(&coarse, &fine, input);
            println!("input {input}: halving the step changes {change:.1e}");
            assert!(change < 1e-6, "input {input} changed by {change:e}");
        }
    }

    #[test]
    fn without_drive_or_damping_the_energy_stays() {
        let mut parameters = RigParameters::default();
        for axis in [&mut parameters.translation, &mut parameters.rotation] {
            axis.shaft_damping = 0.0;
            axis.far_damping = 0.0;
            axis.ground_damping = 0.0;
        }
        parameters.joint = Joint {
            damping: [0.0; 2],
            coupling: [0.0; 2],
            ..parameters.joint
        };
        let bodies = Bodies {
            parameters: &parameters,
        };
        let energy = |y: &BodyState| {
            let joint = &parameters.joint;
            let mut sum = 0.0;
            for (axis, p) in [&parameters.translation, &parameters.rotation]
                .iter()
                .enumerate()
            {
                let i = 4 * axis;
                let relative = y[i + 2] - y[i + 1];
                let pressed = (relative.abs() - joint.clearance[axis]).max(0.0);
                sum += (0..4)
                    .map(|b| 0.5 * p.inertia[b] * y[i + b + 8].powi(2))
                    .sum::<f64>()
                    + 0.5 * p.shaft_stiffness * (y[i] - y[i + 1]).powi(2)
                    + 0.5 * p.far_stiffness * (y[i + 3] - y[i + 2]).powi(2)
                    + 0.5 * p.ground_stiffness * y[i + 3].powi(2)
                    + 0.5 * joint.stiffness[axis] * relative.powi(2)
                    + 0.5 * joint.contact_stiffness[axis] * pressed.powi(2);
            }
            sum
        };
        let drive = drives(4000, 0, [0.0; 2]);
        let mut y = BodyState::zeros();
        y[2] = 0.004;
        y[14] = 5.0;
        let start = energy(&y);
        for i in 0..20_000 {
            bodies.advance(&mut y, &drive, f64::from(i) * 1.25e-4, 1.25e-4);
        }
        let drift = (energy(&y) / start - 1.0).abs();
        assert!(drift < 1e-5, "energy drifted by {drift:e}");
    }

    #[test]
    fn an_axis_that_is_not_driven_stays_at_rest() {
        let parameters = RigParameters::default();
        let bodies = Bodies {
            parameters: &parameters,
        };
        let states = bodies.run(&drives(3000, 5, [40.0, 0.0]), 3000, 2000.0, 2);
        assert!(states.iter().all(|y| y[6] == 0.0 && y[14] == 0.0));
        assert!(states.iter().any(|y| y[2] != 0.0));
    }
}
