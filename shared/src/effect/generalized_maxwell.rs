//! Springs and dampers in series beside each other, from quick to slow: rubber and other polymers.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·Σ ρⁱ·yᵢ with ẏᵢ = ẋ − yᵢ/τᵢ and τᵢ = 4^(i−3)·τ, i from 0 to 3.
///
/// Four Maxwell elements whose relaxation times are spread over a factor of 64 and whose stiffness
/// falls by a power of them. With ρ = 4^(−p) the force of a held push falls as t^(−p) from τ/64 to
/// τ, as that of a fractional derivative of order p does.
pub(super) struct GeneralizedMaxwell;

/// Elements: with a factor of 4 between their times, what they make of t^(−p) is smooth to 2 %.
const ELEMENTS: usize = 4;

impl Effect for GeneralizedMaxwell {
    const TAG: u8 = 54;
    // Each state is that of a Maxwell element.
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Displacement(2); ELEMENTS];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::WithTime;
    const LOOKS_LIKE: &'static [&'static str] = &["maxwell"];

    const ABOUT: About = About {
        name: "generalized_maxwell",
        title: "springs and dampers in series beside each other (generalized Maxwell model)",
        equation: "r = k·Σ ρⁱ·yᵢ, ẏᵢ = ẋ − yᵢ/τᵢ, τᵢ = 4^(i−3)·τ, i = 0…3",
        source: "E. Wiechert, Annalen der Physik 286 (1893) 546–570; for power laws R. L. Bagley, P. J. Torvik, J. Rheology 27 (1983) 201–210",
        residual_signature: "the residual is a loop at every frequency, about as wide at all of them, around a spring that grows stiffer with the frequency",
        separated_by: "A push that is held: the force goes on falling over decades of time, where that of one Maxwell element is soon gone.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "stiffness of the quickest element",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "relaxation_time",
                symbol: "τ",
                meaning: "relaxation time of the slowest element; that of each quicker one is a quarter of it",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[0.06, 0.25, 1.0, 4.0],
                    least: 0.02,
                    most: 100.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "ratio",
                symbol: "ρ",
                meaning: "ratio of the stiffnesses of two neighbours; −log₄ of it is the order of the fractional derivative",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.55, 0.82],
                    least: 0.08,
                    most: 0.98,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, per_relaxation, ratio, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        // From the slowest element on: what half a sample leaves of each quicker one is the fourth
        // power, which costs less than an exponential.
        let mut half = (at.period.half() * per_relaxation).decay();
        let mut sum = S::zero();
        for (place, stretch) in states.iter_mut().take(ELEMENTS).rev().enumerate() {
            if place > 0 {
                let square = half * half;
                half = square * square;
            }
            *stretch = (*stretch * half + at.step) * half;
            sum = sum * ratio + *stretch;
        }
        [stiffness * sum, S::zero()]
    }
}
