//! A damper whose strength follows the square of the other axis's displacement: a guide that binds
//! when the joint turns either way.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = c₂·ẋ·φ².
///
/// A positive strength takes energy out of the joint wherever it is.
pub(super) struct DampingByOtherSquared;

impl Effect for DampingByOtherSquared {
    const TAG: u8 = 39;

    const ABOUT: About = About {
        name: "damping_by_other_squared",
        title: "damping with the square of the other axis's displacement",
        equation: "r = c₂·ẋ·φ²",
        source: "second- and third-order terms of coupled oscillators: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, ch. 6",
        residual_signature: "the residual over ẋ is a straight line that is steeper when φ is large on either side",
        separated_by: "The same sweep of x at three held positions of φ: the damping at zero is the least.",
        parameters: &[Parameter::linear(
            "damping_curvature",
            "c₂",
            "damping per square of the displacement of the other axis",
            Dimension {
                force: 1,
                velocity: -1,
                other_displacement: -2,
                ..Dimension::NONE
            },
            false,
        )],
    };

    fn law<S: Scalar>(
        &[curvature, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let square = at.other_displacement * at.other_displacement;
        [curvature * (at.velocity * square), S::zero()]
    }
}
