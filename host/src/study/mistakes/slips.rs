//! The slips of units that a gain betrays.

/// A slip that a gain betrays: the factor, the cause, and which channel to change how.
pub(super) struct Slip {
    pub(super) gain: f64,
    pub(super) cause: &'static str,
    pub(super) cure: Cure,
}

pub(super) enum Cure {
    /// This unit for the derivative.
    Derivative(&'static str),
    /// This unit for the position.
    Position(&'static str),
}

pub(super) const LINEAR_SLIPS: &[Slip] = &[
    Slip {
        gain: 1.0 / 9.806_65,
        cause: "it is in g",
        cure: Cure::Derivative("g"),
    },
    Slip {
        gain: 1e3,
        cause: "it is in mm/s²",
        cure: Cure::Derivative("mm/s^2"),
    },
    Slip {
        gain: 1e-3,
        cause: "the position is in mm",
        cure: Cure::Position("mm"),
    },
    Slip {
        gain: 1e-2,
        cause: "the position is in cm",
        cure: Cure::Position("cm"),
    },
    Slip {
        gain: 1e-6,
        cause: "the position is in µm",
        cure: Cure::Position("um"),
    },
    Slip {
        gain: 0.0254,
        cause: "the position is in inches",
        cure: Cure::Position("in"),
    },
    Slip {
        gain: 1e3 / 9.806_65,
        cause: "it is in mg (thousandths of g)",
        cure: Cure::Derivative("mg"),
    },
    Slip {
        gain: 9.806_65,
        cause: "it is in m/s² and study.toml says g",
        cure: Cure::Derivative("m/s^2"),
    },
    Slip {
        gain: 1e-3 / 9.806_65,
        cause: "it is in g and the position in mm",
        cure: Cure::Position("mm"),
    },
];

pub(super) const ANGULAR_SLIPS: &[Slip] = &[
    Slip {
        gain: 57.295_779_5,
        cause: "it is in degrees per s²",
        cure: Cure::Derivative("deg/s^2"),
    },
    Slip {
        gain: 1.0 / 57.295_779_5,
        cause: "the angle is in degrees",
        cure: Cure::Position("deg"),
    },
    Slip {
        gain: 1e-3,
        cause: "the angle is in mrad",
        cure: Cure::Position("mrad"),
    },
];

pub(super) const SPEED_SLIPS: &[Slip] = &[
    Slip {
        gain: 1e3,
        cause: "it is in mm/s",
        cure: Cure::Derivative("mm/s"),
    },
    Slip {
        gain: 1e2,
        cause: "it is in cm/s",
        cure: Cure::Derivative("cm/s"),
    },
    Slip {
        gain: 1.0 / 0.0254,
        cause: "it is in in/s",
        cure: Cure::Derivative("in/s"),
    },
    Slip {
        gain: 1e-3,
        cause: "the displacement is in mm",
        cure: Cure::Position("mm"),
    },
    Slip {
        gain: 1e-2,
        cause: "the displacement is in cm",
        cure: Cure::Position("cm"),
    },
    Slip {
        gain: 0.0254,
        cause: "the displacement is in inches",
        cure: Cure::Position("in"),
    },
];

pub(super) const TURNING_SLIPS: &[Slip] = &[
    Slip {
        gain: 57.295_779_5,
        cause: "it is in degrees per second",
        cure: Cure::Derivative("deg/s"),
    },
    Slip {
        gain: 1.0 / 57.295_779_5,
        cause: "the angle is in degrees",
        cure: Cure::Position("deg"),
    },
    Slip {
        gain: 9.549_296_6,
        cause: "it is in revolutions per minute",
        cure: Cure::Derivative("rpm"),
    },
];

/// Units in which a force may be logged, where the mass that it shows is wrong by a factor.
pub(super) const FORCES: &[&str] = &["N", "kN", "mN", "lbf", "kgf"];
/// The same of a torque.
pub(super) const TORQUES: &[&str] = &["N*m", "kN*m", "mN*m", "lbf*in", "lbf*ft"];
