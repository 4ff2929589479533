//! A spring whose force follows a power of the displacement: a Hertzian contact, a conical coil, a
//! rubber that flattens.

use super::about::{About, Parameter};
use super::power_law::{exponent, reference, signed_power};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F·|x/x₁|ᵖ·sgn x.
pub(super) struct PowerSpring;

impl Effect for PowerSpring {
    const TAG: u8 = 30;
    const LOOKS_LIKE: &'static [&'static str] = &["cubic_hardening"];

    const ABOUT: About = About {
        name: "power_spring",
        title: "spring with a power of the displacement",
        equation: "r = F·|x/x₁|ᵖ·sgn x",
        source: "H. Hertz, J. reine angew. Math. 92 (1882) 156–171, with p = 3/2 for spheres; the power is left open",
        residual_signature: "the residual over the displacement is an odd curve that bends everywhere and has no corner",
        separated_by: "A slow push through the whole range, force over displacement on logarithmic scales: a straight line.",
        parameters: &[
            Parameter::linear(
                "force",
                "F",
                "force at the reference displacement",
                Dimension::FORCE,
                true,
            ),
            exponent(&[0.4, 0.6, 1.5, 2.0, 3.0], 0.15, 6.0),
            reference(
                "reference_displacement",
                "x₁",
                "largest displacement in the training records; given, not found",
                Dimension::DISPLACEMENT,
            ),
        ],
    };

    fn law<S: Scalar>(
        &[force, exponent, per_reference, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let power = signed_power(at.displacement * per_reference, exponent);
        [force * power, S::zero()]
    }
}
