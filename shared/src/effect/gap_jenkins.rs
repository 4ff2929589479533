//! Dry friction behind a spring and a gap: after every reversal the contact lets go, and nothing
//! acts until the gap is crossed.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Powers, Scalar};
use crate::units::Dimension;

/// r = F_s·|w|ⁿ·sgn w with w = dz(z, 1 − c)/c and z ← z + Δx/u held between −1 and 1.
///
/// z is the way from the slider, over the way u at which it slides. The first part (1 − c)·u of it
/// crosses the gap, the rest c·u compresses the spring. Unlike free play before a Jenkins element
/// the force falls to zero when the motion turns, and stays there through the whole gap. Without a
/// gap (c = 1, n = 1) it is the Jenkins element.
pub(super) struct GapJenkins;

/// The search for the travel from the middle of the gap to sliding.
const TRAVEL: Shape = Shape {
    starts: &[0.02, 0.04, 0.08, 0.15, 0.25, 0.4, 0.6, 0.9],
    least: 1e-3,
    most: 1.9,
    reciprocal: true,
    tie: None,
};

/// The search for the spring's share of the travel.
const SHARE: Shape = Shape {
    starts: &[0.25, 0.5, 0.8],
    least: 0.03,
    most: 1.0,
    reciprocal: true,
    tie: None,
};

/// The search for how the spring stiffens; the power that the device computes begins at 1.
const EXPONENT: Shape = Shape {
    starts: &[1.2, 2.0],
    least: 1.0,
    most: 4.0,
    reciprocal: false,
    tie: None,
};

impl Effect for GapJenkins {
    const TAG: u8 = 27;
    /// Without a gap it is the Jenkins element, or one with a spring that bends.
    const NOT_AT_MOST: &'static [usize] = &[2];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    // The state is that of a Jenkins element.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);

    const ABOUT: About = About {
        name: "gap_jenkins",
        title: "dry friction behind a spring and a gap",
        equation: "r = F_s·|w|ⁿ·sgn w, w = dz(z, 1 − c)/c, z ← z + Δx/u held within ±1",
        source: "M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989, ch. 1 and 3",
        residual_signature: "the residual over the displacement falls to zero after every reversal, stays there for a fixed travel, then rises to a plateau",
        separated_by: "Slow reversals at several amplitudes: after each a flat part of one length at zero force. A clearance has its flat \
                       part at one place; Jenkins and Bouc–Wen have none.",
        parameters: &[
            Parameter::linear(
                "slip_force",
                "F_s",
                "force at which the contact slides",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "slip_travel",
                symbol: "u",
                meaning: "travel from the middle of the gap to sliding: half the gap and the way of the spring",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(TRAVEL),
            },
            Parameter {
                name: "spring_share",
                symbol: "c",
                meaning: "share of that travel that compresses the spring; half the gap is (1 − c)·u",
                dimension: Dimension::NONE,
                role: Role::Shape(SHARE),
            },
            Parameter {
                name: "exponent",
                symbol: "n",
                meaning: "how the force rises once the gap is crossed: 1 is a straight line",
                dimension: Dimension::NONE,
                role: Role::Shape(EXPONENT),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_travel, per_share, exponent, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        *z = (*z + at.travel(per_travel)).within(S::one());
        let pressed = (*z * per_share).dead_zone(per_share - S::one());
        let size = pressed.abs().short().power(exponent.short());
        [force * S::long(size).flip_sign(pressed), S::zero()]
    }
}
