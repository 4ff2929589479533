//! How the rig moves: the equations of motion of the four bodies, with the joint or a model of it
//! between two of them.

use super::excitation::Excitation;
use super::integrate::{self, Equations};
use super::joint::{Contact, Joint, JointLaw};
use super::rig::{AxisParameters, RigParameters};
use nalgebra::SVector;

/// Seconds over which the drive rises from nothing at the beginning of a record.
pub const DRIVE_RAMP_S: f64 = 0.5;

/// Positions of bodies 1 to 4 (m), their rotations (rad), then the eight velocities in the same
/// order.
pub type BodyState = SVector<f64, 16>;

/// The bodies and everything between them.
pub struct Bodies<'a, L = Joint> {
    /// The rig's parameters; those of its joint count only when `joint` is made from them.
    pub parameters: &'a RigParameters,
    /// What stands between bodies 2 and 3.
    pub joint: L,
}

impl<'a> Bodies<'a> {
    /// The rig with its own joint.
    pub fn new(parameters: &'a RigParameters) -> Self {
        Self {
            parameters,
            joint: parameters.joint,
        }
    }
}

/// The joint's state [x, ẋ, φ, φ̇]: relative displacement and velocity of body 3 against body 2.
pub fn joint_state(y: &BodyState) -> [f64; 4] {
    [y[2] - y[1], y[10] - y[9], y[6] - y[5], y[14] - y[13]]
}

impl<L: JointLaw> Bodies<'_, L> {
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
        let joint = self.joint.force(joint_state(y), contacts);
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

    /// Moves the bodies on from one row of a record to the next, in `substeps` equal steps.
    pub fn next_row(
        &mut self,
        y: &mut BodyState,
        drive: &[Excitation; 2],
        row: usize,
        sample_rate_hz: f64,
        substeps: usize,
    ) {
        let step_s = 1.0 / (sample_rate_hz * substeps as f64);
        for sub in 0..substeps {
            let time_s = row as f64 / sample_rate_hz + sub as f64 * step_s;
            let shaken = Shaken {
                bodies: self,
                drive,
            };
            integrate::advance(&shaken, y, time_s, step_s);
            self.joint.advance(joint_state(y), step_s);
        }
    }

    /// The state at every row of a record that begins at rest, `substeps` equal steps per row.
    pub fn run(
        &mut self,
        drive: &[Excitation; 2],
        rows: usize,
        sample_rate_hz: f64,
        substeps: usize,
    ) -> Vec<BodyState> {
        let mut y = BodyState::zeros();
        let mut states = Vec::with_capacity(rows);
        for row in 0..rows {
            states.push(y);
            self.next_row(&mut y, drive, row, sample_rate_hz, substeps);
        }
        states
    }
}

/// The bodies under a drive.
struct Shaken<'a, 'b, L> {
    bodies: &'a Bodies<'b, L>,
    drive: &'a [Excitation; 2],
}

impl<L: JointLaw> Equations<16> for Shaken<'_, '_, L> {
    type Drive = [f64; 2];

    fn drive(&self, time_s: f64) -> [f64; 2] {
        [self.drive[0].at(time_s), self.drive[1].at(time_s)]
    }

    fn contacts(&self, y: &BodyState, _time_s: f64) -> [Contact; 2] {
        self.bodies.joint.contacts(joint_state(y))
    }

    fn rate(&self, y: &BodyState, contacts: [Contact; 2], drive: &[f64; 2]) -> BodyState {
        self.bodies.derivative(y, contacts, *drive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Joint;

    fn drives(rows: usize, seed: u64, rms: [f64; 2]) -> [Excitation; 2] {
        [0, 1]
            .map(|i| Excitation::broadband(rows, 2000.0, [2.0, 60.0], rms[i], 0.1, seed + i as u64))
    }

    /// Root mean square of the difference of two runs' joint displacements over that of the first.
    fn relative_difference(a: &[BodyState], b: &[BodyState], input: usize) -> f64 {
        let (mut difference, mut size) = (0.0, 0.0);
        for (p, q) in a.iter().zip(b) {
            let (p, q) = (joint_state(p)[input], joint_state(q)[input]);
            difference += (p - q) * (p - q);
            size += p * p;
        }
        (difference / size).sqrt()
    }

    #[test]
    fn halving_the_step_changes_nothing_that_matters() {
        let parameters = RigParameters::default();
        let mut bodies = Bodies::new(&parameters);
        let drive = drives(20_000, 3, [32.0, 1.4]);
        let coarse = bodies.run(
            &drive,
            20_000,
            2000.0,
            crate::simulate::simulation::SUBSTEPS,
        );
        let fine = bodies.run(
            &drive,
            20_000,
            2000.0,
            2 * crate::simulate::simulation::SUBSTEPS,
        );
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
        let mut bodies = Bodies::new(&parameters);
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
        for row in 0..20_000 {
            bodies.next_row(&mut y, &drive, row, 8000.0, 1);
        }
        let drift = (energy(&y) / start - 1.0).abs();
        assert!(drift < 1e-5, "energy drifted by {drift:e}");
    }

    #[test]
    fn an_axis_that_is_not_driven_stays_at_rest() {
        let parameters = RigParameters::default();
        let mut bodies = Bodies::new(&parameters);
        let states = bodies.run(&drives(3000, 5, [40.0, 0.0]), 3000, 2000.0, 2);
        assert!(states.iter().all(|y| y[6] == 0.0 && y[14] == 0.0));
        assert!(states.iter().any(|y| y[2] != 0.0));
    }
}
