//! A spring that has become softer with the largest displacement that it has seen, like filled
//! rubber.

use super::about::{About, Parameter};
use super::{Effect, ErrorPropagation, Kinematics, Parameters, StateBound, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = −k_s·x·m, where m is the largest |x| since the record, or the device, began.
///
/// Beside a spring k the stiffness is k − k_s·m.
pub(super) struct Mullins;

impl Effect for Mullins {
    const TAG: u8 = 44;
    const STATE_BOUNDS: &'static [StateBound] = &[StateBound::FromZero];
    // The largest of values that are off by no more than a position's error is off by no more.
    const ERROR_PROPAGATION: ErrorPropagation = ErrorPropagation::Within(1);

    const ABOUT: About = About {
        name: "mullins",
        title: "stiffness that falls with the largest displacement so far (Mullins)",
        equation: "r = −k_s·x·m, m = largest |x| so far",
        source: "L. Mullins, Rubber Chemistry and Technology 42 (1969) 339–362; in proportion to the largest displacement",
        residual_signature: "the residual is a spring's, stiff at the beginning of a record and softer after every new largest displacement",
        separated_by: "The same small motion before and after a large one: the stiffness has fallen and stays so; hardening and softening \
                       springs come back.",
        parameters: &[Parameter::linear(
            "softening",
            "k_s",
            "stiffness lost per largest displacement",
            Dimension {
                force: 1,
                displacement: -2,
                ..Dimension::NONE
            },
            true,
        )],
    };

    fn law<S: Scalar>(
        &[softening, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        [largest, ..]: &mut States<S>,
    ) -> [S; 2] {
        *largest = largest.max(at.displacement.abs());
        [-(softening * (at.displacement * *largest)), S::zero()]
    }
}
