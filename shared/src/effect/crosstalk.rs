//! Cross-talk between two force channels: a share of the other axis's force shows in this one's
//! reading.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = χ·s·F_other: the true force is F − χ·F_other.
pub(super) struct Crosstalk;

impl Effect for Crosstalk {
    const TAG: u8 = 23;
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;

    const ABOUT: About = About {
        name: "crosstalk",
        title: "cross-talk from the other force channel",
        equation: "r_measured − r = χ·s·F_other, s = ±1 as r = s·(F − m·a)",
        source: "cross sensitivity of a multi-component force sensor",
        residual_signature: "the residual follows the force on the other axis, also while this axis rests",
        separated_by: "Shake the other axis alone with the joint taken out: what this channel then reads is cross-talk.",
        parameters: &[Parameter::linear(
            "share",
            "χ",
            "reading of this channel per force on the other axis",
            Dimension {
                force: 1,
                other_force: -1,
                ..Dimension::NONE
            },
            false,
        )],
    };

    fn law<S: Scalar>(
        &[share, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [share * at.instrument.other_force, S::zero()]
    }
}
