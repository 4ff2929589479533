//! A force that answers to where the joint was a while ago: a controller that samples, a valve
//! behind a long line, a drive that corrects late.

use super::about::{About, Parameter, Role, Shape};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·x(t − τ), the delay as three all-pass sections: e^(−sτ) ≈ ((1 − sτ/6)/(1 + sτ/6))³.
///
/// The delay is right to a part of (ωτ)²/108: 1 % up to ωτ = 1. Each state is what a section adds
/// to what goes in, eᵢ with ėᵢ = −2·u̇ᵢ − (6/τ)·eᵢ, of which the later ones are kept in quarters:
/// so the device's error of no state grows faster than the state forgets it. Before a record the
/// joint is taken to have been at rest.
pub(super) struct DelayedFeedback;

/// Sections of the delay.
const SECTIONS: usize = 3;

impl Effect for DelayedFeedback {
    const TAG: u8 = 64;
    // The sections of an all-pass raise a displacement of ±1 to 3, 4.3, 5.5 … at most.
    const STATE_BOUNDS: &'static [StateBound] = &[
        StateBound::Displacement(4),
        StateBound::Displacement(2),
        StateBound::Displacement(1),
    ];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::WithTime;

    const ABOUT: About = About {
        name: "delayed_feedback",
        title: "force that follows the displacement late (delayed feedback)",
        equation: "r = k·x(t − τ)",
        source: "N. Olgac, B. T. Holm-Hansen, J. Sound and Vibration 176 (1994) 93–104: a force proportional to the delayed displacement",
        residual_signature: "the residual is a loop that feeds energy in at low frequencies and takes it out at higher ones, turn by turn",
        separated_by: "A step of the displacement: the force follows as a step, after the delay, where that of a Maxwell element is there at once and fades.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "force per displacement of a while ago",
                Dimension::STIFFNESS,
                false,
            ),
            Parameter {
                name: "delay",
                symbol: "τ",
                meaning: "by how much the force is late",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[0.006, 0.012, 0.025, 0.05, 0.1],
                    least: 0.004,
                    most: 1.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, per_delay, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        states: &mut States<S>,
    ) -> [S; 2] {
        // An all-pass of samples is late by (1 + a)/(1 − a) of them, so ln a = −2·artanh l with
        // l = 3T/τ, of which the next term is a part of l⁴/5.
        let lag = at.period * per_delay;
        let lags = lag + lag + lag;
        let kept = ((lags + lags) * (S::one() + lags * lags * S::ratio(1, 3))).decay();
        let lost = S::one() - kept;
        let (mut step, mut before) = (at.step, S::zero());
        for (place, added) in states.iter_mut().take(SECTIONS).enumerate() {
            if place > 0 {
                step = -(step * kept + before * lost).half().half();
            }
            before = *added;
            *added = (before - step) * kept - step;
        }
        let mut late = S::zero();
        for (place, &added) in states.iter().take(SECTIONS).rev().enumerate() {
            if place > 0 {
                late = late + late;
                late = late + late;
            }
            late = late + added;
        }
        [stiffness * (at.displacement + late), S::zero()]
    }
}
