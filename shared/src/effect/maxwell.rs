//! A spring and a damper in series: stiff for quick motion, giving way to slow motion, like rubber.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·y with ẏ = ẋ − y/τ, y the stretch of the spring and τ = c/k.
///
/// Between two samples the stretch decays by e^(−T/τ); the sample's own travel is taken to be made
/// in the middle, which for constant velocity is off by (T/τ)²/24.
pub(super) struct Maxwell;

impl Effect for Maxwell {
    const TAG: u8 = 16;
    // The damper's piston only ever follows the joint, so it stays between the joint's extremes.
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Displacement(2)];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::WithTime;

    const ABOUT: About = About {
        name: "maxwell",
        title: "spring and damper in series (Maxwell element)",
        equation: "r = k·y, ẏ = ẋ − y/τ",
        source: "J. C. Maxwell, Phil. Trans. R. Soc. 157 (1867) 49–88",
        residual_signature: "the residual is a spring's at high frequency and a damper's at low frequency, with a loop in between",
        separated_by: "A push that is held: the force relaxes with the time constant τ, where hystereses and springs stay and a damper's is \
                       gone at once.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "stiffness of the spring, which quick motion sees",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "relaxation_time",
                symbol: "τ",
                meaning: "time in which the force of a held push falls to 37 %: damping over stiffness",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[
                        0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 3.0,
                    ],
                    least: 3e-4,
                    most: 20.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, per_relaxation, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [stretch, ..]: &mut States<S>,
    ) -> [S; 2] {
        let half = (at.period.half() * per_relaxation).decay();
        *stretch = (*stretch * half + at.step) * half;
        [stiffness * *stretch, S::zero()]
    }
}
