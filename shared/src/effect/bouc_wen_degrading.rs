//! Smooth hysteresis that grows softer with the largest displacement so far: masonry, concrete,
//! nailed timber, worn bolted laps.

use super::about::{About, Parameter, Role, Shape};
use super::bouc_wen::{BoucWen, held};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Number, Scalar};
use crate::units::Dimension;

/// r = F_y·z with dz/dx = (1 − |z|·(½ + ½·sgn(ẋ·z)))/(u_y·(1 + m/w)), where m is the largest |x|
/// since the record, or the device, began.
///
/// Bouc's and Wen's law with A = 1, β = γ = ½ and n = 1 whose yield displacement grows in
/// proportion to the largest displacement, as the branches of peak-oriented models do. Baber's and
/// Wen's own measure is the work that was lost so far, which has no bound on a device that never
/// stops.
pub(super) struct BoucWenDegrading;

impl Effect for BoucWenDegrading {
    const TAG: u8 = 62;
    const REPLACES: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::Number(1), StateBound::FromZero];
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(16);

    const ABOUT: About = About {
        name: "bouc_wen_degrading",
        title: "smooth hysteresis that degrades with the largest displacement (Bouc–Wen)",
        equation: "r = F_y·z, dz/dx = (1 − |z|·(½ + ½·sgn(ẋ·z)))/(u_y·(1 + m/w)), m = largest |x| so far",
        source: "T. T. Baber, Y.-K. Wen, J. Eng. Mech. Div. ASCE 107 (1981) 1069–1087",
        residual_signature: "the residual over the displacement is a loop that leans over with every new largest displacement",
        separated_by: "The same small cycles before and after a large one: Bouc–Wen repeats itself, and this loop stays leant over.",
        parameters: &[
            BoucWen::ABOUT.parameters[0],
            Parameter {
                role: Role::Shape(Shape {
                    starts: &[0.01, 0.05, 0.2],
                    least: 1e-3,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
                ..BoucWen::ABOUT.parameters[1]
            },
            Parameter {
                name: "degradation_displacement",
                symbol: "w",
                meaning: "largest displacement after which it is half as stiff",
                dimension: Dimension::DISPLACEMENT,
                role: Role::Shape(Shape {
                    starts: &[0.1, 0.5],
                    least: 0.02,
                    most: 10.0,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_yield, per_degradation, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, largest, ..]: &mut States<S>,
    ) -> [S; 2] {
        let one = S::Short::one();
        *largest = largest.max(at.displacement.abs());
        let softened = (*largest * per_degradation).hyperbolic_decay();
        // The factor rests while no displacement is the largest: roundings do not add up along a
        // path.
        let travel = at.short_travel(per_yield * softened, S::Short::ratio(2, 1));
        *z = held(*z, |z| {
            // Loading bends, unloading is straight.
            let ahead = z.flip_sign(travel).max(S::Short::zero());
            travel * (one - ahead)
        });
        [force * *z, S::zero()]
    }
}
