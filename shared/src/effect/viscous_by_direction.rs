//! A damper with a strength per direction, like a shock absorber that rebounds slower than it is
//! compressed.

use super::about::About;
use super::by_direction::{split, strength};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = c₊·max(ẋ, 0) + c₋·min(ẋ, 0).
pub(super) struct ViscousByDirection;

impl Effect for ViscousByDirection {
    const TAG: u8 = 26;
    const REPLACES: &'static [&'static str] = &["viscous"];

    const ABOUT: About = About {
        name: "viscous_by_direction",
        title: "viscous damper with a strength per direction",
        equation: "r = c₊·max(ẋ, 0) + c₋·min(ẋ, 0)",
        source: "J. C. Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: bump and rebound coefficients",
        residual_signature: "the residual over the velocity is two straight lines that meet at rest",
        separated_by: "Sweeps at several speeds in both directions: two straight lines through rest; quadratic drag bends, unequal dry \
                       friction jumps at rest.",
        parameters: &[
            strength(
                "damping_forward",
                "c₊",
                "force per velocity while the displacement grows",
                Dimension::DAMPING,
            ),
            strength(
                "damping_backward",
                "c₋",
                "force per velocity while the displacement falls",
                Dimension::DAMPING,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[forward, backward, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [split(at.velocity, forward, backward), S::zero()]
    }
}
