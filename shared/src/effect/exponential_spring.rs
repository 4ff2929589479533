//! A spring whose stiffness grows in proportion to its force: a bump stop of foam, a wire rope that
//! closes up, tissue.

use super::about::{About, Parameter, Role, Shape};
use super::by_direction::{from_rest, strength};
use super::offset_stops::OffsetStops;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·(g(x) − g(0)) − F₋·(g(−x) − g(0)) with g(x) = e^((x − 1.25·x₁)/λ), at most 1: a quarter
/// beyond what was measured it ends.
pub(super) struct ExponentialSpring;

impl Effect for ExponentialSpring {
    const TAG: u8 = 61;
    /// One end is enough.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    /// Over a long length it is any spring that bends a little.
    const NOT_AT_MOST: &'static [usize] = &[2];
    const LOOKS_LIKE: &'static [&'static str] = &[
        "gas_spring",
        "power_contact",
        "power_spring",
        "power_spring_by_direction",
        "cubic_hardening",
    ];

    const ABOUT: About = About {
        name: "exponential_spring",
        title: "spring whose stiffness grows with its force (bump stops)",
        equation: "r = F₊·(g(x) − g(0)) − F₋·(g(−x) − g(0)), g(x) = e^((x − 1.25·x₁)/λ)",
        source: "G. F. Demetriades et al., Earthquake Eng. Struct. Dyn. 22 (1993) 507–524, for wire ropes",
        residual_signature: "the residual over the displacement bends ever more toward one end or both",
        separated_by: "A slow push toward the end: the logarithm of the force over displacement is straight.",
        parameters: &[
            strength(
                "force_above",
                "F₊",
                "force at 1.25·x₁ where displacement presses as it grows",
                Dimension::FORCE,
            ),
            strength(
                "force_below",
                "F₋",
                "force at −1.25·x₁ where displacement presses as it falls",
                Dimension::FORCE,
            ),
            Parameter {
                name: "length",
                symbol: "λ",
                meaning: "displacement over which the force grows by a factor of e",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.12, 0.25, 0.5],
                    least: 0.08,
                    most: 1.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            OffsetStops::ABOUT.parameters[4],
        ],
    };

    fn law<S: Scalar>(
        &[above, below, per_length, reference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let end = reference * S::ratio(5, 4);
        let pressed = |x: S| ((end - x) * per_length).decay();
        let force = from_rest(at.displacement, [above, below], pressed);
        [force, S::zero()]
    }
}
