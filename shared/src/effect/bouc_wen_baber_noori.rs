//! Smooth hysteresis that degrades and pinches together: reinforced concrete, masonry, timber walls
//! and bolted frames that were loaded into damage.

use super::about::{About, Parameter, Role, Shape};
use super::bouc_wen::held;
use super::bouc_wen_degrading::BoucWenDegrading;
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Number, Scalar};
use crate::units::Dimension;

/// r = F_y·z with dz/dx = (1 − d·b²)·(1 − |z|·(½ + ½·sgn(ẋ·z)))/(u_y·(1 + m/w)), where m is the
/// largest |x| since the record, or the device, began, d = m/(w + m) and b = max(0, 1 − (z/q)²).
///
/// The law of `bouc_wen_degrading` in series with a slip lock, which opens with the same damage d:
/// cracks that were opened are closed again before the joint carries force the other way. It is
/// Baber's and Noori's law with the largest displacement for the work lost so far, and slip about
/// no force.
pub(super) struct BoucWenBaberNoori;

impl Effect for BoucWenBaberNoori {
    const TAG: u8 = 63;
    const REPLACES: &'static [&'static str] = &["bouc_wen_degrading", "bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = BoucWenDegrading::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(16);

    const ABOUT: About = About {
        name: "bouc_wen_baber_noori",
        title: "hysteresis that degrades and pinches (Bouc–Wen–Baber–Noori)",
        equation: "dz/dx of bouc_wen_degrading times 1 − d·b², d = m/(w + m), b = max(0, 1 − (z/q)²)",
        source: "T. T. Baber, M. N. Noori, J. Eng. Mech. 111 (1985) 1010–1026",
        residual_signature: "the residual over the displacement is a loop that thins about zero force with every new largest displacement",
        separated_by: "The same small cycles before and after a large one: after it the loop creeps past zero force.",
        parameters: &[
            BoucWenDegrading::ABOUT.parameters[0],
            BoucWenDegrading::ABOUT.parameters[1],
            BoucWenDegrading::ABOUT.parameters[2],
            Parameter {
                name: "slip_level",
                symbol: "q",
                meaning: "force up to which it slips, over F_y",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.4],
                    least: 0.15,
                    most: 1.5,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_yield, per_degradation, per_level, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, largest, ..]: &mut States<S>,
    ) -> [S; 2] {
        let (one, per_level) = (S::Short::one(), per_level.short());
        *largest = largest.max(at.displacement.abs());
        let softened = (*largest * per_degradation).hyperbolic_decay();
        let damage = one - softened.short();
        let travel = at.short_travel(per_yield * softened, S::Short::ratio(2, 1));
        *z = held(*z, |z| {
            let off = (z.abs() * per_level).min(one);
            let bump = one - off * off;
            let slips = one - damage * (bump * bump);
            // Loading bends, unloading is straight.
            let ahead = z.flip_sign(travel).max(S::Short::zero());
            travel * slips * (one - ahead)
        });
        [force * *z, S::zero()]
    }
}
