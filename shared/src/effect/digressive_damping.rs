//! A damper that gives way above a knee, like a shock absorber whose valve opens.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F·(1 − e^(−|ẋ|/v_k))·sgn ẋ: the slope is F/v_k at rest, and F is the most that it gives.
///
/// Beside a viscous damper, the slope well above the knee is that damper's.
pub(super) struct DigressiveDamping;

impl Effect for DigressiveDamping {
    const TAG: u8 = 34;
    /// With a knee beyond the motion it is a viscous damper.
    const NOT_AT_MOST: &'static [usize] = &[1];
    const LOOKS_LIKE: &'static [&'static str] = &["power_damper"];

    const ABOUT: About = About {
        name: "digressive_damping",
        title: "damper that gives way above a knee (digressive)",
        equation: "r = F·(1 − e^(−|ẋ|/v_k))·sgn ẋ",
        source: "J. C. Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: digressive valves",
        residual_signature: "the residual over the velocity is steep near rest and flattens towards a level on either side",
        separated_by: "Sweeps at constant speeds: near rest the force is proportional to the speed, where dry friction jumps; far above \
                       the knee it stays.",
        parameters: &[
            Parameter::linear(
                "force",
                "F",
                "force far above the knee",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "knee_velocity",
                symbol: "v_k",
                meaning: "velocity at which 63 % of that force is reached",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(Shape {
                    starts: &[0.05, 0.1, 0.2, 0.4, 0.8],
                    least: 0.01,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_knee, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let [ahead, back, _] = (at.velocity * per_knee).decay_of_either_sign();
        [force * (back - ahead), S::zero()]
    }
}
