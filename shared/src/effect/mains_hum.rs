//! Mains hum: the force channel's wiring picks up the mains, whose line then stands in the force
//! whatever the joint does.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States, Subsystem};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_measured − r = A·sin(2π(f·t + p)), with A and p another one in every record.
pub(super) struct MainsHum;

impl Effect for MainsHum {
    const TAG: u8 = 24;
    const SUBSYSTEM: Subsystem = Subsystem::Sensor;

    const ABOUT: About = About {
        name: "mains_hum",
        title: "mains hum in the force channel",
        equation: "r_measured − r = A·sin(2π(f·t + p)), A and p found in every record anew",
        source: "pick-up of mains wiring; H. W. Ott, Noise Reduction Techniques in Electronic Systems, Wiley 1988, ch. 2",
        residual_signature: "the residual holds a narrow line near 50 or 60 Hz of the same size in every record, at rest too",
        separated_by: "Log with the drive switched off: the line stays. A resonance or cogging changes with the motion.",
        parameters: &[
            Parameter {
                name: "amplitude",
                symbol: "A",
                meaning: "amplitude of the line, root mean square over the records",
                dimension: Dimension::FORCE,
                role: Role::SizePerRecord { with_phase: true },
            },
            Parameter {
                name: "frequency",
                symbol: "f",
                meaning: "frequency of the line",
                dimension: Dimension::TIME.inverse(),
                role: Role::Shape(Shape {
                    // What the grids of the world are held to; the spectrum of the residual says
                    // where in their neighbourhood.
                    starts: &[50.0, 60.0],
                    least: 10.0,
                    most: 1000.0,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[amplitude, frequency, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let turns = frequency * at.instrument.time + at.instrument.phase;
        [amplitude * turns.sine(), S::zero()]
    }
}
