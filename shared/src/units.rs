//! Dimensions of a parameter: its unit in words, and the scale that turns it into a machine number.

use crate::base::axis::AxisKind;
use core::fmt;

/// A parameter's dimension as exponents of the joint's own quantities.
///
/// `force`, `displacement` and `velocity` are those of the axis that the effect is bound to; the
/// `other` ones belong to the joint's second axis. Velocity stands for itself, so that a
/// parameter's scale follows the range of the velocity and not that of the displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    /// Exponent of force: N or N·m.
    pub force: i8,
    /// Exponent of displacement: m or rad.
    pub displacement: i8,
    /// Exponent of velocity: m/s or rad/s.
    pub velocity: i8,
    /// Exponent of time: s.
    pub time: i8,
    /// N or N·m of the other axis.
    pub other_force: i8,
    /// m or rad of the other axis.
    pub other_displacement: i8,
    /// m/s or rad/s of the other axis.
    pub other_velocity: i8,
}

/// What the joint's quantities are measured against: each is positive, in SI, `[own, other]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct References {
    /// Reference force of the own and the other axis, N or N·m.
    pub force: [f64; 2],
    /// Reference displacement of the own and the other axis, m or rad.
    pub displacement: [f64; 2],
    /// Reference velocity of the own and the other axis, m/s or rad/s.
    pub velocity: [f64; 2],
    /// Reference time, s: the sample period on a device.
    pub time: f64,
}

impl References {
    /// All of them 1: quantities in SI stay as they are.
    pub const SI: Self = Self {
        force: [1.0; 2],
        displacement: [1.0; 2],
        velocity: [1.0; 2],
        time: 1.0,
    };

    /// The same joint seen from its other axis.
    pub fn swapped(self) -> Self {
        let swap = |[own, other]: [f64; 2]| [other, own];
        Self {
            force: swap(self.force),
            displacement: swap(self.displacement),
            velocity: swap(self.velocity),
            time: self.time,
        }
    }
}

impl Dimension {
    /// A number without unit.
    pub const NONE: Self = Self {
        force: 0,
        displacement: 0,
        velocity: 0,
        time: 0,
        other_force: 0,
        other_displacement: 0,
        other_velocity: 0,
    };
    /// A force or torque, N or N·m.
    pub const FORCE: Self = Self {
        force: 1,
        ..Self::NONE
    };
    /// A displacement or angle, m or rad.
    pub const DISPLACEMENT: Self = Self {
        displacement: 1,
        ..Self::NONE
    };
    /// A velocity, m/s or rad/s.
    pub const VELOCITY: Self = Self {
        velocity: 1,
        ..Self::NONE
    };
    /// A time, s.
    pub const TIME: Self = Self {
        time: 1,
        ..Self::NONE
    };
    /// A stiffness, N/m or N·m/rad.
    pub const STIFFNESS: Self = Self {
        force: 1,
        displacement: -1,
        ..Self::NONE
    };
    /// kg or kg·m²: force per acceleration.
    pub const INERTIA: Self = Self {
        force: 1,
        displacement: -1,
        time: 2,
        ..Self::NONE
    };
    /// A coefficient of viscous damping, N·s/m or N·m·s/rad.
    pub const DAMPING: Self = Self {
        force: 1,
        velocity: -1,
        ..Self::NONE
    };

    /// Whether a quantity of the other axis is part of it.
    pub const fn has_other_axis(self) -> bool {
        self.other_force != 0 || self.other_displacement != 0 || self.other_velocity != 0
    }

    /// The dimension of one over the quantity.
    pub const fn inverse(self) -> Self {
        Self {
            force: -self.force,
            displacement: -self.displacement,
            velocity: -self.velocity,
            time: -self.time,
            other_force: -self.other_force,
            other_displacement: -self.other_displacement,
            other_velocity: -self.other_velocity,
        }
    }

