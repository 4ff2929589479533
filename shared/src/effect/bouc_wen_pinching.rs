//! Smooth hysteresis with slip about the middle of its way: bolts in worn holes, nailed timber,
//! cracked concrete.

use super::about::{About, Parameter, Role, Shape};
use super::bouc_wen::{BoucWen, held};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::{Number, Powers, Scalar};
use crate::units::Dimension;

/// r = F_y·z with dz/dx = (1 − ζ·b²)·(1 − |z|ⁿ·(½ + ½·sgn(ẋ·z)))/u_y and b = max(0, 1 − ((z·sgn ẋ −
/// q)/w)²).
///
/// Bouc's and Wen's law with A = 1 and β = γ = ½, in series with a slip lock: on the way to the
/// other side the spring is softer by ζ where the force is about q·F_y. It is Baber's and Noori's
/// law in Foliente's form with ζ, q and w that stay; b² stands for his Gaussian of two thirds of
/// the width, which takes a device several times as long.
pub(super) struct BoucWenPinching;

impl Effect for BoucWenPinching {
    const TAG: u8 = 52;
    const REPLACES: &'static [&'static str] = &["bouc_wen"];
    const STATE_BOUNDS: &'static [StateBound] = BoucWen::STATE_BOUNDS;
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(16);

    const ABOUT: About = About {
        name: "bouc_wen_pinching",
        title: "smooth hysteresis that is pinched in the middle (Baber–Noori)",
        equation: "r = F_y·z, dz/dx = (1 − ζ·b²)·(1 − |z|ⁿ·(½ + ½·sgn(ẋ·z)))/u_y, b = max(0, 1 − ((z·sgn ẋ − q)/w)²)",
        source: "T. T. Baber, M. N. Noori, J. Eng. Mech. 111 (1985) 1010–1026; G. C. Foliente, J. Struct. Eng. 121 (1995) 1013–1022",
        residual_signature: "the residual over the displacement is a loop that is thin about zero force and wide towards its ends",
        separated_by: "Slow cycles at several amplitudes: after a reversal the force falls steeply, creeps past zero and rises again. \
                       Free play has its flat part at one place.",
        parameters: &[
            BoucWen::ABOUT.parameters[0],
            Parameter {
                role: Role::Shape(Shape {
                    starts: &[0.03, 0.1, 0.3],
                    least: 1e-3,
                    most: 3.0,
                    reciprocal: true,
                    tie: None,
                }),
                ..BoucWen::ABOUT.parameters[1]
            },
            BoucWen::ABOUT.parameters[2],
            Parameter {
                name: "pinching",
                symbol: "ζ",
                meaning: "part of the stiffness that is lost where it slips",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.8],
                    least: 0.1,
                    most: 0.98,
                    reciprocal: false,
                    tie: None,
                }),
            },
            Parameter {
                name: "slip_level",
                symbol: "q",
                meaning: "force about which it slips, over F_y, on the side that it moves to",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.1],
                    least: 0.01,
                    most: 0.7,
                    reciprocal: false,
                    tie: None,
                }),
            },
            Parameter {
                name: "slip_width",
                symbol: "w",
                meaning: "how far from there it still slips, over F_y",
                dimension: Dimension::NONE,
                role: Role::Shape(Shape {
                    starts: &[0.45],
                    least: 0.08,
                    most: 1.5,
                    reciprocal: true,
                    tie: None,
                }),
            },
        ],
    };

    fn law<S: Scalar>(
        &[force, per_yield, exponent, pinching, level, per_width]: &Parameters<S>,
        at: &Kinematics<S>,
        [z, ..]: &mut States<S>,
    ) -> [S; 2] {
        let (exponent, pinching) = (exponent.short(), pinching.short());
        let travel = at.short_travel(per_yield, S::Short::ratio(2, 1));
        let one = S::Short::one();
        *z = held(*z, |z| {
            let ahead = z.flip_sign(travel);
            let off = (S::long(ahead) - level) * per_width;
            let off = off.within(S::one()).short();
            let bump = one - off * off;
            let slips = one - pinching * (bump * bump);
            // Loading bends, unloading is straight.
            let bend = ahead.max(S::Short::zero()).power(exponent);
            travel * slips * (one - bend)
        });
        [force * *z, S::zero()]
    }
}
