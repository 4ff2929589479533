//! Dry friction that is larger at rest than in motion, as in lubricated contacts at low speed.

use super::about::{About, Parameter, Role, Shape};
use super::coulomb::TRANSITION;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (F_c + (F_s − F_c)·exp(−(ẋ/v_s)²))·tanh(ẋ/v_t).
pub(super) struct Stribeck;

/// The search for the velocity by which friction has fallen.
pub(super) const STRIBECK_VELOCITY: Shape = Shape {
    starts: &[0.01, 0.03, 0.1, 0.3],
    least: 2e-3,
    most: 1.0,
    reciprocal: true,
    tie: None,
};

/// exp(−(ẋ/v_s)²): how much of the friction at rest is left.
pub(super) fn left_of_rest<S: Scalar>(velocity: S, per_fall: S) -> S {
    (velocity * per_fall).gaussian()
}

impl Effect for Stribeck {
    const TAG: u8 = 8;
    const LOOKS_LIKE: &'static [&'static str] = &["coulomb"];

    /// Friction at rest is never less than in motion.
    const NEVER_LESS: &'static [(usize, usize)] = &[(1, 0)];
    const ABOUT: About = About {
        name: "stribeck",
        title: "dry friction that falls with speed (Stribeck)",
        equation: "r = (F_c + (F_s − F_c)·exp(−(ẋ/v_s)²))·tanh(ẋ/v_t)",
        source: "R. Stribeck, Z. VDI 46 (1902) 1341–1348; the exponential after L. C. Bo, D. Pavelescu, Wear 82 (1982) 277–289",
        residual_signature: "the residual jumps when the velocity changes its sign and is largest just after the jump",
        separated_by: "Sweeps at constant speed, from the slowest the drive can do: the force falls with speed before it rises; Coulomb's \
                       stays, viscous damping only rises.",
        parameters: &[
            Parameter::linear(
                "friction",
                "F_c",
                "friction force at high speed",
                Dimension::FORCE,
                true,
            ),
            Parameter::linear(
                "static_friction",
                "F_s",
                "friction force when motion begins",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "stribeck_velocity",
                symbol: "v_s",
                meaning: "velocity at which 37 % of the difference is left",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(STRIBECK_VELOCITY),
            },
            Parameter {
                name: "transition_velocity",
                symbol: "v_t",
                meaning: "velocity at which tanh reaches 76 %: friction changes its sign within it",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(TRANSITION),
            },
        ],
    };

    fn law<S: Scalar>(
        &[friction, at_rest, per_fall, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let left = left_of_rest(at.velocity, per_fall);
        let size = friction * (S::one() - left) + at_rest * left;
        [size * (at.velocity * per_transition).tanh(), S::zero()]
    }
}
