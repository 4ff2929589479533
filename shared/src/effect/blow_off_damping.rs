//! A damper whose valve opens at a velocity, another one in either direction.

use super::about::{About, Parameter, Role, Shape};
use super::by_direction::strength;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·min(ẋ/v₊, 1) for ẋ > 0 and F₋·max(ẋ/v₋, −1) for ẋ < 0: a straight line up to the knee,
/// where the valve opens, and a level beyond.
///
/// Beside a viscous damper, that gives the slope beyond the knee.
pub(super) struct BlowOffDamping;

/// The search for the velocity at which a valve opens.
const fn knee(name: &'static str, symbol: &'static str, meaning: &'static str) -> Parameter {
    Parameter {
        name,
        symbol,
        meaning,
        dimension: Dimension::VELOCITY,
        role: Role::Shape(Shape {
            starts: &[0.1, 0.2, 0.4, 0.7],
            least: 0.01,
            most: 1.0,
            reciprocal: true,
            tie: None,
        }),
    }
}

impl Effect for BlowOffDamping {
    const TAG: u8 = 56;
    const REPLACES: &'static [&'static str] = &["viscous_by_direction"];
    const LOOKS_LIKE: &'static [&'static str] =
        &["digressive_damping", "power_damper_by_direction"];

    const ABOUT: About = About {
        name: "blow_off_damping",
        title: "damper whose valve opens at a velocity, per direction (blow-off)",
        equation: "r = F₊·min(ẋ/v₊, 1) for ẋ > 0, F₋·max(ẋ/v₋, −1) for ẋ < 0",
        source: "J. C. Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: pressure relief valves",
        residual_signature: "the residual over the velocity is a straight line through rest with a corner on either side, level beyond",
        separated_by: "Sweeps at constant speeds: the force has a corner where the valve opens; digressive damping bends smoothly.",
        parameters: &[
            strength(
                "force_forward",
                "F₊",
                "force with the valve open while the displacement grows",
                Dimension::FORCE,
            ),
            knee(
                "knee_forward",
                "v₊",
                "velocity at which the valve opens while the displacement grows",
            ),
            strength(
                "force_backward",
                "F₋",
                "force with the valve open while the displacement falls",
                Dimension::FORCE,
            ),
            knee(
                "knee_backward",
                "v₋",
                "velocity at which it opens while the displacement falls",
            ),
        ],
    };

    fn law<S: Scalar>(
        &[forward, per_forward, backward, per_backward, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let (zero, one) = (S::zero(), S::one());
        let ahead = (at.velocity.max(zero) * per_forward).min(one);
        let back = (at.velocity.min(zero) * per_backward).max(zero - one);
        [forward * ahead + backward * back, zero]
    }
}
