//! Dry friction of a contact that the joint's own deflection presses together: ring springs, leaf
//! springs, wedges.

use super::about::{About, Parameter, Role};
use super::position_friction::TRANSITION_OF_COULOMB;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = μk·|x|·tanh(ẋ/v_t): friction μ times the load k·|x| of the spring that presses.
pub(super) struct LoadFriction;

impl Effect for LoadFriction {
    const TAG: u8 = 42;

    const ABOUT: About = About {
        name: "load_friction",
        title: "dry friction in proportion to the spring's load",
        equation: "r = μk·|x|·tanh(ẋ/v_t)",
        source: "Coulomb friction under the load of a spring; as hysteretic damping T. K. Caughey, A. Vijayaraghavan, Int. J. Non-Linear Mech. 5 (1970) 533–555",
        residual_signature: "the residual over the displacement is a bow tie: two triangles that meet at zero displacement",
        separated_by: "Slow cycles at several amplitudes: the energy of a cycle goes with the square of the amplitude at every frequency; \
                       dry friction's goes with the amplitude.",
        parameters: &[
            Parameter::linear(
                "friction_stiffness",
                "μk",
                "friction force per magnitude of displacement: coefficient of friction times stiffness of what presses",
                Dimension::STIFFNESS,
                true,
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
        &[stiffness, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let size = stiffness * at.displacement.abs();
        [size * (at.velocity * per_transition).tanh(), S::zero()]
    }
}
