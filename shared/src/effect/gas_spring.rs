//! A spring that stiffens toward a wall: enclosed gas behind a piston; nearly so the gap of a
//! magnet, a bump stop.

use super::about::{About, Parameter, Role, Shape};
use super::by_direction::{from_rest, strength};
use super::offset_stops::OffsetStops;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::{Number, Powers, Scalar};
use crate::units::Dimension;

/// r = F₊·(g(x) − g(0)) − F₋·(g(−x) − g(0)) with g(x) = (1 + (x₁ − x)/d)⁻ⁿ, which is 1 at x₁ and
/// infinite at the wall, d further on.
///
/// The index of gas is between 1, isothermal, and 1.4, adiabatic; it is not found, because another
/// distance changes the curve nearly alike: 1.3 follows both within 0.2 %, two magnets' gap within
/// 2 %. The force ends at 7 times F: nobody has measured that near to the wall.
pub(super) struct GasSpring;

impl Effect for GasSpring {
    const TAG: u8 = 58;
    /// One wall is enough.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    /// Far from its wall it is any spring that bends a little.
    const NOT_AT_MOST: &'static [usize] = &[2];
    const LOOKS_LIKE: &'static [&'static str] = &[
        "exponential_spring",
        "power_contact",
        "power_spring",
        "power_spring_by_direction",
        "cubic_hardening",
    ];

    const ABOUT: About = About {
        name: "gas_spring",
        title: "spring of enclosed gas, which stiffens toward a wall",
        equation: "r = F₊·(g(x) − g(0)) − F₋·(g(−x) − g(0)), g(x) = (1 + (x₁ − x)/d)⁻ⁿ",
        source: "J. C. Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: p·Vⁿ constant",
        residual_signature: "the residual over the displacement bends ever more toward one end or both",
        separated_by: "A slow push toward the wall: force to the power −1/n over displacement is straight.",
        parameters: &[
            strength(
                "force_above",
                "F₊",
                "force at x₁ where displacement presses as it grows",
                Dimension::FORCE,
            ),
            strength(
                "force_below",
                "F₋",
                "force at −x₁ where displacement presses as it falls",
                Dimension::FORCE,
            ),
            Parameter {
                name: "wall_distance",
                symbol: "d",
                meaning: "distance from x₁ to the wall",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.3, 0.5, 0.9],
                    // The far end of the travel is within 8 times it.
                    least: 0.29,
                    most: 2.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "index",
                symbol: "n",
                meaning: "polytropic index; given, not found",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    reciprocal: false,
                    ..Shape::given(&[1.3])
                }),
            },
            OffsetStops::ABOUT.parameters[4],
        ],
    };

    fn law<S: Scalar>(
        &[above, below, per_distance, index, reference, _]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let exponent = -index.short();
        // Nearer than that the power is above 7; above 8 the device has no number.
        let nearest = S::Short::ratio(2, 9);
        let pressed = |x: S| {
            let left = S::one() + (reference - x) * per_distance;
            let force = left.short().max(nearest).raised(exponent);
            S::long(force.min(S::Short::ratio(7, 1)))
        };
        let force = from_rest(at.displacement, [above, below], pressed);
        [force, S::zero()]
    }
}
