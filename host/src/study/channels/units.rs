//! The units a channel may be logged in, and what each is in SI.

use crate::study::AxisKind;
use std::f64::consts::PI;

/// What a channel measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// s.
    Time,
    /// m or rad.
    Displacement(AxisKind),
    /// m/s or rad/s.
    Velocity(AxisKind),
    /// m/s² or rad/s².
    Acceleration(AxisKind),
    /// N or N·m.
    Force(AxisKind),
    /// Whatever an input is in: it is not converted.
    Input,
}

const INCH: f64 = 0.0254;
const FOOT: f64 = 0.3048;
/// Standard gravity, m/s² (CGPM 1901); also turns the pound (0.45359237 kg) into the pound-force.
const GRAVITY: f64 = 9.806_65;
const POUND_FORCE: f64 = 0.453_592_37 * GRAVITY;

/// Units without a size of their own: the channel's `scale` must say how many SI units one of them
/// is.
const BARE: [&str; 10] = ["V", "mV", "A", "mA", "mV/V", "count", "bit", "%", "1", "-"];

/// Units of channels that no study uses, met in rows of units.
const OTHER: [&str; 12] = [
    "W", "K", "C", "degC", "Pa", "kPa", "MPa", "bar", "Hz", "kHz", "1/s", "Ohm",
];

/// Units written out, in the singular and in small letters.
const WORDS: [(&str, &str); 41] = [
    ("second", "s"),
    ("sec", "s"),
    ("seconde", "s"),
    ("sekunde", "s"),
    ("millisecond", "ms"),
    ("millisekunde", "ms"),
    ("msec", "ms"),
    ("microsecond", "us"),
    ("usec", "us"),
    ("minute", "min"),
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("micron", "um"),
    ("inch", "in"),
    ("inche", "in"),
    ("thou", "mil"),
    ("degree", "deg"),
    ("grad", "deg"),
    ("radian", "rad"),
    ("turn", "rev"),
    ("newton", "N"),
    ("kilonewton", "kN"),
    ("pound", "lbf"),
    ("lb", "lbf"),
    ("oz", "ozf"),
    ("kg", "kgf"),
    ("kp", "kgf"),
    ("g'", "g"),
    ("gn", "g"),
    ("rpm", "rpm"),
    ("min-1", "rpm"),
    ("volt", "V"),
    ("inc", "count"),
    ("cnt", "count"),
    ("tick", "count"),
    ("digit", "count"),
    ("lsb", "count"),
    ("percent", "%"),
    ("hertz", "Hz"),
];

const TIME: &[(&str, f64)] = &[
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("min", 60.0),
];
const LENGTH: &[(&str, f64)] = &[
    ("m", 1.0),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("um", 1e-6),
    ("nm", 1e-9),
    ("in", INCH),
    ("mil", 1e-3 * INCH),
    ("ft", FOOT),
];
const ANGLE: &[(&str, f64)] = &[
    ("rad", 1.0),
    ("urad", 1e-6),
    ("mrad", 1e-3),
    ("deg", PI / 180.0),
    ("arcmin", PI / 10_800.0),
    ("rev", 2.0 * PI),
];
const SPEED: &[(&str, f64)] = &[
    ("m/s", 1.0),
    ("mm/s", 1e-3),
    ("cm/s", 1e-2),
    ("um/s", 1e-6),
    ("mm/min", 1e-3 / 60.0),
    ("m/min", 1.0 / 60.0),
    ("mps", 1.0),
    ("kph", 1.0 / 3.6),
    ("km/h", 1.0 / 3.6),
    ("in/s", INCH),
    ("ft/s", FOOT),
];
const TURNING: &[(&str, f64)] = &[
    ("rad/s", 1.0),
    ("mrad/s", 1e-3),
    ("deg/s", PI / 180.0),
    ("rpm", PI / 30.0),
    ("rev/s", 2.0 * PI),
];
const ACCELERATION: &[(&str, f64)] = &[
    ("m/s^2", 1.0),
    ("mm/s^2", 1e-3),
    ("cm/s^2", 1e-2),
    ("mps2", 1.0),
    ("in/s^2", INCH),
    ("ft/s^2", FOOT),
    ("g", GRAVITY),
    ("mg", 1e-3 * GRAVITY),
];
const ANGULAR_ACCELERATION: &[(&str, f64)] = &[
    ("rad/s^2", 1.0),
    ("mrad/s^2", 1e-3),
    ("deg/s^2", PI / 180.0),
    ("rev/s^2", 2.0 * PI),
];
const FORCE: &[(&str, f64)] = &[
    ("N", 1.0),
    ("pN", 1e-12),
    ("nN", 1e-9),
    ("uN", 1e-6),
    ("mN", 1e-3),
    ("daN", 10.0),
    ("kN", 1e3),
    ("MN", 1e6),
    ("lbf", POUND_FORCE),
    ("ozf", POUND_FORCE / 16.0),
    ("kip", 1e3 * POUND_FORCE),
    ("kgf", GRAVITY),
    ("gf", 1e-3 * GRAVITY),
    // As testers of texture and of wear write it.
    ("g", 1e-3 * GRAVITY),
];
/// A torque is a force times a length, either of which may stand first.
const TORQUE: &[(&str, f64)] = &[
    ("N*m", 1.0),
    ("uN*m", 1e-6),
    ("mN*m", 1e-3),
    ("daN*m", 10.0),
    ("kN*m", 1e3),
    ("N*mm", 1e-3),
    ("N*cm", 1e-2),
    ("kgf*m", GRAVITY),
    ("kgf*cm", 1e-2 * GRAVITY),
    ("lbf*in", POUND_FORCE * INCH),
    ("lbf*ft", POUND_FORCE * FOOT),
    ("ozf*in", POUND_FORCE / 16.0 * INCH),
];
/// Torques that are written as one word.
const TORQUE_WORDS: [(&str, &str); 6] = [
    ("Nm", "N*m"),
    ("NM", "N*m"),
    ("mNm", "mN*m"),
    ("kNm", "kN*m"),
    ("Nmm", "N*mm"),
    ("Ncm", "N*cm"),
];

