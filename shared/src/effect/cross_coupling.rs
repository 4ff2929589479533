//! A spring and a damper from one axis to the other: an arm off centre, a flexure that turns when
//! pushed.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_x = k_c·φ + c_c·φ̇: what the other axis's motion exerts on the own one.
pub(super) struct CrossCoupling;

impl Effect for CrossCoupling {
    const TAG: u8 = 18;

    const ABOUT: About = About {
        name: "cross_coupling",
        title: "spring and damper from the other axis",
        equation: "r_x = k_c·φ + c_c·φ̇",
        source: "off-diagonal terms of the stiffness and damping matrix: Lord Rayleigh, The Theory of Sound, vol. 1, 1877, §82",
        residual_signature: "the residual of one axis follows the displacement or the velocity of the other",
        separated_by: "Shake the other axis alone while this one is held: the force follows that motion; cross-talk follows the other \
                       force, also when nothing can move.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k_c",
                "force per displacement of the other axis",
                Dimension {
                    force: 1,
                    other_displacement: -1,
                    ..Dimension::NONE
                },
                false,
            ),
            Parameter::linear(
                "damping",
                "c_c",
                "force per velocity of the other axis",
                Dimension {
                    force: 1,
                    other_velocity: -1,
                    ..Dimension::NONE
                },
                false,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, damping, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let force = stiffness * at.other_displacement + damping * at.other_velocity;
        [force, S::zero()]
    }
}
