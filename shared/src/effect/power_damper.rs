//! A damper whose force follows a power of the velocity: a fluid damper with shaped orifices, or
//! one with a silicone fluid.

use super::about::{About, Parameter};
use super::power_law::{exponent, reference, signed_power};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F·|ẋ/v₁|ᵖ·sgn ẋ.
pub(super) struct PowerDamper;

impl Effect for PowerDamper {
    const TAG: u8 = 31;
    const LOOKS_LIKE: &'static [&'static str] = &["quadratic_drag", "digressive_damping"];

    const ABOUT: About = About {
        name: "power_damper",
        title: "damper with a power of the velocity",
        equation: "r = F·|ẋ/v₁|ᵖ·sgn ẋ",
        source: "M. C. Constantinou, M. D. Symans, NCEER-92-0032, Buffalo 1992: F = C·|v|^α·sgn v with α from 0.3 to 2",
        residual_signature: "the residual over the velocity is an odd curve that bends everywhere",
        separated_by: "Sweeps at constant speeds over two decades, force over speed on logarithmic scales: one straight line with slope p.",
        parameters: &[
            Parameter::linear(
                "force",
                "F",
                "force at the reference velocity",
                Dimension::FORCE,
                true,
            ),
            exponent(&[0.25, 0.5, 0.75, 1.5, 2.5], 0.1, 4.0),
            reference(
                "reference_velocity",
                "v₁",
                "largest velocity in the training records; given, not found",
                Dimension::VELOCITY,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[force, exponent, per_reference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let power = signed_power(at.velocity * per_reference, exponent);
        [force * power, S::zero()]
    }
}
