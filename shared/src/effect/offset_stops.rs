//! Stops that are met anywhere in the travel, each at a place of its own: a play that is off
//! centre, a pressed contact that lifts off.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k_u·max(x + x₁ − d_u, 0) + k_l·min(x − x₁ + d_l, 0).
///
/// Where a stop is met is counted from the far end of the travel, −x₁ for the upper one and x₁ for
/// the lower one: so both distances are positive wherever the stops are.
pub(super) struct OffsetStops;

/// Where the search for a stop begins, from its far end: 1 is the middle of the travel.
const PLACES: &[f64] = &[0.4, 0.8, 1.1, 1.35, 1.6, 1.85];

/// The displacement at which a stop is met.
pub(super) const fn place(
    name: &'static str,
    symbol: &'static str,
    meaning: &'static str,
    starts: &'static [f64],
) -> Parameter {
    Parameter {
        name,
        symbol,
        meaning,
        dimension: Dimension::DISPLACEMENT,
        role: Role::Shape(Shape {
            starts,
            least: 0.05,
            most: 1.98,
            reciprocal: false,
            tie: None,
        }),
    }
}

impl Effect for OffsetStops {
    const TAG: u8 = 57;
    /// A stop on one side alone is one.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 1];
    const STOPS: Option<[usize; 3]> = Some([2, 3, 4]);
    const LOOKS_LIKE: &'static [&'static str] = &["clearance", "end_stop", "power_contact"];

    const ABOUT: About = About {
        name: "offset_stops",
        title: "stops that are met off centre, each at a place of its own",
        equation: "r = k_u·max(x + x₁ − d_u, 0) + k_l·min(x − x₁ + d_l, 0)",
        source: "S. W. Shaw, P. J. Holmes, J. Sound and Vibration 90 (1983) 129–155",
        residual_signature: "the residual over the displacement has one or two corners, at different distances from zero",
        separated_by: "A slow push through the whole range shows where either corner lies; those of free play lie alike.",
        parameters: &[
            Parameter::linear(
                "upper_stiffness",
                "k_u",
                "stiffness of the stop that is met as the displacement grows",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter::linear(
                "lower_stiffness",
                "k_l",
                "stiffness of the stop that is met as the displacement falls",
                Dimension::STIFFNESS,
                true,
            ),
            place(
                "upper_distance",
                "d_u",
                "displacement at which the upper stop is met, counted from −x₁",
                PLACES,
            ),
            place(
                "lower_distance",
                "d_l",
                "displacement at which the lower stop is met, counted back from x₁",
                PLACES,
            ),
            Parameter {
                name: "reference_displacement",
                symbol: "x₁",
                meaning: "largest displacement in the training records; given, not found",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    reciprocal: false,
                    ..Shape::given(&[1.0])
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[upper, lower, from_below, from_above, reference, _]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let above = (at.displacement + reference - from_below).max(S::zero());
        let below = (at.displacement - reference + from_above).min(S::zero());
        [upper * above + lower * below, S::zero()]
    }
}