    /// The size of the unit in which a quantity of this dimension is a machine number, in SI: ∏
    /// reference^exponent.
    pub fn scale(self, references: &References) -> f64 {
        let [force, other_force] = references.force;
        let [displacement, other_displacement] = references.displacement;
        let [velocity, other_velocity] = references.velocity;
        let factors = [
            (force, self.force),
            (displacement, self.displacement),
            (velocity, self.velocity),
            (references.time, self.time),
            (other_force, self.other_force),
            (other_displacement, self.other_displacement),
            (other_velocity, self.other_velocity),
        ];
        factors
            .into_iter()
            .fold(1.0, |product, (reference, exponent)| {
                (0..exponent.unsigned_abs()).fold(product, |product, _| {
                    if exponent > 0 {
                        product * reference
                    } else {
                        product / reference
                    }
                })
            })
    }

    /// The SI unit in words, for an axis of the given kind beside another one.
    pub fn unit(self, own: AxisKind, other: AxisKind) -> Unit {
        let turns = |kind: AxisKind| kind == AxisKind::Rotation;
        let mut unit = Unit::default();
        for (kind, force, displacement, velocity) in [
            (own, self.force, self.displacement, self.velocity),
            (
                other,
                self.other_force,
                self.other_displacement,
                self.other_velocity,
            ),
        ] {
            unit.newton += force;
            unit.second -= velocity;
            if turns(kind) {
                unit.metre += force;
                unit.radian += displacement + velocity;
            } else {
                unit.metre += displacement + velocity;
            }
        }
        unit.second += self.time;
        let force_ratio = Self {
            force: 1,
            other_force: -1,
            ..Self::NONE
        };
        // The newtons cancel, and 1/m would not tell a reader what is divided by what.
        unit.force_ratio = (self == force_ratio && own != other).then_some(own);
        unit
    }
}

/// A unit as exponents of N, m, rad and s; prints as `N·s/(m·rad)`, an inertia as `kg` or `kg·m²`,
/// a frequency as `Hz`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unit {
    newton: i8,
    metre: i8,
    radian: i8,
    second: i8,
    /// Of a force per force of the other kind of axis: the kind of the first.
    force_ratio: Option<AxisKind>,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.force_ratio {
            Some(AxisKind::Translation) => return f.write_str("N/(N·m)"),
            Some(AxisKind::Rotation) => return f.write_str("N·m/N"),
            None => {}
        }
        match [self.newton, self.metre, self.radian, self.second] {
            [1, -1, 0, 2] => return f.write_str("kg"),
            [1, 1, -1, 2] => return f.write_str("kg·m²"),
            [0, 0, 0, -1] => return f.write_str("Hz"),
            _ => {}
        }
        let parts = [
            ("N", self.newton),
            ("m", self.metre),
            ("rad", self.radian),
            ("s", self.second),
        ];
        let above = parts.into_iter().filter(|(_, exponent)| *exponent > 0);
        let below = parts.into_iter().filter(|(_, exponent)| *exponent < 0);
        if above.clone().next().is_none() {
            f.write_str(if below.clone().next().is_none() {
                "–"
            } else {
                "1"
            })?;
        }
        product(f, above)?;
        match below.clone().count() {
            0 => Ok(()),
            1 => {
                f.write_str("/")?;
                product(f, below)
            }
            _ => {
                f.write_str("/(")?;
                product(f, below)?;
                f.write_str(")")
            }
        }
    }
}

fn product(
    f: &mut fmt::Formatter<'_>,
    parts: impl Iterator<Item = (&'static str, i8)>,
) -> fmt::Result {
    for (place, (name, exponent)) in parts.enumerate() {
        if place > 0 {
            f.write_str("·")?;
        }
        f.write_str(name)?;
        match exponent.unsigned_abs() {
            1 => {}
            2 => f.write_str("²")?,
            3 => f.write_str("³")?,
            n => write!(f, "^{n}")?,
        }
    }
    Ok(())
}
