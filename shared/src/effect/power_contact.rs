//! Contacts on either side of a gap whose force follows a power of what they are pressed by, like
//! rubber buffers or balls.

use super::about::{About, Parameter, Role};
use super::by_direction::{split, strength};
use super::clearance::GAP;
use super::power_law::signed_power;
use super::power_spring::PowerSpring;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(q, 0) + F₋·min(q, 0) with q = |y/x₁|ᵖ·sgn y and y = dz(x, d).
pub(super) struct PowerContact;

impl Effect for PowerContact {
    const TAG: u8 = 48;
    /// A contact on one side alone is one.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    const LOOKS_LIKE: &'static [&'static str] = &["end_stop", "clearance"];

    const ABOUT: About = About {
        name: "power_contact",
        title: "contacts on either side of a gap, with a power of the penetration",
        equation: "r = F₊·max(q, 0) + F₋·min(q, 0), q = |y/x₁|ᵖ·sgn y, y = dz(x, d)",
        source: "K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42 (1975) 440–445, without its damping",
        residual_signature: "the residual is zero in the middle of the travel and rises on a bent line outside",
        separated_by: "A slow push into the contact, force over penetration on logarithmic scales: one straight line with slope p; stops \
                       and clearances have slope 1.",
        parameters: &[
            strength(
                "force_above",
                "F₊",
                "force of the upper contact at the reference displacement beyond the gap",
                Dimension::FORCE,
            ),
            strength(
                "force_below",
                "F₋",
                "force of the lower contact at the reference displacement beyond the gap",
                Dimension::FORCE,
            ),
            Parameter {
                name: "gap",
                symbol: "d",
                meaning: "half the gap between the contacts",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(GAP),
            },
            PowerSpring::ABOUT.parameters[1],
            PowerSpring::ABOUT.parameters[2],
        ],
    };

    fn law<S: Scalar>(
        &[above, below, gap, exponent, per_reference, _]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let pressed = at.displacement.dead_zone(gap) * per_reference;
        let unit = signed_power(pressed, exponent);
        [split(unit, above, below), S::zero()]
    }
}
