//! Zero of the force channel: a bridge that is not tared alike, or drifts between records, reads
//! another force at rest in each of them.

use super::about::{About, Parameter, Role};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = F₀, with F₀ another one in every record.
pub(super) struct ForceZero;

impl Effect for ForceZero {
    const TAG: u8 = 50;
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;
    // A preload is a zero that is the same in every record.
    const REPLACES: &'static [&'static str] = &["preload"];

    const ABOUT: About = About {
        name: "force_zero",
        title: "zero of the force channel that differs from record to record",
        equation: "r_measured − r = F₀, F₀ found in every record anew",
        source: "zero balance of strain-gauge bridges; K. Hoffmann, An Introduction to Measurements using Strain Gages, HBM 1989",
        residual_signature: "the residual has another mean in every record",
        separated_by: "Read the unloaded force channel before every record: a zero shows there, a preload of the joint does not.",
        parameters: &[Parameter {
            name: "zero",
            symbol: "F₀",
            meaning: "the force that is read at none, root mean square over the records",
            dimension: Dimension::FORCE,
            role: Role::SizePerRecord { with_phase: false },
        }],
    };

    fn law<S: Scalar>(&[zero, ..]: &Parameters<S>, _: &Kinematics<S>, _: &mut States<S>) -> [S; 2] {
        [zero, S::zero()]
    }
}
