//! Dry friction behind a spring and a gap with a strength per direction, like a band brake that
//! holds one way more than the other.

use super::about::About;
use super::by_direction::{split, strength};
use super::gap_jenkins::GapJenkins;
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(q, 0) + F₋·min(q, 0), where q is the force of `gap_jenkins` with a slip force of 1.
pub(super) struct GapJenkinsByDirection;

impl Effect for GapJenkinsByDirection {
    const TAG: u8 = 28;
    const REPLACES: &'static [&'static str] = &["gap_jenkins"];
    const NOT_AT_MOST: &'static [usize] = &[3];
    const STATE_BOUNDS: &'static [StateBound] = GapJenkins::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = GapJenkins::ERROR_PROPAGATION;

    const ABOUT: About = About {
        name: "gap_jenkins_by_direction",
        title: "dry friction behind a spring and a gap, with a strength per direction",
        equation: "r = F₊·max(q, 0) + F₋·min(q, 0), q = |w|ⁿ·sgn w, w = dz(z, 1 − c)/c, z ← z + Δx/u held within ±1",
        source: "for band brakes the capstan's two tensions: L. Euler, Mém. Acad. Sci. Berlin 18 (1762) 265–278",
        residual_signature: "the residual over the displacement falls to zero after a reversal, stays there for a fixed travel, then \
                       rises to one of two unlike plateaus",
        separated_by: "Slow reversals in both directions: the flat part after a reversal lies at zero force; beside a preload at that preload.",
        parameters: &[
            strength(
                "slip_force_forward",
                "F₊",
                "force at which the contact slides while the displacement grows",
                Dimension::FORCE,
            ),
            strength(
                "slip_force_backward",
                "F₋",
                "force at which the contact slides while the displacement falls",
                Dimension::FORCE,
            ),
            GapJenkins::ABOUT.parameters[1],
            GapJenkins::ABOUT.parameters[2],
            GapJenkins::ABOUT.parameters[3],
        ],
    };

    fn law<S: Scalar>(
        &[forward, backward, travel, share, exponent, _]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        let alike = [S::one(), travel, share, exponent, S::zero(), S::zero()];
        let [unit, none] = GapJenkins::law(&alike, at, states);
        [split(unit, forward, backward), none]
    }
}
