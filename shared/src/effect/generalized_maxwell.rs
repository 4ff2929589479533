//! Springs and dampers in series beside each other, from quick to slow: rubber and other polymers.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·Σ e^(−s·i)·yᵢ with ẏᵢ = ẋ − yᵢ/τᵢ and τᵢ = 4ⁱ·τ, i from 0 to 4.
///
/// Five Maxwell elements whose relaxation times are spread over a factor of 256 and whose stiffness falls by a power of them. With s = p·ln 4
/// the force of a held push falls as t^(−p) from τ to 256·τ, as that of a fractional derivative of order p does.
pub(super) struct GeneralizedMaxwell;

/// Elements: with a factor of 4 between their times, what they make of t^(−p) is smooth to 2 %.
const ELEMENTS: usize = 5;

impl Effect for GeneralizedMaxwell {
    const TAG: u8 = 54;
    // Each state is that of a Maxwell element.
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Displacement(2); ELEMENTS];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::WithTime;
    const LOOKS_LIKE: &'static [&'static str] = &["maxwell"];

    const ABOUT: About = About {
        name: "generalized_maxwell",
        title: "springs and dampers in series beside each other (generalized Maxwell model)",
        equation: "r = k·Σ e^(−s·i)·yᵢ, ẏᵢ = ẋ − yᵢ/τᵢ, τᵢ = 4ⁱ·τ, i = 0…4",
        source: "E. Wiechert, Annalen der Physik 286 (1893) 546–570; for power laws R. L. Bagley, P. J. Torvik, J. Rheology 27 (1983) 201–210",
        residual_signature: "the residual is a loop at every frequency, about as wide at all of them, around a spring that grows stiffer with the frequency",
        separated_by: "A push that is held: the force goes on falling over decades of time, where that of one Maxwell element is gone after \
                       three relaxation times. Sweeps: the loss stays alike over decades of frequency, where one element has one peak.",
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
                meaning: "relaxation time of the quickest element; that of each other one is four times that of the one before",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[0.001, 0.004, 0.015, 0.06, 0.25],
                    least: 3e-4,
                    most: 5.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "decline",
                symbol: "s",
                meaning: "logarithm of the ratio of two neighbouring stiffnesses; over ln 4 the order of the fractional derivative",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.2, 0.6],
                    least: 0.02,
                    most: 2.5,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, per_relaxation, decline, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let ratio = decline.decay();
        let (mut rate, mut size) = (at.period.half() * per_relaxation, S::one());
        let mut sum = S::zero();
        for stretch in states.iter_mut().take(ELEMENTS) {
            let half = rate.decay();
            *stretch = (*stretch * half + at.step) * half;
            sum = sum + size * *stretch;
            size = size * ratio;
            rate = rate.half().half();
        }
        [stiffness * sum, S::zero()]
    }
}
