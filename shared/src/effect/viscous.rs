//! A damper whose force is proportional to the velocity.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = c·ẋ.
pub(super) struct Viscous;

impl Effect for Viscous {
    const TAG: u8 = 2;

    const ABOUT: About = About {
        name: "viscous",
        title: "viscous damper",
        equation: "r = c·ẋ",
        source: "Lord Rayleigh, The Theory of Sound, vol. 1, 1877, §45",
        residual_signature: "the residual follows the velocity on a straight line",
        separated_by: "The same sweep at half and at double speed: its force halves and doubles; dry friction's stays, drag's \
                       changes fourfold.",
        parameters: &[Parameter::linear(
            "damping",
            "c",
            "force per velocity",
            Dimension::DAMPING,
            true,
        )],
    };

    fn law<S: Scalar>(
        &[damping, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [damping * at.velocity, S::zero()]
    }
}
