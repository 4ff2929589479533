//! A damper whose strength follows the place: a metering pin in an orifice, a tapered bore, a
//! magnet over the edge of its plate, a film that is squeezed.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (c₁·x + c₂·x²)·ẋ: what damping changes by along the travel, beside a damper c₀ at zero
/// displacement.
pub(super) struct PositionDamping;

impl Effect for PositionDamping {
    const TAG: u8 = 65;

    const ABOUT: About = About {
        name: "position_damping",
        title: "damping that follows the displacement",
        equation: "r = (c₁·x + c₂·x²)·ẋ",
        source: "dampers with metering pins: N. S. Currey, Aircraft Landing Gear Design, AIAA 1988, ch. 5; c₂ alone: B. van der Pol, Phil. Mag. 2 (1926) 978–992",
        residual_signature: "the residual over ẋ is a straight line through zero whose slope differs from place to place",
        separated_by: "Small fast oscillations about several places of the travel: the loop at each place is the damping there.",
        parameters: &[
            Parameter::linear(
                "damping_slope",
                "c₁",
                "damping per displacement",
                Dimension {
                    force: 1,
                    velocity: -1,
                    displacement: -1,
                    ..Dimension::NONE
                },
                false,
            ),
            Parameter::linear(
                "damping_curvature",
                "c₂",
                "damping per square of the displacement",
                Dimension {
                    force: 1,
                    velocity: -1,
                    displacement: -2,
                    ..Dimension::NONE
                },
                false,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[slope, curvature, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let x = at.displacement;
        [(slope * x + curvature * (x * x)) * at.velocity, S::zero()]
    }
}
