//! Smooth hysteresis: a spring that yields gradually and remembers where it came from.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Number, Powers, Scalar};
use crate::units::Dimension;

/// r = F_y·z with dz/dx = (1 − |z|ⁿ·(1 − γ + γ·sgn(ẋ·z)))/u_y.
///
/// Bouc's and Wen's A, β and γ, of which only two ratios count, are chosen so that the largest
/// force is F_y and the slope of the unloaded spring F_y/u_y: A = 1 and β + γ = 1. From ½ on γ
/// gives loops that lose energy. γ = 1 with n = 1 is Dahl's law.
///
/// A sample's step is integrated by three stages of third order, each a held Euler step (Shu and
/// Osher, J. Computational Physics 77 (1988) 439–471): the state cannot leave ±1 however large the
/// step.
pub(super) struct BoucWen;

impl Effect for BoucWen {
    const TAG: u8 = 12;
    const LOOKS_LIKE: &'static [&'static str] = &["jenkins"];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(4);

    const ABOUT: About = About {
        name: "bouc_wen",
        title: "smooth hysteresis (Bouc–Wen)",
        equation: "r = F_y·z, dz/dx = (1 − |z|ⁿ·(1 − γ + γ·sgn(ẋ·z)))/u_y",
        source: "R. Bouc, 4th Conf. Non-Linear Oscillation, Prague 1967; Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249–263",
        residual_signature: "the residual over the displacement is a rounded loop whose width does not depend on speed",
        separated_by: "Slow reversals at several amplitudes: the flanks bend smoothly into the flat part, where Jenkins has a corner. \
                       Dahl has a blunter knee.",
        parameters: &[
            Parameter::linear(
                "yield_force",
                "F_y",
                "largest force of the hysteresis",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "yield_displacement",
                symbol: "u_y",
                meaning: "displacement at which the unloaded spring would reach F_y if it did not yield before",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.01, 0.03, 0.07, 0.15, 0.3, 0.6],
                    least: 1e-3,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "exponent",
                symbol: "n",
                meaning: "sharpness of the knee: 1 is the roundest",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[1.2, 2.0],
                    least: 1.0,
                    most: 4.0,
                    reciprocal: false,
                    tie: None,
                }),
            },
            Parameter {
                name: "unloading_share",
                symbol: "γ",
                meaning: "how much steeper it unloads than it was loaded: ½ is a straight line, 1 the steepest",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.7],
                    least: 0.5,
                    most: 1.0,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_yield, exponent, share, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        let (exponent, share) = (exponent.short(), share.short());
        // Two yield displacements in one sample saturate it either way.
        let travel = at.short_travel(per_yield, S::Short::ratio(2, 1));
        let one = S::Short::one();
        let ahead = share.flip_sign(travel);
        // A travel of 0 adds 0 to the last bit, and so does one that loads what has yielded.
        *z = held(*z, |z| {
            let bend = one - (share - ahead.flip_sign(z));
            travel * (one - z.abs().power(exponent) * bend)
        });
        [force * *z, S::zero()]
    }
}

/// A state one sample later, from what an Euler step adds to a state: three stages, each held so
/// that it does not leave ±1.
pub(super) fn held<S: Scalar>(before: S, free: impl Fn(S::Short) -> S::Short) -> S {
    let (before, one) = (before.short(), S::Short::one());
    let increment = |z: S::Short| (-one - z).max((one - z).min(free(z)));
    let first = increment(before);
    let second = increment(before + first);
    let mean = (first + second).half();
    let third = increment(before + mean.half());
    // Where nothing bends all three are alike, and what is added is the travel to the last bit.
    let after = before + (third + S::Short::ratio(1, 3) * (mean - third));
    S::long(after.within(one))
}
