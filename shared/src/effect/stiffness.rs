//! A spring through the whole range of motion.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·x.
pub(super) struct Stiffness;

impl Effect for Stiffness {
    const TAG: u8 = 1;

    const ABOUT: About = About {
        name: "stiffness",
        title: "linear spring",
        equation: "r = k·x",
        source: "R. Hooke, De potentia restitutiva, 1678",
        residual_signature: "the residual follows the displacement on a straight line",
        separated_by: "A slow push through the whole range: the force stays when the motion stops, unlike damping, and grows \
                       in proportion, unlike clearance and hardening.",
        parameters: &[Parameter::linear(
            "stiffness",
            "k",
            "force per displacement",
            Dimension::STIFFNESS,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[stiffness, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [stiffness * at.displacement, S::zero()]
    }
}
