//! A spring that stiffens (or softens) with the cube of the displacement.

use super::about::{About, Parameter};
use super::{Effect, Kinematics, Parameters, States};
use crate::scalar::Scalar;
use crate::units::Dimension;

/// r = k₃·x³.
pub(super) struct CubicHardening;

impl Effect for CubicHardening {
    const TAG: u8 = 6;

    const ABOUT: About = About {
        name: "cubic_hardening",
        title: "cubic spring",
        equation: "r = k₃·x³",
        source: "G. Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz, 1918",
        residual_signature: "the residual is an S over the displacement, growing with the third power of the amplitude",
        separated_by: "A slow push through the whole range: it bends everywhere, where clearance and end stops have a corner.",
        parameters: &[Parameter::linear(
            "cubic_stiffness",
            "k₃",
            "force per cube of displacement",
            Dimension {
                force: 1,
                displacement: -3,
                ..Dimension::NONE
            },
            false,
        )],
    };

    fn law<S: Scalar>(
        &[cubic, ..]: &Parameters<S>,
        at: &Kinematics<S>,
        _: &mut States<S>,
    ) -> [S; 2] {
        let x = at.displacement;
        [cubic * (x * x * x), S::zero()]
    }
}
