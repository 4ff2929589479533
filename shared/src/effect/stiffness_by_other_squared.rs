//! A spring whose stiffness follows the square of the other axis's displacement: an arm that
//! tightens when it is turned either way.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k₂·x·φ².
///
/// It is the force of the energy ½·k₂·x²·φ²; the same energy's moment k₂·x²·φ is the other axis's
/// `stiffness_by_other_squared`.
pub(super) struct StiffnessByOtherSquared;

impl Effect for StiffnessByOtherSquared {
    const TAG: u8 = 37;

    const ABOUT: About = About {
        name: "stiffness_by_other_squared",
        title: "stiffness with the square of the other axis's displacement",
        equation: "r = k₂·x·φ²",
        source: "second- and third-order terms of coupled oscillators: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, ch. 6",
        residual_signature: "the residual over x is a straight line that is steeper when φ is large on either side",
        separated_by: "A slow sweep of x at three held positions of φ: the slope at zero is the least.",
        parameters: &[Parameter::linear(
            "stiffness_curvature",
            "k₂",
            "stiffness per square of the displacement of the other axis",
            Dimension {
                force: 1,
                displacement: -1,
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
        [curvature * (at.displacement * square), S::zero()]
    }
}
