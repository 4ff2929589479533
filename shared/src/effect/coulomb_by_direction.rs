//! Dry friction with a strength per direction: a seal or a wedge that holds one way more than the
//! other.

use super::about::{About, Parameter};
use super::by_direction::{split, strength};
use super::coulomb::Coulomb;
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F₊·max(s, 0) + F₋·min(s, 0) with s = tanh(ẋ/v_t).
pub(super) struct CoulombByDirection;

impl Effect for CoulombByDirection {
    const TAG: u8 = 25;
    const REPLACES: &'static [&'static str] = &["coulomb"];

    const ABOUT: About = About {
        name: "coulomb_by_direction",
        title: "dry friction with a strength per direction",
        equation: "r = F₊·max(s, 0) + F₋·min(s, 0), s = tanh(ẋ/v_t)",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083–1138, with a level per direction",
        residual_signature: "the residual jumps between two values whenever the velocity changes its sign, and the two are not opposite",
        separated_by: "Slow sweeps in both directions, and the force channel read unloaded: a preload shifts both levels at rest as well, \
                       unequal friction in motion only.",
        parameters: &[
            strength(
                "friction_forward",
                "F₊",
                "friction force while the displacement grows",
                Dimension::FORCE,
            ),
            strength(
                "friction_backward",
                "F₋",
                "friction force while the displacement falls",
                Dimension::FORCE,
            ),
            TRANSITION_VELOCITY,
        ],
    };

    fn law<S: Scalar>(
        &[forward, backward, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let unit = (at.velocity * per_transition).tanh();
        [split(unit, forward, backward), S::zero()]
    }
}

/// The velocity within which friction changes its sign, as in the law with one strength.
const TRANSITION_VELOCITY: Parameter = Coulomb::ABOUT.parameters[1];
