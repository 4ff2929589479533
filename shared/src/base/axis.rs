//! One axis of a model in SI units: its name, its kind, its inertia, and the range of motion that
//! the model has seen.

use crate::fault::{Checks, Error};

/// The largest size of any SI quantity in a model, and the inverse of the smallest positive one.
/// Far from anything a joint can show, and far enough from the ends of `f64` that products and
/// quotients of two of them are normal numbers.
pub const MAGNITUDE: f64 = 1e60;

/// The bytes that an axis's name may have.
pub const NAME_LEN: usize = 16;

/// Translation or rotation: which SI units the axis has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum AxisKind {
    /// Displacement in m, force in N, inertia in kg.
    Translation = 0,
    /// Displacement in rad, torque in N·m, inertia in kg·m².
    Rotation = 1,
}

/// Which way round the equation of motion gives the restoring force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Convention {
    /// r = force − inertia·acceleration (the paper's Eq. 8).
    ForceMinusInertia = 0,
    /// r = inertia·acceleration − force: the log holds the force by which the drive pulls the body.
    InertiaMinusForce = 1,
}

/// How one input is brought to ±1: u = (value − center) / half_range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputRange {
    /// Middle of the training range, SI.
    pub center: f64,
    /// Half its width, SI; positive.
    pub half_range: f64,
}

/// The model's error on records that it had not seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validation {
    /// 100·Σ(r − r̂)²/(N·var r), in percent.
    pub nmse_percent: f32,
    /// RMS(r − r̂)/RMS(r); a part and not percent.
    pub relative_error: f32,
}

/// An axis's name: 1 to 16 bytes of UTF-8 without control characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    pub(crate) bytes: [u8; NAME_LEN],
}

/// A measured quantity that the force of effects is proportional to: a voltage, a temperature, a
/// pressure, a normal load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Its name in the study.
    pub name: Name,
    /// Its training range, in the unit that the study gives it.
    pub range: InputRange,
}

/// One axis of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The name that stands behind the @ of an effect.
    pub name: Name,
    /// Whether it is a translation or a rotation.
    pub kind: AxisKind,
    /// Which way round the equation of motion gives the restoring force.
    pub convention: Convention,
    /// kg or kg·m²; 0 when the force channel already is the restoring force.
    pub inertia: f64,
    /// The range of the relative displacement, m or rad.
    pub displacement: InputRange,
    /// The range of the relative velocity, m/s or rad/s.
    pub velocity: InputRange,
    /// What effects of the axis may follow beside the motion.
    pub input: Option<Input>,
    /// The error on validation records; `None` when there were none.
    pub validation: Option<Validation>,
}

impl Name {
    /// A name.
    ///
    /// # Errors
    /// [`Error::Name`], which carries `axis`, says what is wrong.
    pub fn new(axis: u8, name: &str) -> Result<Self, Error> {
        let mut bytes = [0; NAME_LEN];
        match bytes.get_mut(..name.len()) {
            Some(place) => place.copy_from_slice(name.as_bytes()),
            None => {
                return Err(Error::Name {
                    axis,
                    fault: "is longer than 16 bytes",
                });
            }
        }
        Self::from_bytes(axis, bytes)
    }

    /// A name from 16 bytes, filled up with zeros.
    ///
    /// # Errors
    /// [`Error::Name`], which carries `axis`, says what is wrong.
    pub fn from_bytes(axis: u8, bytes: [u8; NAME_LEN]) -> Result<Self, Error> {
        let refuse = |fault| Err(Error::Name { axis, fault });
        match core::str::from_utf8(filled(&bytes)) {
            Err(_) => refuse("is not UTF-8"),
            Ok("") => refuse("is empty"),
            Ok(name) if name.chars().any(char::is_control) => refuse("holds a control character"),
            Ok(_) => Ok(Self { bytes }),
        }
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        // Every way to make a Name has checked that it is UTF-8.
        core::str::from_utf8(filled(&self.bytes)).unwrap_or_default()
    }
}

/// The bytes up to the zeros at the end.
fn filled(bytes: &[u8]) -> &[u8] {
    let mut rest = bytes;
    while let [before @ .., 0] = rest {
        rest = before;
    }
    rest
}

impl InputRange {
    /// The normalised value, −1 to 1 inside the training range.
    pub fn normalise(&self, value: f64) -> f64 {
        (value - self.center) / self.half_range
    }

    fn check(&self, checks: &mut Checks) {
        let most = MAGNITUDE;
        checks.within("center of an input range", self.center, -most, most);
        let quantity = "half width of an input range";
        checks.within(quantity, self.half_range, 1.0 / most, most);
    }
}

impl Axis {
    /// Checks what host and device rely on; [`Error::OutOfRange`] for the first quantity that is
    /// not usable.
    pub(super) fn check(&self, checks: &mut Checks) {
        self.displacement.check(checks);
        self.velocity.check(checks);
        if let Some(input) = &self.input {
            input.range.check(checks);
        }
        checks.within("inertia", self.inertia, 0.0, MAGNITUDE);
        if let Some(validation) = self.validation {
            let most = f64::from(f32::MAX);
            let nmse = f64::from(validation.nmse_percent);
            checks.within("validation NMSE in percent", nmse, 0.0, most);
            let error = f64::from(validation.relative_error);
            checks.within("relative validation error", error, 0.0, most);
        }
    }
}
