//! Flag-shaped hysteresis: superelastic shape-memory alloys, ring springs and rocking joints held
//! by tendons lose energy and return to their zero.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·(x − s), s held between dz(x, d) and dz(x, (1 − β)·d).
///
/// s is the part of the displacement that the activated material or the open joint takes up. It
/// follows the outer of the two curves while loading and the inner one while unloading: a play
/// between two dead zones, exact at any sample rate. Beside a spring k₂ the stiffness is
/// k + k₂ before activation and k₂ after it. With β = 0 there is no loop, and it is a spring that
/// gives way.
pub(super) struct SelfCentring;

impl Effect for SelfCentring {
    const TAG: u8 = 55;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::FromZero];
    // A play passes on the largest error of its two bounds and gathers none.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);

    const ABOUT: About = About {
        name: "self_centring",
        title: "flag-shaped hysteresis that returns to zero (self-centring)",
        equation: "r = k·(x − s), s held between dz(x, d) and dz(x, (1 − β)·d)",
        source: "C. Christopoulos, A. Filiatrault, B. Folz, Earthquake Engineering and Structural Dynamics 31 (2002) 1131–1150",
        residual_signature: "the residual over the displacement is a flag: a line through zero, and a loop on either side",
        separated_by: "Slow cycles at several amplitudes: no loop below activation; above it every cycle returns through zero, where a \
                       Jenkins element keeps a residual displacement.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "stiffness that is lost on activation",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "activation_displacement",
                symbol: "d",
                meaning: "displacement at which it gives way, on either side",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.05, 0.1, 0.2, 0.3, 0.45, 0.65, 0.85],
                    least: 0.01,
                    most: 0.99,
                    reciprocal: false,
                    tie: None,
                }),
            },
            Parameter {
                name: "loop_share",
                symbol: "β",
                meaning: "height of the loop over the force at activation: 0 loses nothing, 1 unloads to zero",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.25, 0.5, 0.8],
                    least: 0.02,
                    most: 1.0,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, activation, share, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [taken_up, ..]: &mut States<S>,
    ) -> [S; 2] {
        let loading = at.displacement.dead_zone(activation);
        let back = activation * (S::one() - share);
        let unloading = at.displacement.dead_zone(back);
        let (least, most) = (loading.min(unloading), loading.max(unloading));
        *taken_up = taken_up.max(least).min(most);
        [stiffness * (at.displacement - *taken_up), S::zero()]
    }
}
