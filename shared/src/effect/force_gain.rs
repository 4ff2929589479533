//! A wrong calibration of the force channel: every force is read too large or too small by the same
//! share.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = g·s·F: the true force is (1 − g)·F.
pub(super) struct ForceGain;

impl Effect for ForceGain {
    const TAG: u8 = 21;
    const LOOKS_LIKE: &'static [&'static str] = &["inertia_error"];
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;

    const NEVER_WITH: &'static [&'static str] = &["inertia_error"];
    const ABOUT: About = About {
        name: "force_gain",
        title: "wrong gain of the force channel",
        equation: "r_measured − r = g·s·F, s = ±1 as r = s·(F − m·a)",
        source: "calibration of a force channel",
        residual_signature: "the residual follows the applied force",
        separated_by: "Load the force channel with a known weight. From motion alone a wrong inertia differs only well below the resonance.",
        parameters: &[Parameter::linear(
            "excess",
            "g",
            "share of the reading that is too much",
            Dimension::NONE,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[excess, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [excess * at.instrument.force, S::zero()]
    }
}
