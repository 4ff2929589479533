//! Smooth hysteresis with a strength per direction, like a damper whose seals or valves grip one
//! way more than the other.

use super::about::About;
use super::bouc_wen::BoucWen;
use super::by_direction::{split, strength};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(z, 0) + F₋·min(z, 0), where z is the state of `bouc_wen`.
pub(super) struct BoucWenByDirection;

impl Effect for BoucWenByDirection {
    const TAG: u8 = 29;
    const REPLACES: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = BoucWen::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = BoucWen::ERROR_PROPAGATION;

    const ABOUT: About = About {
        name: "bouc_wen_by_direction",
        title: "smooth hysteresis (Bouc–Wen) with a strength per direction",
        equation: "r = F₊·max(z, 0) + F₋·min(z, 0), dz/dx = (1 − |z|ⁿ·(1 − γ + γ·sgn(ẋ·z)))/u_y",
        source: "asymmetric Bouc–Wen laws are reviewed by M. Ismail, F. Ikhouane, J. Rodellar, Arch. Comput. Methods Eng. 16 (2009) 161–188",
        residual_signature: "the residual over the displacement is a rounded loop whose upper and lower plateau are not opposite",
        separated_by: "Slow reversals in both directions: the plateaus differ, and the flank bends where the force changes its sign; a \
                       preload shifts the whole loop.",
        parameters: &[
            strength(
                "yield_force_forward",
                "F₊",
                "largest force of the hysteresis while the displacement grows",
                Dimension::FORCE,
            ),
            strength(
                "yield_force_backward",
                "F₋",
                "largest force of the hysteresis while the displacement falls",
                Dimension::FORCE,
            ),
            BoucWen::ABOUT.parameters[1],
            BoucWen::ABOUT.parameters[2],
            BoucWen::ABOUT.parameters[3],
        ],
    };

    fn law<S: Scalar>(
        &[forward, backward, displacement, exponent, share, _]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let alike = [
            S::one(),
            displacement,
            exponent,
            share,
            S::zero(),
            S::zero(),
        ];
        let [unit, none] = BoucWen::law(&alike, at, states);
        [split(unit, forward, backward), none]
    }
}
