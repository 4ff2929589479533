//! The joint between bodies 2 and 3: springs, dampers, clearances and the coupling of the paper's
//! Eq. (16).

use serde::{Deserialize, Serialize};

/// On which side of its clearance an axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Against the stop at −clearance.
    Below,
    /// Free between the stops.
    Inside,
    /// Against the stop at +clearance.
    Above,
}

impl Contact {
    /// Where a relative displacement lies: the stops belong to the contact (|x| ≥ d).
    pub fn of(displacement: f64, clearance: f64) -> Self {
        if displacement >= clearance {
            Self::Above
        } else if displacement <= -clearance {
            Self::Below
        } else {
            Self::Inside
        }
    }

    /// How far the stop is pressed in, signed; 0 inside the clearance.
    fn indentation(self, displacement: f64, clearance: f64) -> f64 {
        match self {
            Self::Below => displacement + clearance,
            Self::Inside => 0.0,
            Self::Above => displacement - clearance,
        }
    }

    /// 1 in contact, 0 inside the clearance.
    fn touching(self) -> f64 {
        f64::from(u8::from(self != Self::Inside))
    }
}

/// Whatever takes the joint's place between two bodies: its own law, or a model of it; `S` is the
/// kind of number that moves.
pub trait JointLaw<S = f64> {
    /// On which side of its clearance each axis is; a law without corners is always inside.
    fn contacts(&self, _state: [S; 4]) -> [Contact; 2] {
        [Contact::Inside; 2]
    }

    /// What the inputs of the study are from now on, in the order of [`ModelFile::input_names`]; a
    /// law of the motion alone has nothing to do.
    ///
    /// [`ModelFile::input_names`]: crate::model::file::ModelFile::input_names
    fn follow(&mut self, _inputs: &[f64]) {}

    /// What the joint exerts on the body whose force was logged [N, N·m] at the state [x, ẋ, φ, φ̇]
    /// (SI), with the contacts held as given.
    fn force(&self, state: [S; 4], contacts: [Contact; 2]) -> [S; 2];

    /// Moves internal states on after an accepted step of `step_s` seconds that ended at `state`; a
    /// law without memory has nothing to do.
    fn advance(&mut self, _state: [S; 4], _step_s: f64) {}
}

impl JointLaw for Joint {
    fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        Joint::contacts(self, state)
    }

    fn force(&self, state: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        self.force_with(state, contacts)
    }
}

/// The joint's force law; arrays hold the translation first, the rotation second.
///
/// With relative displacement x = x₃ − x₂ and rotation φ = φ₃ − φ₂, the force on body 2 is
///
/// r₁ = kₓ·x + cₓ·ẋ + κₓ·dz(x, dₓ) + g and r₂ = k_φ·φ + c_φ·φ̇ + κ_φ·dz(φ, d_φ) + ℓ·g,
///
/// where dz(x, d) is 0 for |x| < d and x ∓ d outside. The printed Eq. (16) has lost its dots; read
/// here as g = −⅓·k₀ₓ·ẋ·φ where |x| ≥ dₓ, plus −⅓·k₀φ·φ̇·x where |φ| ≥ d_φ: a friction that depends
/// on velocity and position and is there only when both axes move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Spring through the whole range, N/m and N·m/rad.
    pub stiffness: [f64; 2],
    /// Viscous damper, N·s/m and N·m·s/rad.
    pub damping: [f64; 2],
    /// Half the free play, m and rad.
    pub clearance: [f64; 2],
    /// Stiffness that the stops add outside the free play, N/m and N·m/rad.
    pub contact_stiffness: [f64; 2],
    /// k₀ₓ and k₀φ of Eq. (16), both N·s/(m·rad).
    pub coupling: [f64; 2],
    /// Arm ℓ through which the coupling force turns the body, m.
    pub lever_arm_m: f64,
}

impl Joint {
    /// The restoring force [N, N·m] on body 2 at the state [x, ẋ, φ, φ̇] (m, m/s, rad, rad/s).
    pub fn restoring_force(&self, state: [f64; 4]) -> [f64; 2] {
        self.force_with(state, self.contacts(state))
    }

    /// On which side of its clearance each axis is.
    pub fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        [
            Contact::of(state[0], self.clearance[0]),
            Contact::of(state[2], self.clearance[1]),
        ]
    }

    /// The force law with the contacts held as given: smooth, so that an integration step which
    /// does not cross a stop keeps its full order.
    pub fn force_with(&self, [x, v, phi, omega]: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        let coupling = -(self.coupling[0] * v * phi * contacts[0].touching()
            + self.coupling[1] * omega * x * contacts[1].touching())
            / 3.0;
        let axis = |i: usize, displacement: f64, velocity: f64| {
            self.stiffness[i] * displacement
                + self.damping[i] * velocity
                + self.contact_stiffness[i]
                    * contacts[i].indentation(displacement, self.clearance[i])
        };
        [
            axis(0, x, v) + coupling,
            axis(1, phi, omega) + self.lever_arm_m * coupling,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::RigParameters;

    #[test]
    fn each_term_acts_where_equation_16_says() {
        let joint = Joint {
            stiffness: [0.0; 2],
            damping: [0.0; 2],
            contact_stiffness: [0.0; 2],
            ..RigParameters::default().joint
        };
        let [dx, dphi] = joint.clearance;
        let [k0x, k0phi] = joint.coupling;
        let force = |x: f64, phi: f64| joint.restoring_force([x, 0.2, phi, 3.0]);
        assert_eq!(force(0.5 * dx, 0.5 * dphi)[0], 0.0);
        let both = [2.0 * dx, -1.5 * dphi];
        let first = -k0x * 0.2 * both[1] / 3.0;
        let second = -k0phi * 3.0 * both[0] / 3.0;
        let r = force(both[0], both[1]);
        assert!((r[0] - (first + second)).abs() < 1e-12);
        assert!((r[1] - joint.lever_arm_m * (first + second)).abs() < 1e-12);
        // At the stop itself the coupling is there already.
        assert!((force(dx, 0.5 * dphi)[0] + k0x * 0.2 * 0.5 * dphi / 3.0).abs() < 1e-12);
    }

    #[test]
    fn the_stops_add_their_stiffness_only_outside_the_play() {
        let joint = Joint {
            coupling: [0.0; 2],
            ..RigParameters::default().joint
        };
        let d = joint.clearance[0];
        let at = |x: f64| joint.restoring_force([x, 0.0, 0.0, 0.0])[0];
        assert!((at(0.9 * d) - joint.stiffness[0] * 0.9 * d).abs() < 1e-12);
        let outside = joint.stiffness[0] * 3.0 * d + joint.contact_stiffness[0] * 2.0 * d;
        assert!((at(3.0 * d) - outside).abs() < 1e-12);
        assert_eq!(at(-3.0 * d), -at(3.0 * d));
    }
}
