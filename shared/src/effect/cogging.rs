//! A force that repeats with the displacement: magnets passing teeth, a bent screw, balls entering
//! a race.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = A·sin(2πx/p) + B·cos(2πx/p).
pub(super) struct Cogging;

/// Half as many pitches in the largest displacement as the number says: two neighbours differ by
/// half a wave at the end of the motion, so that no pitch lies between two valleys.
pub(super) const PITCHES: [f64; 40] = {
    let mut pitches = [0.0; 40];
    let mut at = 0;
    while at < pitches.len() {
        pitches[at] = 2.0 / (pitches.len() - at) as f64;
        at += 1;
    }
    pitches
};

impl Effect for Cogging {
    const TAG: u8 = 17;

    /// A force that does not repeat within the travel is a spring that bends.
    const NOT_AT_MOST: &'static [usize] = &[2];

    const ABOUT: About = About {
        name: "cogging",
        title: "force that repeats with the displacement (cogging)",
        equation: "r = A·sin(2πx/p) + B·cos(2πx/p)",
        source: "for permanent magnet motors J. De La Ree, N. Boules, IEEE Trans. Industry Applications 25 (1989) 107–112",
        residual_signature: "the residual over the displacement is a wave of constant size",
        separated_by: "A slow sweep at constant speed: its frequency follows the speed, where mains hum stays. Over more than a pitch it \
                       repeats, where springs that bend go on rising.",
        parameters: &[
            Parameter::linear(
                "sine",
                "A",
                "amplitude of the part that is zero at zero displacement",
                Dimension::FORCE,
                false,
            ),
            Parameter::linear(
                "cosine",
                "B",
                "amplitude of the part that is largest at zero displacement",
                Dimension::FORCE,
                false,
            ),
            Parameter {
                name: "pitch",
                symbol: "p",
                meaning: "displacement after which the force repeats",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &PITCHES,
                    // Each bit of the displacement is a thousand times as much of a turn, still
                    // below what a sensor resolves.
                    least: 0.001,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[sine, cosine, per_pitch, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let turns = at.displacement * per_pitch;
        let force = sine * turns.sine() + cosine * (turns + S::ratio(1, 4)).sine();
        [force, S::zero()]
    }
}
