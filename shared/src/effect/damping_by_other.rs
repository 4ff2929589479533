//! A damper whose strength follows the other axis's displacement: a slot that opens when the joint
//! turns.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = c₁·ẋ·φ.
///
/// The strength may have either sign, as the damper's changes with the sign of φ.
pub(super) struct DampingByOther;

impl Effect for DampingByOther {
    const TAG: u8 = 38;

    const ABOUT: About = About {
        name: "damping_by_other",
        title: "damping in proportion to the other axis's displacement",
        equation: "r = c₁·ẋ·φ",
        source: "second- and third-order terms of coupled oscillators: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, ch. 6",
        residual_signature: "the residual over ẋ is a straight line whose slope follows φ",
        separated_by: "The same sweep of x at three held positions of φ: the middle damping is halfway between the others.",
        parameters: &[Parameter::linear(
            "damping_slope",
            "c₁",
            "damping per displacement of the other axis",
            Dimension {
                force: 1,
                velocity: -1,
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
        [slope * (at.velocity * at.other_displacement), S::zero()]
    }
}
