//! A spring that acts on where the joint was: an active suspension, a controller or a fluid line that answers late.

use super::about::{About, Parameter, Role, Shape};
use super::{Bound, Effect, Fading, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k·x(t − τ), the delay taken as Padé's all-pass (s²τ² − 6sτ + 12)/(s²τ² + 6sτ + 12).
///
/// It is x less 4√3 times the imaginary part of a decaying phasor with (−3 + j√3)/τ, to which every travel adds; the sample's own travel is
/// taken to be made in its middle. The phase is that of the delay within 1 % up to ωτ = 1.6.
pub(super) struct DelayedFeedback;

impl Effect for DelayedFeedback {
    const TAG: u8 = 50;
    const STATE_BOUNDS: &'static [Bound] = &[Bound::Displacement(5), Bound::Displacement(5)];
    const FADING: Fading = Fading::WithTime;

    const ABOUT: About = About {
        name: "delayed_feedback",
        title: "spring that acts late (delayed feedback)",
        equation: "r = k·x(t − τ)",
        source: "delay: G. Stépán, Retarded Dynamical Systems, Longman 1989; its rational form: H. Padé, Ann. Sci. École Norm. Sup. 9 (1892) 3–93",
        absence: "the residual over the displacement is an ellipse that turns with the frequency: less damping, then less stiffness",
        separated_by: "A push that is held: the force comes after the delay in full. A Maxwell element's comes at once and goes; a late \
                       channel delays every force alike, this one only that of the displacement.",
        parameters: &[
            Parameter::linear(
                "stiffness",
                "k",
                "force per displacement at the time before",
                Dimension::STIFFNESS,
                false,
            ),
            Parameter {
                name: "delay",
                symbol: "τ",
                meaning: "time by which the force is late",
                dimension: Dimension::TIME,
                role: Role::Shape(Shape {
                    starts: &[0.005, 0.008, 0.012, 0.02, 0.03, 0.05],
                    least: 1e-3,
                    most: 0.5,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[stiffness, per_delay, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [p, q, ..]: &mut States<S>,
    ) -> [S; 2] {
        let half = (at.period * per_delay).half();
        let decay = (half * S::ratio(3, 1)).decay();
        // √3/2π turns per delay.
        let turns = half * S::ratio(113, 410);
        let cosine = decay * (turns + S::ratio(1, 4)).sine();
        let sine = decay * turns.sine();
        let turned = |p: S, q: S| [p * cosine - q * sine, q * cosine + p * sine];
        let [first, second] = turned(*p, *q);
        [*p, *q] = turned(first + at.step, second);
        let lost = *q * S::ratio(1351, 195);
        [stiffness * (at.displacement - lost), S::zero()]
    }
}
