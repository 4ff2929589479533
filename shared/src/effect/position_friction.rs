//! Dry friction that differs from place to place: a guide that is tighter at one end, a seal that
//! wears in the middle.

use super::about::{About, Parameter, Role, Shape, Tie};
use super::coulomb::TRANSITION;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (F₁·x + F₂·x²)·tanh(ẋ/v_t): what friction changes by along the travel, beside dry friction
/// F_c at zero displacement.
pub(super) struct PositionFriction;

impl Effect for PositionFriction {
    const TAG: u8 = 41;

    const ABOUT: About = About {
        name: "position_friction",
        title: "dry friction that follows the displacement",
        equation: "r = (F₁·x + F₂·x²)·tanh(ẋ/v_t)",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083–1138, section on position dependence",
        residual_signature: "the residual jumps whenever the velocity changes its sign, by another amount at every place",
        separated_by: "Slow sweeps to and fro through the whole travel: half the difference of both forces is the friction at each place.",
        parameters: &[
            Parameter::linear(
                "friction_slope",
                "F₁",
                "friction force per displacement",
                Dimension::STIFFNESS,
                false,
            ),
            Parameter::linear(
                "friction_curvature",
                "F₂",
                "friction force per square of displacement",
                Dimension {
                    force: 1,
                    displacement: -2,
                    ..Dimension::NONE
                },
                false,
            ),
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
        &[slope, curvature, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let x = at.displacement;
        let size = slope * x + curvature * (x * x);
        [size * (at.velocity * per_transition).tanh(), S::zero()]
    }
}

/// The velocity within which dry friction changes its sign, where the model has it; friction that
/// only follows the place or the load of the contact changes its sign with it.
pub(super) const TRANSITION_OF_COULOMB: Shape = Shape {
    tie: Some(Tie {
        effect: "coulomb",
        parameter: "transition_velocity",
        other_axis: false,
    }),
    ..TRANSITION
};
