//! Dry friction behind a spring: it sticks elastically until the slip force is reached, then
//! slides.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F_s·z with z ← z + Δx/u_s held between −1 and 1.
///
/// z is the stretch of the spring over the stretch at which the slider lets go. Held along a path
/// from one extreme to the next, that is exact at any sample rate: there is nothing to integrate.
pub(super) struct Jenkins;

/// The search for the displacement that a stuck contact gives way by.
const SLIP: Shape = Shape {
    starts: &[
        0.005, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.22, 0.32, 0.45, 0.65, 0.9, 1.2,
    ],
    least: 5e-4,
    most: 1.9,
    reciprocal: true,
    tie: None,
};

impl Effect for Jenkins {
    const TAG: u8 = 13;
    const LOOKS_LIKE: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    // What a sample adds is the difference of two rounded positions, so that roundings cancel along
    // any path. The slider, too, passes on errors of its input and gathers none: its position
    // follows the largest of them at most once, and the spring's stretch, input minus slider,
    // at most twice (P. Krejčí, Hysteresis, Convexity and Dissipation in Hyperbolic Equations,
    // 1996). The error of a step counts both positions and so is that bound.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);

    const ABOUT: About = About {
        name: "jenkins",
        title: "dry friction behind a spring (Jenkins element)",
        equation: "r = F_s·z, z ← z + Δx/u_s held within ±1",
        source: "W. D. Iwan, J. Applied Mechanics 33 (1966) 893–900; the element is named after C. F. Jenkin, 1922",
        residual_signature: "the residual over the displacement is a parallelogram: straight flanks after every reversal, then flat",
        separated_by: "Slow reversals at several amplitudes: the flanks are straight with a corner where it slips, where Bouc–Wen and \
                       Dahl bend; below the slip displacement there is no loop at all.",
        parameters: &[
            Parameter::linear(
                "slip_force",
                "F_s",
                "force at which the contact slides",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "slip_displacement",
                symbol: "u_s",
                meaning: "displacement from the unloaded contact to sliding; F_s/u_s is the stiffness while it sticks",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(SLIP),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_slip, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        *z = (*z + at.travel(per_slip)).within(S::one());
        [force * *z, S::zero()]
    }
}
