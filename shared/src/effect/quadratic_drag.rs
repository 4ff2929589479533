//! A fluid that is displaced: a force that grows with the square of the velocity.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = c₂·ẋ·|ẋ|.
pub(super) struct QuadraticDrag;

impl Effect for QuadraticDrag {
    const TAG: u8 = 9;

    const ABOUT: About = About {
        name: "quadratic_drag",
        title: "drag with the square of the velocity",
        equation: "r = c₂·ẋ·|ẋ|",
        source: "I. Newton, Principia, 1687, book II, section 2; for orifices of dampers J. C. Dixon, The Shock Absorber Handbook, 2007",
        residual_signature: "the residual over the velocity is bent, flat at rest and steep at high speed",
        separated_by: "The same sweep at half and at double speed: its force changes fourfold, that of a viscous damper twofold, and dry \
                       friction's stays.",
        parameters: &[Parameter::linear(
            "drag",
            "c₂",
            "force per square of velocity",
            Dimension {
                force: 1,
                velocity: -2,
                ..Dimension::NONE
            },
            true,
        )],
    };

    fn law<S: Scalar>(
        &[drag, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [drag * (at.velocity * at.velocity.abs()), S::zero()]
    }
}
