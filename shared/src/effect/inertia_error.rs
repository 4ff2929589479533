//! A wrong inertia in the study: part of the inertia force is taken for restoring force.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = Δm·s·a: with r = s·(F − m·a), an inertia that is stated too small by Δm leaves
/// this.
pub(super) struct InertiaError;

impl Effect for InertiaError {
    const TAG: u8 = 20;
    const LOOKS_LIKE: &'static [&'static str] = &["force_gain"];
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;

    const NEVER_WITH: &'static [&'static str] = &["force_gain"];
    const ABOUT: About = About {
        name: "inertia_error",
        title: "wrong inertia in the study",
        equation: "r_measured − r = Δm·s·a, s = ±1 as r = s·(F − m·a)",
        source: "equation of motion, Tasbihgoo, Caffrey, Masri 2007, Eqs. (8) and (9)",
        residual_signature: "the residual follows the acceleration, on every record and at every frequency alike",
        separated_by: "Weigh the body, or shake it with the joint taken out: force over acceleration is its inertia.",
        parameters: &[Parameter::linear(
            "inertia_error",
            "Δm",
            "true inertia minus the stated one",
            Dimension::INERTIA,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[missing, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [missing * at.instrument.acceleration, S::zero()]
    }
}
