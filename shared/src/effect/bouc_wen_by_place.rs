//! Smooth hysteresis whose strength follows the displacement: a damper that grips more towards one
//! or both of its ends.

use super::about::{About, Parameter};
use super::bouc_wen::BoucWen;
use super::position_friction::PositionFriction;
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = (F₀ + F₁·x + F₂·x²)·z, where z is the state of `bouc_wen`.
pub(super) struct BoucWenByPlace;

impl Effect for BoucWenByPlace {
    const TAG: u8 = 46;
    const REPLACES: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = BoucWen::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = BoucWen::ERROR_PROPAGATION;
    const STRENGTH_BY_DISPLACEMENT: &'static [usize] = &[0, 4, 5];

    const ABOUT: About = About {
        name: "bouc_wen_by_place",
        title: "smooth hysteresis (Bouc–Wen) whose strength follows the displacement",
        equation: "r = (F₀ + F₁·x + F₂·x²)·z, dz/dx = (1 − |z|ⁿ·(1 − γ + γ·sgn(ẋ·z)))/u_y",
        source: "hysteresis under a load that follows the displacement: M. Ismail, F. Ikhouane, J. Rodellar, Arch. Comput. Methods Eng. 16 (2009) 161–188",
        residual_signature: "the residual over the displacement is a rounded loop that is wider at one end or at both",
        separated_by: "Slow cycles of the same small amplitude at several places: the loop's height follows the place; hardening bends both \
                       branches alike and leaves the height.",
        parameters: &[
            Parameter::linear(
                "yield_force",
                "F₀",
                "largest force of the hysteresis at zero displacement",
                Dimension::FORCE,
                true,
            ),
            BoucWen::ABOUT.parameters[1],
            BoucWen::ABOUT.parameters[2],
            BoucWen::ABOUT.parameters[3],
            PositionFriction::ABOUT.parameters[0],
            PositionFriction::ABOUT.parameters[1],
        ],
    };

    fn law<S: Scalar>(
        &[force, displacement, exponent, share, slope, curvature]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let none = S::zero();
        let [unit, other] = BoucWen::law(
            &[S::one(), displacement, exponent, share, none, none],
            at,
            states,
        );
        let x = at.displacement;
        [(force + slope * x + curvature * (x * x)) * unit, other]
    }
}
