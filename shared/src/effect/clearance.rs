//! Free play between two stops: a spring that acts only outside it.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = κ·dz(x, d), where dz is 0 between −d and d and x ∓ d outside.
pub(super) struct Clearance;

/// The search for half the free play, for every effect that knows it.
pub(super) const GAP: Shape = Shape {
    starts: &[
        0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9,
    ],
    least: 1e-4,
    most: 0.999,
    reciprocal: false,
    tie: None,
};

impl Effect for Clearance {
    const TAG: u8 = 3;
    /// What most of the motion does not touch are stops at its ends.
    const MET_BY: Option<(usize, f64)> = Some((1, 0.5));
    const LOOKS_LIKE: &'static [&'static str] = &["end_stop"];

    const ABOUT: About = About {
        name: "clearance",
        title: "free play between stops (dead-zone spring)",
        equation: "r = κ·dz(x, d), dz(x, d) = 0 for |x| ≤ d, x − d·sgn(x) for |x| > d",
        source: "F. Tasbihgoo, J. P. Caffrey, S. F. Masri, Int. J. Non-Linear Mechanics 42 (2007), Section 3",
        residual_signature: "the residual is a bent line over the displacement, flat in the middle and steep outside",
        separated_by: "A slow push through the whole range: the force has a corner at ±d, where hardening bends smoothly. A smaller \
                       amplitude still meets it, unlike an end stop.",
        parameters: &[
            Parameter::linear(
                "contact_stiffness",
                "κ",
                "stiffness that the stops add outside the free play",
                Dimension::STIFFNESS,
                true,
            ),
            Parameter {
                name: "gap",
                symbol: "d",
                meaning: "half the free play",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(GAP),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, gap, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        [stiffness * at.displacement.dead_zone(gap), S::zero()]
    }
}