impl Quantity {
    fn table(self) -> &'static [(&'static str, f64)] {
        use AxisKind::{Rotation, Translation};
        match self {
            Self::Time => TIME,
            Self::Displacement(Translation) => LENGTH,
            Self::Displacement(Rotation) => ANGLE,
            Self::Velocity(Translation) => SPEED,
            Self::Velocity(Rotation) => TURNING,
            Self::Acceleration(Translation) => ACCELERATION,
            Self::Acceleration(Rotation) => ANGULAR_ACCELERATION,
            Self::Force(Translation) => FORCE,
            Self::Force(Rotation) => TORQUE,
            Self::Input => &[],
        }
    }

    /// The SI unit, as people write it; nothing for an input.
    pub(crate) fn si(self) -> String {
        let first = self.si_unit().unwrap_or_default();
        first.replace('*', "·").replace("^2", "²")
    }

    /// The SI unit, as study.toml has it; nothing for an input.
    pub(crate) fn si_unit(self) -> Option<&'static str> {
        self.table().first().map(|(unit, _)| *unit)
    }

    /// How many SI units one `unit` is, or the end of a sentence that says what is wrong with it.
    ///
    /// `scaled` tells whether the channel states a scale, without which a volt or a count means
    /// nothing.
    pub(crate) fn factor(self, unit: &str, scaled: bool) -> Result<f64, String> {
        if self == Self::Input {
            return Ok(1.0);
        }
        let plain = normalised(unit);
        if is_bare(unit) {
            return if scaled {
                Ok(1.0)
            } else {
                Err(format!(
                    "unit {unit:?} has no size of its own; add scale = … in {} per {unit}",
                    self.table()[0].0
                ))
            };
        }
        let exact = self.table().iter().find(|(name, _)| *name == plain);
        // Some programs write all units in capitals; where two differ in nothing else, as mN and MN
        // do, that is no answer.
        let alike = |(name, _): &&(&str, f64)| name.eq_ignore_ascii_case(&plain);
        let mut loosely = self.table().iter().filter(alike);
        let only = loosely.next().filter(|_| loosely.next().is_none());
        if let Some((_, factor)) = exact.or(only) {
            return Ok(*factor);
        }
        let allowed: Vec<&str> = self.table().iter().map(|(name, _)| *name).collect();
        let instead = self
            .of_other_kind()
            .filter(|(other, _)| other.table().iter().any(|(name, _)| *name == plain))
            .map(|(_, kind)| format!(", or kind = {:?} for the axis", kind.name()));
        Err(format!(
            "unit {unit:?} is not one of {}; use {} with a scale{}",
            self.words(),
            allowed.join(", ") + ", or V, A or counts",
            instead.unwrap_or_default()
        ))
    }

    /// What it is on an axis of the other kind, with that kind.
    fn of_other_kind(self) -> Option<(Self, AxisKind)> {
        let (of, kind): (fn(AxisKind) -> Self, _) = match self {
            Self::Displacement(kind) => (Self::Displacement, kind),
            Self::Velocity(kind) => (Self::Velocity, kind),
            Self::Acceleration(kind) => (Self::Acceleration, kind),
            Self::Force(kind) => (Self::Force, kind),
            Self::Time | Self::Input => return None,
        };
        let other = match kind {
            AxisKind::Translation => AxisKind::Rotation,
            AxisKind::Rotation => AxisKind::Translation,
        };
        Some((of(other), other))
    }

    fn words(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Displacement(AxisKind::Translation) => "length",
            Self::Displacement(AxisKind::Rotation) => "angle",
            Self::Velocity(AxisKind::Translation) => "velocity",
            Self::Velocity(AxisKind::Rotation) => "angular velocity",
            Self::Acceleration(AxisKind::Translation) => "acceleration",
            Self::Acceleration(AxisKind::Rotation) => "angular acceleration",
            Self::Force(AxisKind::Translation) => "force",
            Self::Force(AxisKind::Rotation) => "torque",
            Self::Input => "input",
        }
    }
}

