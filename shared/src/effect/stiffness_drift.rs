//! A stiffness that drifts while a record runs: a bolt that works loose, rubber that warms up.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k̇·x·t, with t the time since the record began.
pub(super) struct StiffnessDrift;

impl Effect for StiffnessDrift {
    const TAG: u8 = 19;
    const SUBSYSTEM: Subsystem = Subsystem::TimeVaryingPlant;

    const ABOUT: About = About {
        name: "stiffness_drift",
        title: "stiffness that drifts with time",
        equation: "r = k̇·x·t, t since the record began",
        source: "first term of a Taylor series of a slowly changing stiffness in time",
        residual_signature: "the residual follows the displacement and grows (or shrinks and grows again) along the record",
        separated_by: "Repeat the record with half the drive: a drift with time stays, hardening falls. Repeat it after a pause: what \
                       warmed up begins anew, what worked loose goes on.",
        parameters: &[Parameter::linear(
            "drift",
            "k̇",
            "change of the stiffness per second",
            Dimension {
                force: 1,
                displacement: -1,
                time: -1,
                ..Dimension::NONE
            },
            false,
        )],
    };

    fn law<S: Scalar>(
        &[drift, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [drift * (at.displacement * at.instrument.time), S::zero()]
    }
}
