//! Smooth hysteresis whose strength rises with speed: fluid and elastomer dampers, whose friction
//! part thickens in quick motion.

use super::about::{About, Parameter};
use super::bouc_wen::BoucWen;
use super::digressive_damping::DigressiveDamping;
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (F₀ + F₁·(1 − e^(−|ẋ|/v_k)))·z, where z is the state of `bouc_wen`.
pub(super) struct BoucWenByRate;

impl Effect for BoucWenByRate {
    const TAG: u8 = 45;
    const REPLACES: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = BoucWen::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = BoucWen::ERROR_PROPAGATION;

    const ABOUT: About = About {
        name: "bouc_wen_by_rate",
        title: "smooth hysteresis (Bouc–Wen) whose strength rises with speed",
        equation: "r = (F₀ + F₁·(1 − e^(−|ẋ|/v_k)))·z, dz/dx = (1 − |z|ⁿ·(1 − γ + γ·sgn(ẋ·z)))/u_y",
        source: "rate-dependent Bouc–Wen laws are reviewed by M. Ismail, F. Ikhouane, J. Rodellar, Arch. Comput. Methods Eng. 16 (2009) 161–188",
        residual_signature: "the residual over the displacement is a rounded loop that is higher in quick motion, and has no viscous damper's ellipse",
        separated_by: "The same amplitude at several frequencies: the loop grows and keeps its knees; a viscous damper beside Bouc–Wen \
                       makes it bulge in the middle only.",
        parameters: &[
            Parameter::linear(
                "yield_force",
                "F₀",
                "largest force of the hysteresis in slow motion",
                Dimension::FORCE,
                true,
            ),
            BoucWen::ABOUT.parameters[1],
            BoucWen::ABOUT.parameters[2],
            BoucWen::ABOUT.parameters[3],
            Parameter::linear(
                "rise",
                "F₁",
                "what it exceeds that by in quick motion",
                Dimension::FORCE,
                true,
            ),
            DigressiveDamping::ABOUT.parameters[1],
        ],
    };

    fn law<S: Scalar>(
        &[slow, displacement, exponent, share, rise, per_knee]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let none = S::zero();
        let [unit, other] = BoucWen::law(
            &[S::one(), displacement, exponent, share, none, none],
            at,
            states,
        );
        let quick = S::one() - (at.velocity * per_knee).abs().decay();
        [(slow + rise * quick) * unit, other]
    }
}
