//! A spring whose force follows a power of the displacement, with another strength for push than
//! for pull.

use super::about::About;
use super::by_direction::{split, strength};
use super::power_spring::PowerSpring;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(q, 0) + F₋·min(q, 0), where q is the force of `power_spring` with a strength of 1.
pub(super) struct PowerSpringByDirection;

impl Effect for PowerSpringByDirection {
    const TAG: u8 = 32;
    const REPLACES: &'static [&'static str] = &["power_spring"];

    const ABOUT: About = About {
        name: "power_spring_by_direction",
        title: "spring with a power of the displacement, with a strength per side",
        equation: "r = F₊·max(q, 0) + F₋·min(q, 0), q = |x/x₁|ᵖ·sgn x",
        source: "H. Hertz, J. reine angew. Math. 92 (1882) 156–171, for contacts on either side",
        residual_signature: "the residual over the displacement bends everywhere, on one side more than on the other",
        separated_by: "A slow push and a slow pull, force over displacement on logarithmic scales: two parallel straight lines.",
        parameters: &[
            strength(
                "force_above",
                "F₊",
                "force at the reference displacement",
                Dimension::FORCE,
            ),
            strength(
                "force_below",
                "F₋",
                "force against it at minus the reference displacement",
                Dimension::FORCE,
            ),
            PowerSpring::ABOUT.parameters[1],
            PowerSpring::ABOUT.parameters[2],
        ],
    };

    fn law<S: Scalar>(
        &[above, below, exponent, reference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let none = S::zero();
        let alike = [S::one(), exponent, reference, none, none, none];
        let [unit, other] = PowerSpring::law(&alike, at, states);
        [split(unit, above, below), other]
    }
}
