//! A contact that is met anywhere in the travel and whose force follows a power of the penetration:
//! a ball in a pressed bearing.

use super::about::About;
use super::by_direction::strength;
use super::offset_stops::place;
use super::power_law::exponent;
use super::power_spring::PowerSpring;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::{Powers, Scalar};
use crate::units::Dimension;

/// r = F₊·max(1 + (x − d_u)/x₁, 0)ᵖ − F₋·max(1 − (x + d_l)/x₁, 0)ᵖ, places counted as in
/// [`super::offset_stops`].
pub(super) struct OffsetContact;

impl Effect for OffsetContact {
    const TAG: u8 = 59;
    /// A contact on one side alone is one.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    const STOPS: Option<[usize; 3]> = Some([2, 3, 5]);
    const LOOKS_LIKE: &'static [&'static str] = &["offset_stops", "power_contact"];

    const ABOUT: About = About {
        name: "offset_contact",
        title: "contacts met off centre, with a power of the penetration",
        equation: "r = F₊·max(1 + (x − d_u)/x₁, 0)ᵖ − F₋·max(1 − (x + d_l)/x₁, 0)ᵖ",
        source: "H. Hertz, J. reine und angewandte Mathematik 92 (1882) 156–171: p = 3/2",
        residual_signature: "the residual over the displacement is flat up to a place, and a bent line beyond",
        separated_by: "A slow push: force over penetration on logarithmic scales has slope p. A slow pull shows where it lifts off.",
        parameters: &[
            strength(
                "force_above",
                "F₊",
                "force at a penetration of x₁ where displacement presses as it grows",
                Dimension::FORCE,
            ),
            strength(
                "force_below",
                "F₋",
                "the same as it falls",
                Dimension::FORCE,
            ),
            place(
                "upper_distance",
                "d_u",
                "displacement at which the upper stop is met, counted from −x₁",
                &[0.4, 0.8, 1.2, 1.6],
            ),
            place(
                "lower_distance",
                "d_l",
                "displacement at which the lower stop is met, counted back from x₁",
                &[0.4, 0.8, 1.2, 1.6],
            ),
            exponent(&[1.5, 2.3], 1.0, 3.0),
            PowerSpring::ABOUT.parameters[2],
        ],
    };

    fn law<S: Scalar>(
        &[
            above,
            below,
            from_below,
            from_above,
            exponent,
            per_reference,
        ]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let pressed = |x: S, place: S| {
            let depth = S::one() + (x - place) * per_reference;
            S::long(depth.short().raised(exponent.short()))
        };
        let up = pressed(at.displacement, from_below);
        let down = pressed(-at.displacement, from_above);
        [above * up - below * down, S::zero()]
    }
}
