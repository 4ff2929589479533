//! Friction that builds up over a short travel after every reversal, like the stress–strain curve
//! of a ductile solid.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F_c·z with dz/dx = (1 − z·sgn ẋ)/u_c: Dahl's law with the exponent 1.
pub(super) struct Dahl;

/// The search for the travel over which friction builds up.
pub(super) const BREAKAWAY: Shape = Shape {
    starts: &[0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.35, 0.6, 1.0],
    least: 5e-4,
    most: 2.0,
    reciprocal: true,
    tie: None,
};

/// Brings the state `z` of Dahl's law along a travel in units of u_c, by the exact solution for a
/// step of either direction.
///
/// 1 ∓ z falls by e^−|travel|; the decay of a negative number is 1, so that one of the two factors
/// is always idle.
pub(super) fn relax<S: Scalar>(z: S, travel: S) -> S {
    let [ahead, back, either] = travel.decay_of_either_sign();
    (z * either + (back - ahead)).within(S::one())
}

impl Effect for Dahl {
    const TAG: u8 = 14;
    const LOOKS_LIKE: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(4);

    const ABOUT: About = About {
        name: "dahl",
        title: "friction with presliding (Dahl)",
        equation: "r = F_c·z, dz/dx = (1 − z·sgn ẋ)/u_c",
        source: "P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1, 1968, with exponent 1",
        residual_signature: "the residual over the displacement is a loop that after every reversal approaches its flat part exponentially",
        separated_by: "Slow reversals at several amplitudes: steepest right after the reversal and bent from there on; Jenkins is \
                       straight until it slips, Bouc–Wen with n > 1 has a sharper knee.",
        parameters: &[
            Parameter::linear(
                "friction",
                "F_c",
                "friction force while sliding",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "breakaway_displacement",
                symbol: "u_c",
                meaning: "travel over which friction builds up to 63 %; F_c/u_c is the stiffness of the unloaded contact",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(BREAKAWAY),
            },
        ],
    };

    fn law<S: Scalar>(
        &[friction, per_breakaway, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        *z = relax(*z, at.travel(per_breakaway));
        [friction * *z, S::zero()]
    }
}
