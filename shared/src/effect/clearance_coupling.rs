//! Friction in the contact of one axis that depends on where the other axis is: the paper's Eq.
//! (16).

use super::about::{About, Parameter, Role, Shape, Tie};
use super::clearance::GAP;
use super::{Acts, Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r_x = −⅓·(a·ẋ·φ·[|x| ≥ d_x] + b·φ̇·x·[|φ| ≥ d_φ]), and the same products with a′ and b′ on φ.
pub(super) struct ClearanceCoupling;

const fn coefficient(
    name: &'static str,
    symbol: &'static str,
    meaning: &'static str,
    dimension: Dimension,
) -> Parameter {
    Parameter::linear(name, symbol, meaning, dimension, false)
}

const fn gap(
    name: &'static str,
    symbol: &'static str,
    meaning: &'static str,
    dimension: Dimension,
    other_axis: bool,
) -> Parameter {
    Parameter {
        name,
        symbol,
        meaning,
        dimension,
        role: Role::Shape(Shape {
            tie: Some(Tie {
                effect: "clearance",
                parameter: "gap",
                other_axis,
            }),
            ..GAP
        }),
    }
}

impl Effect for ClearanceCoupling {
    const TAG: u8 = 4;
    const ACTS: Acts = Acts::BothAxes;

    const ABOUT: About = About {
        name: "clearance_coupling",
        title: "coupling of two axes through their stops",
        equation: "r_x = −⅓·(a·ẋ·φ·[|x| ≥ d_x] + b·φ̇·x·[|φ| ≥ d_φ]), r_φ = −⅓·(a′·ẋ·φ·[|x| ≥ d_x] + b′·φ̇·x·[|φ| ≥ d_φ])",
        source: "F. Tasbihgoo, J. P. Caffrey, S. F. Masri, Int. J. Non-Linear Mechanics 42 (2007), Eq. (16)",
        residual_signature: "the residual grows when both axes move and vanishes when either rests",
        separated_by: "One record with each axis shaken alone and one with both: only the last shows it.",
        parameters: &[
            coefficient(
                "force_first",
                "a",
                "force on the first axis from its own stop",
                Dimension {
                    force: 1,
                    velocity: -1,
                    other_displacement: -1,
                    ..Dimension::NONE
                },
            ),
            coefficient(
                "force_second",
                "b",
                "force on the first axis from the second axis's stop",
                Dimension {
                    force: 1,
                    displacement: -1,
                    other_velocity: -1,
                    ..Dimension::NONE
                },
            ),
            coefficient(
                "moment_first",
                "a′",
                "force on the second axis from the first axis's stop",
                Dimension {
                    other_force: 1,
                    velocity: -1,
                    other_displacement: -1,
                    ..Dimension::NONE
                },
            ),
            coefficient(
                "moment_second",
                "b′",
                "force on the second axis from its own stop",
                Dimension {
                    other_force: 1,
                    displacement: -1,
                    other_velocity: -1,
                    ..Dimension::NONE
                },
            ),
            gap(
                "gap_first",
                "d_x",
                "half the free play of the first axis",
                Dimension::DISPLACEMENT,
                false,
            ),
            gap(
                "gap_second",
                "d_φ",
                "half the free play of the second axis",
                Dimension {
                    other_displacement: 1,
                    ..Dimension::NONE
                },
                true,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[a, b, c, d, gap, other_gap]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let third = S::ratio(-1, 3);
        let first =
            third * at.velocity * at.other_displacement * at.displacement.abs().heaviside(gap);
        let second = third
            * at.other_velocity
            * at.displacement
            * at.other_displacement.abs().heaviside(other_gap);
        [a * first + b * second, c * first + d * second]
    }
}
