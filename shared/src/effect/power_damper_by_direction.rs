//! A damper whose force follows a power of the velocity, with a strength per direction.

use super::about::About;
use super::by_direction::{split, strength};
use super::power_damper::PowerDamper;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(q, 0) + F₋·min(q, 0), where q is the force of `power_damper` with a strength of 1.
pub(super) struct PowerDamperByDirection;

impl Effect for PowerDamperByDirection {
    const TAG: u8 = 33;
    const REPLACES: &'static [&'static str] = &["power_damper"];

    const ABOUT: About = About {
        name: "power_damper_by_direction",
        title: "damper with a power of the velocity and a strength per direction",
        equation: "r = F₊·max(q, 0) + F₋·min(q, 0), q = |ẋ/v₁|ᵖ·sgn ẋ",
        source: "J. C. Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: bump and rebound",
        residual_signature: "the residual over the velocity bends everywhere, in one direction more than in the other",
        separated_by: "Sweeps at constant speeds in both directions, force over speed on logarithmic scales: two parallel straight lines.",
        parameters: &[
            strength(
                "force_forward",
                "F₊",
                "force at the reference velocity while the displacement grows",
                Dimension::FORCE,
            ),
            strength(
                "force_backward",
                "F₋",
                "force at the reference velocity while the displacement falls",
                Dimension::FORCE,
            ),
            PowerDamper::ABOUT.parameters[1],
            PowerDamper::ABOUT.parameters[2],
        ],
    };

    fn law<S: Scalar>(
        &[forward, backward, exponent, reference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let none = S::zero();
        let alike = [S::one(), exponent, reference, none, none, none];
        let [unit, other] = PowerDamper::law(&alike, at, states);
        [split(unit, forward, backward), other]
    }
}