/// The unit of which one is so many seconds.
pub(crate) fn unit_of_time(seconds: f64) -> Option<&'static str> {
    let same = |(_, size): &&(&str, f64)| (seconds / size - 1.0).abs() < 1e-9;
    TIME.iter().find(same).map(|(unit, _)| *unit)
}

/// Whether a unit has no size of its own.
pub(crate) fn is_bare(unit: &str) -> bool {
    BARE.contains(&normalised(unit).as_str())
}

/// Whether a unit is a g, of a force less often than of an acceleration.
pub(crate) fn is_g(unit: &str) -> bool {
    normalised(unit) == "g"
}

/// Whether a unit is one of a current.
pub(crate) fn is_of_current(unit: &str) -> bool {
    ["A", "mA"].contains(&normalised(unit).as_str())
}

/// Whether a text is the name of any unit, or of what has none.
pub(crate) fn is_a_unit(text: &str) -> bool {
    let plain = normalised(text);
    let tables = [
        TIME,
        LENGTH,
        ANGLE,
        SPEED,
        TURNING,
        ACCELERATION,
        ANGULAR_ACCELERATION,
        FORCE,
        TORQUE,
    ];
    let capitals = plain.len() > 1 && plain.chars().all(|c| c.is_ascii_uppercase());
    let is = |name: &str| name == plain || capitals && name.eq_ignore_ascii_case(&plain);
    let listed = tables.iter().any(|t| t.iter().any(|(name, _)| is(name)));
    listed || is_bare(text) || OTHER.contains(&plain.as_str())
}

/// One spelling for the many in use: N·m, N.m, N-m and Nm; µm; m/s², m/s2, m/sec^2, m/s/s and m
/// s-2; °/s; tr/min.
fn normalised(unit: &str) -> String {
    if let Some(short) = word(unit) {
        return short.to_owned();
    }
    let mut plain = unit.trim().replace(['·', '⋅', '.', '*'], " ");
    for (written, meant) in [
        ("µ", "u"),
        ("μ", "u"),
        ("°", "deg"),
        ("⁻¹", "-1"),
        ("⁻²", "-2"),
        ("^-", "-"),
        ("  2", "^2"),
        ("²", "^2"),
        ("sec", "s"),
        ("/s2", "/s^2"),
        ("/s/s", "/s^2"),
        (" per ", "/"),
        (" s-2", "/s^2"),
        (" s-1", "/s"),
        (" min-1", "/min"),
    ] {
        plain = plain.replace(written, meant);
    }
    if let Some(turns) = plain.strip_suffix("/min")
        && ["1", "r", "rev", "tr", "U"].contains(&turns)
    {
        return "rpm".to_owned();
    }
    if let Some(short) = word(&plain) {
        return short.to_owned();
    }
    let plain = plain.replace(' ', "*");
    if let Some((_, product)) = TORQUE_WORDS.iter().find(|(word, _)| *word == plain) {
        return (*product).to_owned();
    }
    match plain.split_once(['*', '-']) {
        Some((a, b)) if !a.is_empty() && !b.is_empty() => {
            let [a, b] = [a, b].map(|part| word(part).unwrap_or(part));
            match LENGTH.iter().any(|(length, _)| *length == a) {
                true => format!("{b}*{a}"),
                false => format!("{a}*{b}"),
            }
        }
        _ => plain,
    }
}

