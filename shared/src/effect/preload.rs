//! A constant force: a preloaded spring, a weight, or an offset of the force channel.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₀.
pub(super) struct Preload;

impl Effect for Preload {
    const TAG: u8 = 7;

    const ABOUT: About = About {
        name: "preload",
        title: "constant force",
        equation: "r = F₀",
        source: "statics",
        residual_signature: "the residual has a mean that is not zero",
        separated_by: "Unload the joint and read the force channel: an offset of the instrument stays, a preload goes.",
        parameters: &[Parameter::linear(
            "force",
            "F₀",
            "the force",
            Dimension::FORCE,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[force, ..]: &Parameters<S>,
        _: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [force, S::zero()]
    }
}
