//! The weight of a body that turns about an axis that is not vertical: a pendulum, an arm, an
//! unbalanced rotor.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;
use core::f64::consts::TAU;

/// r = A·sin q + B·cos q = m·g·l·sin(q − q₀), for an axis of rotation.
///
/// m·g·l is √(A² + B²) and q₀ the angle of rest, −atan2(B, A). A pitch that is given, one turn, is
/// what sets it apart from cogging.
pub(super) struct Gravity;

impl Effect for Gravity {
    const TAG: u8 = 40;
    const IN_SI: &'static [usize] = &[2];

    const ABOUT: About = About {
        name: "gravity",
        title: "weight of a body that turns (pendulum)",
        equation: "r = A·sin(2πq/p) + B·cos(2πq/p) = m·g·l·sin(q − q₀), p = 2π rad",
        source: "C. Huygens, Horologium oscillatorium, 1673; statics",
        residual_signature: "the residual over the angle is part of a sine with a period of one turn",
        separated_by: "The rig turned by a quarter: the angle of rest turns with it, where a spring's and cogging's stay with the joint.",
        parameters: &[
            Parameter::linear(
                "sine",
                "A",
                "moment of the weight at a quarter turn from zero angle: m·g·l·cos q₀",
                Dimension::FORCE,
                false,
            ),
            Parameter::linear(
                "cosine",
                "B",
                "moment of the weight at zero angle: −m·g·l·sin q₀",
                Dimension::FORCE,
                false,
            ),
            Parameter {
                name: "turn",
                symbol: "p",
                meaning: "one turn, 2π rad; given, not found",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape::given(&[TAU])),
            },
        ],
    };

    fn law<S: Scalar>(
        &[sine, cosine, per_turn, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let turns = at.displacement * per_turn;
        let force = sine * turns.sine() + cosine * (turns + S::ratio(1, 4)).sine();
        [force, S::zero()]
    }
}
