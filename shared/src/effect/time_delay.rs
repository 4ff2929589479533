//! A force channel that is late: an anti-alias filter, a slow bridge amplifier, a multiplexer.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = −τ·s·dF/dt: the true force is F(t + τ) ≈ F + τ·dF/dt.
pub(super) struct TimeDelay;

impl Effect for TimeDelay {
    const TAG: u8 = 22;
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;

    const ABOUT: About = About {
        name: "time_delay",
        title: "late force channel",
        equation: "r_measured − r = −τ·s·dF/dt, s = ±1 as r = s·(F − m·a)",
        source: "first order of the shift F(t + τ) of a channel in time",
        residual_signature: "the residual follows the derivative of the applied force: it looks like damping, or like inertia when the spring dominates",
        separated_by: "Tap the body with the joint taken out: force and acceleration must begin together.",
        parameters: &[Parameter::linear(
            "delay",
            "τ",
            "by how much the force channel is late (0.001 s is 1 ms)",
            Dimension::TIME,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[delay, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [-(delay * at.instrument.force_rate), S::zero()]
    }
}
