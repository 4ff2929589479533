//! A joint that is stiffer in one direction than in the other, like a bolted flange that opens
//! under tension.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k_b·max(x, 0): what the stiffness at positive displacement exceeds that at negative
/// displacement by.
///
/// Beside a linear spring k the two sides have k + k_b and k; a symmetric part of its own would be
/// the spring once more.
pub(super) struct Bilinear;

impl Effect for Bilinear {
    const TAG: u8 = 10;

    const ABOUT: About = About {
        name: "bilinear",
        title: "stiffness that differs between push and pull",
        equation: "r = k_b·max(x, 0)",
        source: "S. W. Shaw, P. J. Holmes, J. Sound and Vibration 90 (1983) 129–155; for opening cracks S. M. Cheng et al., J. Sound and Vibration 225 (1999) 201–208",
        residual_signature: "the residual over the displacement is a V: two straight lines that meet at rest",
        separated_by: "A slow push and pull from rest: two straight lines with a corner at zero; a preload shifts, and stops have their \
                       corner elsewhere.",
        parameters: &[Parameter::linear(
            "stiffness_difference",
            "k_b",
            "stiffness at positive displacement minus that at negative displacement",
            Dimension::STIFFNESS,
            false,
        )],
    };

    fn law<S: Scalar>(
        &[difference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [difference * at.displacement.max(S::zero()), S::zero()]
    }
}
