//! Dry friction that follows a reversal late, like that of a damper whose fluid has to build up its
//! structure or its pressure first.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = F_c·z with τ·ż = tanh(ẋ/v_t) − z.
///
/// Between two samples what the lag follows is taken to change on a straight line, of which the
/// step is exact but for a part of (T/τ)⁴/2000. Of a switch sharper than the lag nothing is left to
/// see, so the search for v_t begins wider than that of dry friction.
pub(super) struct LaggedFriction;

impl Effect for LaggedFriction {
    const TAG: u8 = 35;
    const REPLACES: &'static [&'static str] = &["coulomb"];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1), StateBound::Number(1)];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::WithTime;

    const ABOUT: About = About {
        name: "lagged_friction",
        title: "dry friction behind a first-order lag",
        equation: "r = F_c·z, τ·ż = tanh(ẋ/v_t) − z",
        source: "for magneto-rheological dampers G. Yang et al., Engineering Structures 24 (2002) 309–323: rise time of the yield force",
        residual_signature: "the residual over the velocity is a step that is late in either direction: a loop around rest, wider at a higher frequency",
        separated_by: "Reversals at several frequencies: the delay is the same time at all of them; Dahl, Jenkins and Bouc–Wen need the same \
                       travel instead.",
        parameters: &[
            Parameter::linear(
                "friction",
                "F_c",
                "friction force long after a reversal",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "lag",
                symbol: "τ",
                meaning: "time in which friction makes 63 % of its way to the new sign",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[0.002, 0.005, 0.01, 0.02, 0.05, 0.1],
                    least: 3e-4,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "transition_velocity",
                symbol: "v_t",
                meaning: "velocity at which 76 % of the friction force is reached in the end",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(Shape {
                    starts: &[0.02, 0.06, 0.2],
                    least: 1e-3,
                    most: 1.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[friction, per_lag, per_transition, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, before, ..]: &mut States<S>,
    ) -> [S; 2] {
        let now = (at.velocity * per_transition).tanh();
        let lags = at.period * per_lag;
        let half = lags.half().decay();
        let kept = half * half;
        // (1 − e^−a)/a.
        let mean = half + half * (lags * lags) * S::ratio(1, 24);
        let followed = *before * (mean - kept) + now * (S::one() - mean);
        *z = (*z * kept + followed).within(S::one());
        *before = now;
        [friction * *z, S::zero()]
    }
}
