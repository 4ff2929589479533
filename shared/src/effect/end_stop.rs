//! Stops near the ends of the motion: springs that are met only by the largest displacements.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k_u·max(x − d, 0) + k_l·min(x + d, 0).
///
/// The law is that of a clearance with a stiffness for either side; what sets it apart is where the
/// stops are searched for, so that a joint with free play in the middle and stops at its ends can
/// have both.
pub(super) struct EndStop;

impl Effect for EndStop {
    const TAG: u8 = 11;
    /// A contact on one side alone is one.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    const LOOKS_LIKE: &'static [&'static str] = &["clearance"];

    const ABOUT: About = About {
        name: "end_stop",
        title: "stops at the ends of the motion",
        equation: "r = k_u·max(x − d, 0) + k_l·min(x + d, 0)",
        source: "S. W. Shaw, P. J. Holmes, J. Sound and Vibration 90 (1983) 129–155 (piecewise linear oscillator)",
        residual_signature: "the residual is zero over most of the displacement and rises steeply at one or both ends",
        separated_by: "The same excitation at a smaller amplitude: below the stops it is gone altogether, where hardening only \
                       shrinks and free play stays.",
        parameters: &[
            Parameter::linear(
                "upper_stiffness",
                "k_u",
                "stiffness of the stop at positive displacement",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter::linear(
                "lower_stiffness",
                "k_l",
                "stiffness of the stop at negative displacement",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "distance",
                symbol: "d",
                meaning: "displacement at which either stop is met",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.4, 0.5, 0.6, 0.68, 0.75, 0.82, 0.88, 0.93, 0.97],
                    least: 0.3,
                    most: 0.999,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[upper, lower, distance, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let above = (at.displacement - distance).max(S::zero());
        let below = (at.displacement + distance).min(S::zero());
        [upper * above + lower * below, S::zero()]
    }
}
