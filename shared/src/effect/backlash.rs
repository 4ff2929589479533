//! A spring behind a lost motion: a gear or a linkage that follows only after its play is taken up,
//! at any place.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·(x − y) with y ← y + Δx held between −d and d: the play operator, what the displacement
/// leaves beyond the stop operator.
pub(super) struct Backlash;

impl Effect for Backlash {
    const TAG: u8 = 49;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Displacement(2)];
    // The state is that of a Jenkins element.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);

    const ABOUT: About = About {
        name: "backlash",
        title: "spring behind a lost motion (play operator)",
        equation: "r = k·(x − y), y ← y + Δx held within ±d",
        source: "M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, ch. 2",
        residual_signature: "the residual over the displacement is a parallelogram with horizontal ends and sloping sides",
        separated_by: "Slow reversals at several places: the force stays after each for the same travel 2·d; free play between stops has \
                       its flat part at one place only.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "stiffness of the spring behind the play",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "play",
                symbol: "d",
                meaning: "half the lost motion",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.01, 0.03, 0.08, 0.2, 0.45, 0.8],
                    least: 1e-3,
                    most: 1.9,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, play, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [taken_up, ..]: &mut States<S>,
    ) -> [S; 2] {
        *taken_up = (*taken_up + at.step).within(play);
        [stiffness * (at.displacement - *taken_up), S::zero()]
    }
}
