//! The SI symbols that belong to an axis, as they are printed.

use crate::study::{AxisKind, Role};
use jointwatch_shared::base::axis;

impl AxisKind {
    /// Unit of displacement: `m` or `rad`.
    pub fn displacement_unit(self) -> &'static str {
        match self {
            Self::Translation => "m",
            Self::Rotation => "rad",
        }
    }

    /// Unit of velocity: `m/s` or `rad/s`.
    pub fn velocity_unit(self) -> &'static str {
        match self {
            Self::Translation => "m/s",
            Self::Rotation => "rad/s",
        }
    }

    /// Unit of force: `N` or `N·m`.
    pub fn force_unit(self) -> &'static str {
        match self {
            Self::Translation => "N",
            Self::Rotation => "N·m",
        }
    }

    /// Unit of inertia: `kg` or `kg·m²`.
    pub fn inertia_unit(self) -> &'static str {
        match self {
            Self::Translation => "kg",
            Self::Rotation => "kg·m²",
        }
    }

    /// `translation` or `rotation`, as in study.toml.
    pub fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
        }
    }
}

impl Role {
    /// `train` or `validate`, as in study.toml.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validate => "validate",
        }
    }
}

impl From<axis::AxisKind> for AxisKind {
    fn from(kind: axis::AxisKind) -> Self {
        match kind {
            axis::AxisKind::Translation => Self::Translation,
            axis::AxisKind::Rotation => Self::Rotation,
        }
    }
}

impl From<AxisKind> for axis::AxisKind {
    fn from(kind: AxisKind) -> Self {
        match kind {
            AxisKind::Translation => Self::Translation,
            AxisKind::Rotation => Self::Rotation,
        }
    }
}
