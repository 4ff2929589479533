//! Dry friction: a force of constant size against the motion.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F_c·tanh(ẋ/v_t): the sign of the velocity, rounded within ±v_t.
pub(super) struct Coulomb;

/// The search for the velocity within which friction changes its sign.
pub(super) const TRANSITION: Shape = Shape {
    starts: &[0.001, 0.003, 0.01, 0.03],
    least: 1e-4,
    most: 0.1,
    reciprocal: true,
    tie: None,
};

impl Effect for Coulomb {
    const TAG: u8 = 5;
    const LOOKS_LIKE: &'static [&'static str] = &["stribeck"];

    const ABOUT: About = About {
        name: "coulomb",
        title: "dry friction",
        equation: "r = F_c·tanh(ẋ/v_t)",
        source: "C. A. Coulomb, Théorie des machines simples, 1785; rounded at rest as usual in simulation",
        residual_signature: "the residual jumps between two values whenever the velocity changes its sign",
        separated_by: "Slow sweeps at several speeds: its force does not depend on speed (viscous), does not fall with it \
                       (Stribeck), and reverses at once, not after a travel (Jenkins, Dahl, Bouc–Wen).",
        parameters: &[
            Parameter::linear(
                "friction",
                "F_c",
                "friction force while sliding",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "transition_velocity",
                symbol: "v_t",
                meaning: "velocity at which 76 % of the friction force is reached",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(TRANSITION),
            },
        ],
    };

    fn law<S: Scalar>(
        &[friction, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [friction * (at.velocity * per_transition).tanh(), S::zero()]
    }
}
