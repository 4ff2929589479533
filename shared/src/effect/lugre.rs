//! Friction of bristles that bend before they slip, slip at a force that falls with speed, and are
//! damped while they bend.

use super::about::{About, Parameter, Role};
use super::dahl::{BREAKAWAY, relax};
use super::stribeck::{STRIBECK_VELOCITY, left_of_rest};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = g(ẋ)·z + σ₁·(ẋ − |ẋ|·z) with dz/dx = (1 − z·sgn ẋ)/u and g(ẋ) = F_c + (F_s −
/// F_c)·exp(−(ẋ/v_s)²).
///
/// z is the bend of the bristles over the bend at which they slip. In Canudas de Wit's notation it
/// is σ₀·z/g(v) and u = g(v)/σ₀ at rest, F_s/σ₀; here u keeps this value at all speeds, so bristles
/// that slip earlier are softer in proportion. At constant speed and near rest both say the same,
/// and this one keeps its state within ±1 and needs no quotient. A viscous part (σ₂) is the effect
/// `viscous`.
pub(super) struct LuGre;

impl Effect for LuGre {
    const TAG: u8 = 15;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(4);

    /// Friction at rest is never less than in motion.
    const NEVER_LESS: &'static [(usize, usize)] = &[(1, 0)];
    /// Bristles need no damping.
    const ONE_IS_ENOUGH: &'static [usize] = &[0, 2];
    const ABOUT: About = About {
        name: "lugre",
        title: "friction with presliding that falls with speed (LuGre)",
        equation: "r = g(ẋ)·z + σ₁·(ẋ − |ẋ|·z), dz/dx = (1 − z·sgn ẋ)/u, g(ẋ) = F_c + (F_s − F_c)·exp(−(ẋ/v_s)²)",
        source: "C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419–425; state normalised",
        residual_signature: "the residual over the displacement is a loop as with Dahl, and its flat part falls with speed",
        separated_by: "Slow reversals show the travel over which friction builds up, which Stribeck lacks; sweeps at constant speeds its \
                       fall, which Dahl lacks.",
        parameters: &[
            Parameter::linear(
                "friction",
                "F_c",
                "friction force at high speed",
                Dimension::FORCE,
                true,
            ),
            Parameter::linear(
                "static_friction",
                "F_s",
                "friction force when sliding begins",
                Dimension::FORCE,
                true,
            ),
            Parameter::linear(
                "bristle_damping",
                "σ₁",
                "damping while the bristles bend; none is left while they slip",
                Dimension::DAMPING,
                true,
            ),
            Parameter {
                name: "breakaway_displacement",
                symbol: "u",
                meaning: "travel over which the bristles bend to 63 %; F_s/u is their stiffness σ₀",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(BREAKAWAY),
            },
            Parameter {
                name: "stribeck_velocity",
                symbol: "v_s",
                meaning: "velocity at which 37 % of the difference of F_s and F_c is left",
                dimension: Dimension::VELOCITY,
                role: Role::Shape(STRIBECK_VELOCITY),
            },
        ],
    };

    fn law<S: Scalar>(
        &[friction, at_rest, damping, per_breakaway, per_fall, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        *z = relax(*z, at.travel(per_breakaway));
        let left = left_of_rest(at.velocity, per_fall);
        let size = friction + (at_rest - friction) * left;
        let damped = damping * at.velocity;
        let force = (size - damped.flip_sign(at.velocity)) * *z + damped;
        [force, S::zero()]
    }
}