/// The sign of a unit that is written out.
fn word(unit: &str) -> Option<&'static str> {
    let word = unit.trim().to_lowercase();
    let singular = word.strip_suffix('s').filter(|s| s.len() > 1);
    let of = |word: &str| WORDS.iter().find(|(long, _)| *long == word);
    let found = of(singular.unwrap_or(&word)).map(|(_, short)| *short);
    found.or_else(|| {
        let bare = BARE.iter().find(|bare| Some(**bare) == singular);
        bare.copied()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use AxisKind::{Rotation, Translation};

    #[test]
    fn a_unit_of_the_other_kind_of_axis_is_told_as_such() {
        let angle = Quantity::Displacement(Translation).factor("deg", false);
        assert!(angle.unwrap_err().contains("kind = \"rotation\""));
        let force = Quantity::Force(Rotation).factor("kN", false);
        assert!(force.unwrap_err().contains("kind = \"translation\""));
        let neither = Quantity::Force(Rotation).factor("bar", false);
        assert!(!neither.unwrap_err().contains("kind"));
    }

    #[test]
    fn units_agree_with_hand_conversion() {
        for (quantity, unit, si) in [
            (Quantity::Displacement(Translation), "in", 0.0254),
            (Quantity::Displacement(Translation), "µm", 1e-6),
            (Quantity::Displacement(Rotation), "°", 0.017_453_292_519_943),
            (Quantity::Velocity(Rotation), "rpm", 0.104_719_755_119_66),
            (Quantity::Velocity(Translation), "mps", 1.0),
            (Quantity::Acceleration(Translation), "mps2", 1.0),
            (Quantity::Acceleration(Translation), "g", 9.80665),
            (Quantity::Acceleration(Translation), "mm/s²", 1e-3),
            (
                Quantity::Acceleration(Rotation),
                "deg/s2",
                0.017_453_292_519_943,
            ),
            (Quantity::Force(Translation), "kip", 4_448.221_615_260_5),
            (Quantity::Force(Rotation), "N·m", 1.0),
            (Quantity::Force(Rotation), "N.m", 1.0),
            (Quantity::Force(Rotation), "lbf.in", 0.112_984_829_027_616_7),
            (Quantity::Force(Rotation), "lbf.ft", 1.355_817_948_331_400_4),
            (Quantity::Force(Rotation), "in-lbs", 0.112_984_829_027_616_7),
            (Quantity::Force(Rotation), "lb*ft", 1.355_817_948_331_400_4),
            (Quantity::Force(Rotation), "oz-in", 0.007_061_551_814_226),
            (Quantity::Force(Rotation), "Nmm", 1e-3),
            (Quantity::Force(Rotation), "N-m", 1.0),
            (Quantity::Force(Rotation), "mNm", 1e-3),
            (Quantity::Force(Translation), "daN", 10.0),
            (Quantity::Force(Translation), "MN", 1e6),
            (Quantity::Force(Translation), "KN", 1e3),
            (Quantity::Force(Translation), "kg", 9.80665),
            (Quantity::Force(Translation), "lbs", 4.448_221_615_260_5),
            (
                Quantity::Displacement(Rotation),
                "Grad",
                0.017_453_292_519_943,
            ),
            (Quantity::Velocity(Rotation), "U/min", 0.104_719_755_119_66),
            (Quantity::Velocity(Rotation), "min^-1", 0.104_719_755_119_66),
            (Quantity::Velocity(Translation), "in/sec", 0.0254),
            (Quantity::Velocity(Translation), "m s⁻¹", 1.0),
            (Quantity::Acceleration(Translation), "m/sec^2", 1.0),
            (Quantity::Acceleration(Translation), "m s-2", 1.0),
            (Quantity::Acceleration(Translation), "m/s/s", 1.0),
            (Quantity::Acceleration(Translation), "g's", 9.80665),
            (Quantity::Acceleration(Translation), "gn", 9.80665),
            (Quantity::Time, "ms", 1e-3),
            (Quantity::Time, "Milliseconds", 1e-3),
        ] {
            let found = quantity.factor(unit, false).unwrap();
            assert!((found / si - 1.0).abs() < 1e-12, "{unit}: {found} and {si}");
        }
    }

    #[test]
    fn a_wrong_unit_names_what_is_allowed() {
        let message = Quantity::Force(Translation).factor("mm", true).unwrap_err();
        assert!(
            message.contains("not one of force") && message.contains("kip"),
            "{message}"
        );
        let message = Quantity::Force(Rotation).factor("V", false).unwrap_err();
        assert!(
            message.contains("scale") && message.contains("N*m"),
            "{message}"
        );
        assert_eq!(Quantity::Force(Rotation).factor("V", true), Ok(1.0));
    }
}
