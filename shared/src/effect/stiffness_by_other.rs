//! A spring whose stiffness follows the other axis's displacement: an arm that turns out of line.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k₁·x·φ.
///
/// The strength may have either sign, as the spring's changes with the sign of φ.
pub(super) struct StiffnessByOther;

impl Effect for StiffnessByOther {
    const TAG: u8 = 36;

    const ABOUT: About = About {
        name: "stiffness_by_other",
        title: "stiffness in proportion to the other axis's displacement",
        equation: "r = k₁·x·φ",
        source: "second- and third-order terms of coupled oscillators: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, ch. 6",
        residual_signature: "the residual over x is a straight line whose slope follows φ, and vanishes where either axis is at zero",
        separated_by: "A slow sweep of x at three held positions of φ: the middle slope is halfway between the others; with a square it \
                       is the least or the largest.",
        parameters: &[Parameter::linear(
            "stiffness_slope",
            "k₁",
            "stiffness per displacement of the other axis",
            Dimension {
                force: 1,
                displacement: -1,
                other_displacement: -1,
                ..Dimension::NONE
            },
            false,
        )],
    };

    fn law<S: Scalar>(
        &[slope, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [slope * (at.displacement * at.other_displacement), S::zero()]
    }
}
