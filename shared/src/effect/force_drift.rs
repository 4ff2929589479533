//! Drift of the force channel: a bridge that warms up while a record runs, or a spring that is
//! stretched by a displacement that drifts.

use super::about::{About, Parameter, Role};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = F₀ + Ḟ·t, with t the time since the record began, and F₀ and Ḟ others in every
/// record.
pub(super) struct ForceDrift;

impl Effect for ForceDrift {
    const TAG: u8 = 53;
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;
    // Both are a drift of 0.
    const REPLACES: &'static [&'static str] = &["preload", "force_zero"];

    const ABOUT: About = About {
        name: "force_drift",
        title: "zero of the force channel that drifts during a record",
        equation: "r_measured − r = F₀ + Ḟ·t, t since the record began, F₀ and Ḟ found in every record anew",
        source: "thermal drift of bridges; K. Hoffmann, as for force_zero",
        residual_signature: "the residual rises or falls along each record, by another amount in each",
        separated_by: "Log the force with the joint at rest: a drift of the channel stays; one of the displacement goes.",
        parameters: &[
            Parameter {
                name: "zero",
                symbol: "F₀",
                meaning: "the force that is read at none when a record begins, root mean square over the records",
                dimension: Dimension::FORCE,
                role: Role::SizePerRecord { with_phase: false },
            },
            Parameter {
                name: "drift",
                symbol: "Ḟ",
                meaning: "its change per second, root mean square over the records",
                dimension: Dimension {
                    force: 1,
                    time: -1,
                    ..Dimension::NONE
                },
                role: Role::SizePerRecord { with_phase: false },
            },
        ],
    };

    fn law<S: Scalar>(
        &[zero, drift, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [zero + drift * at.instrument.time, S::zero()]
    }
}
