//! Smooth hysteresis that grows stiffer under load, as wire-rope isolators and rubber mounts do.

use super::about::{About, Parameter, Role, Shape};
use super::bouc_wen::held;
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Number, Scalar};
use crate::units::Dimension;

/// The largest force over F_h, which the internal state is relative to.
const MAX: i32 = 8;

/// r = F_h·z with dz/dx = (1 + |z|·(1 − η·sgn(ẋ·z)))/u_h, |z| held at 8.
///
/// Bouc's and Wen's law with n = 1 where their β + γ is negative: nothing yields, and no force is
/// the largest. With A = 1 and their z in units of u_h it is β + γ = −(1 − η) and β − γ = 1 + η. It
/// loses energy for η above 0.
pub(super) struct BoucWenHardening;

impl Effect for BoucWenHardening {
    const TAG: u8 = 51;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1)];
    // On the way to the limit what is off grows as the slope does, up to 1 + 8·(1 − η) times.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(32);

    const ABOUT: About = About {
        name: "bouc_wen_hardening",
        title: "smooth hysteresis that grows stiffer under load (Bouc–Wen with negative β + γ)",
        equation: "r = F_h·z, dz/dx = (1 + |z|·(1 − η·sgn(ẋ·z)))/u_h",
        source: "F. Ikhouane, J. Rodellar, Systems with Hysteresis, Wiley 2007, ch. 2",
        residual_signature: "the residual over the displacement is a loop whose branches bend upwards, thin in the middle and steep towards its ends",
        separated_by: "Slow cycles at several amplitudes: both ends grow stiffer with the swing, and it unloads more steeply than it was \
                       loaded; Bouc–Wen flattens.",
        parameters: &[
            Parameter::linear(
                "hardening_force",
                "F_h",
                "force at which it is twice as stiff as unloaded, on the mean of both ways",
                Dimension::FORCE,
                true,
            ),
            Parameter {
                name: "hardening_displacement",
                symbol: "u_h",
                meaning: "displacement at which the unloaded spring would reach F_h",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.2, 0.4, 0.8, 1.6],
                    least: 0.1,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
            Parameter {
                name: "loss_share",
                symbol: "η",
                meaning: "how much more steeply it unloads: 0 loses nothing, 1 hardens on unloading alone",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.4, 0.8],
                    least: 0.1,
                    most: 1.0,
                    reciprocal: false,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_displacement, loss, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        let one = S::Short::one();
        // That much in one sample leads from one limit to the other.
        let travel = at.short_travel(per_displacement, S::Short::ratio(2, 1));
        let ahead = loss.short().flip_sign(travel);
        let unloaded = S::Short::ratio(1, MAX);
        *z = held(*z, |z| {
            travel * (unloaded + z.abs().min(one) * (one - ahead.flip_sign(z)))
        });
        [force * *z * S::ratio(MAX, 1), S::zero()]
    }
}
