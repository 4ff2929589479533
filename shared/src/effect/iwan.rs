//! Friction that begins in places: a bolted lap whose contact slips from its edge inwards, element
//! after element.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = K·Σ yᵢ/5 with yᵢ ← yᵢ + Δx held between ±uᵢ and uᵢ = u·e^(−s·i), i from 0 to 4.
///
/// Five Jenkins elements of equal stiffness in parallel, their slip displacements spread
/// geometrically. The largest force is K·Σ uᵢ/5.
pub(super) struct Iwan;

/// Elements: with more than five the curve's corners are finer than what separates it from
/// Bouc–Wen.
const ELEMENTS: usize = 5;

impl Effect for Iwan {
    const TAG: u8 = 43;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Displacement(2); ELEMENTS];
    // Each state is that of a Jenkins element.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);
    const LOOKS_LIKE: &'static [&'static str] = &["bouc_wen", "dahl"];

    const ABOUT: About = About {
        name: "iwan",
        title: "friction that begins in places (parallel Iwan elements)",
        equation: "r = K·Σ yᵢ/5, yᵢ ← yᵢ + Δx held within ±uᵢ, uᵢ = u·e^(−s·i), i = 0…4",
        source: "W. D. Iwan, J. Applied Mechanics 33 (1966) 893–900; for bolted joints D. J. Segalman, J. Applied Mechanics 72 (2005) 752–760",
        residual_signature: "the residual over the displacement is a loop whose branches are the first loading drawn twice as large (Masing)",
        separated_by: "Slow reversals at amplitudes over two decades: small loops lose energy too; below its slip displacement a single \
                       Jenkins element loses none.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "K",
                "stiffness while nothing slips",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "slip_displacement",
                symbol: "u",
                meaning: "displacement at which the last element slips",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.03, 0.08, 0.2, 0.4, 0.8],
                    least: 1e-3,
                    most: 1.9,
                    reciprocal: false,
                    tie: None,
                }),
            },
            Parameter {
                name: "spread",
                symbol: "s",
                meaning: "logarithm of the ratio of two neighbouring slip displacements",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.3, 0.6, 1.0],
                    least: 0.02,
                    most: 2.5,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, largest, spread, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let ratio = spread.decay();
        let (mut slip, mut sum) = (largest, S::zero());
        for stretch in states.iter_mut().take(ELEMENTS) {
            *stretch = (*stretch + at.step).within(slip);
            sum = sum + *stretch;
            slip = slip * ratio;
        }
        [stiffness * (sum * S::ratio(1, 5)), S::zero()]
    }
}
