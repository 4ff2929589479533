//! Dry friction that repeats with the displacement: a screw that is not straight, a gear whose
//! teeth differ, balls that enter a race.

use super::about::{About, Parameter, Role};
use super::cogging::Cogging;
use super::position_friction::TRANSITION_OF_COULOMB;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (A·sin(2πx/p) + B·cos(2πx/p))·tanh(ẋ/v_t): what friction changes by along a pitch, beside
/// dry friction.
pub(super) struct PeriodicFriction;

impl Effect for PeriodicFriction {
    const TAG: u8 = 47;

    /// Friction that does not repeat within the travel only follows the place.
    const NOT_AT_MOST: &'static [usize] = &[2];

    const ABOUT: About = About {
        name: "periodic_friction",
        title: "dry friction that repeats with the displacement",
        equation: "r = (A·sin(2πx/p) + B·cos(2πx/p))·tanh(ẋ/v_t)",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083–1138, section on position dependence",
        residual_signature: "the residual is a wave over the displacement whose sign turns with the velocity's",
        separated_by: "Slow sweeps to and fro: friction's wave turns its sign with the direction, cogging's does not.",
        parameters: &[
            Parameter::linear(
                "sine",
                "A",
                "amplitude of the part of friction that does not change at zero displacement",
                Dimension::FORCE,
                false,
            ),
            Parameter::linear(
                "cosine",
                "B",
                "amplitude of the part of friction that is largest at zero displacement",
                Dimension::FORCE,
                false,
            ),
            Cogging::ABOUT.parameters[2],
            Parameter {
                name: "transition_velocity",
                symbol: "v_t",
                meaning: "velocity at which 76 % of the friction force is reached",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(TRANSITION_OF_COULOMB),
            },
        ],
    };

    fn law<S: Scalar>(
        &[sine, cosine, pitch, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let none = S::zero();
        let [wave, other] = Cogging::law(&[sine, cosine, pitch, none, none, none], at, states);
        [wave * (at.velocity * per_transition).tanh(), other]
    }
}
