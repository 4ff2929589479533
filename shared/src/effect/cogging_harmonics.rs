//! A force that repeats with the displacement and is no sine: cogging of a linear motor, the wave
//! of a harmonic drive.

use super::about::{About, Parameter, Role, Shape};
use super::cogging::{Cogging, PITCHES};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = A·sin θ + B·cos θ + A₂·sin 2θ + B₂·cos 2θ with θ = 2πx/p.
pub(super) struct CoggingHarmonics;

impl Effect for CoggingHarmonics {
    const TAG: u8 = 60;
    const REPLACES: &'static [&'static str] = &["cogging"];
    /// Two waves that do not repeat within the travel are a spring of any shape.
    const NOT_AT_MOST: &'static [usize] = &[4];

    const ABOUT: About = About {
        name: "cogging_harmonics",
        title: "cogging with a second harmonic",
        equation: "r = A·sin θ + B·cos θ + A₂·sin 2θ + B₂·cos 2θ, θ = 2πx/p",
        source: "P. J. Hor, Z. Q. Zhu, D. Howe, J. Rees-Jones, IEEE Trans. Magnetics 34 (1998) 3544–3546",
        residual_signature: "the residual over the displacement is a wave of constant size that is no sine",
        separated_by: "A slow sweep over several pitches: its spectrum has a line and one at twice its frequency.",
        parameters: &[
            Parameter::linear("sine", "A", "amplitude of sin θ", Dimension::FORCE, false),
            Parameter::linear("cosine", "B", "amplitude of cos θ", Dimension::FORCE, false),
            Parameter::linear(
                "second_sine",
                "A₂",
                "amplitude of sin 2θ",
                Dimension::FORCE,
                false,
            ),
            Parameter::linear(
                "second_cosine",
                "B₂",
                "amplitude of cos 2θ",
                Dimension::FORCE,
                false,
            ),
            Parameter {
                role: Role::Shape(Shape {
                    // It repeats within the travel at least twice.
                    starts: PITCHES.split_at(38).0,
                    least: 0.002,
                    most: 1.0,
                    reciprocal: true,
                    tie: None,
                }),
                ..Cogging::ABOUT.parameters[2]
            },
        ],
    };

    fn law<S: Scalar>(
        &[sine, cosine, second_sine, second_cosine, per_pitch, _]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let turns = at.displacement * per_pitch;
        let (s, c) = (turns.sine(), (turns + S::ratio(1, 4)).sine());
        // sin 2θ = 2·s·c and cos 2θ = 1 − 2·s².
        let twice = s + s;
        let second = second_sine * (twice * c) + second_cosine * (S::one() - twice * s);
        [sine * s + cosine * c + second, S::zero()]
    }
}
