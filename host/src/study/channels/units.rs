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

/// Units without a size of their own: the channel's `scale` must say how many SI units one of them is.
const BARE: [&str; 8] = ["V", "mV", "A", "mA", "count", "counts", "1", "-"];

/// Units of channels that no study uses, met in rows of units.
const OTHER: [&str; 12] = [
    "W", "K", "C", "degC", "%", "Pa", "kPa", "MPa", "bar", "Hz", "kHz", "Ohm",
];

/// Units written out, in the singular and in small letters.
const WORDS: [(&str, &str); 22] = [
    ("second", "s"),
    ("sec", "s"),
    ("seconde", "s"),
    ("sekunde", "s"),
    ("msec", "ms"),
    ("usec", "us"),
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("inch", "in"),
    ("inche", "in"),
    ("degree", "deg"),
    ("radian", "rad"),
    ("newton", "N"),
    ("kilonewton", "kN"),
    ("pound", "lbf"),
    ("lb", "lbf"),
    ("rpm", "rpm"),
    ("1/min", "rpm"),
    ("volt", "V"),
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
    ("mrad", 1e-3),
    ("deg", PI / 180.0),
    ("arcmin", PI / 10_800.0),
    ("rev", 2.0 * PI),
];
const SPEED: &[(&str, f64)] = &[
    ("m/s", 1.0),
    ("mm/s", 1e-3),
    ("cm/s", 1e-2),
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
    ("in/s^2", INCH),
    ("ft/s^2", FOOT),
    ("g", GRAVITY),
    ("mg", 1e-3 * GRAVITY),
];
const ANGULAR_ACCELERATION: &[(&str, f64)] = &[
    ("rad/s^2", 1.0),
    ("deg/s^2", PI / 180.0),
    ("rev/s^2", 2.0 * PI),
];
const FORCE: &[(&str, f64)] = &[
    ("N", 1.0),
    ("mN", 1e-3),
    ("kN", 1e3),
    ("lbf", POUND_FORCE),
    ("kip", 1e3 * POUND_FORCE),
    ("kgf", GRAVITY),
    ("gf", 1e-3 * GRAVITY),
];
const TORQUE: &[(&str, f64)] = &[
    ("N*m", 1.0),
    ("Nm", 1.0),
    ("mN*m", 1e-3),
    ("kN*m", 1e3),
    ("lbf*in", POUND_FORCE * INCH),
    ("in*lbf", POUND_FORCE * INCH),
    ("lbf*ft", POUND_FORCE * FOOT),
    ("ft*lbf", POUND_FORCE * FOOT),
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
        let first = self.table().first().map_or("", |(unit, _)| unit);
        first.replace('*', "·").replace("^2", "²")
    }

    /// How many SI units one `unit` is, or the end of a sentence that says what is wrong with it.
    ///
    /// `scaled` tells whether the channel states a scale, without which a volt or a count means nothing.
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
        if let Some((_, factor)) = self.table().iter().find(|(name, _)| *name == plain) {
            return Ok(*factor);
        }
        let allowed: Vec<&str> = self.table().iter().map(|(name, _)| *name).collect();
        Err(format!(
            "unit {unit:?} is not one of {}; use {} with a scale",
            self.words(),
            allowed.join(", ") + ", or V, A or counts"
        ))
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

/// Whether a unit has no size of its own.
pub(crate) fn is_bare(unit: &str) -> bool {
    BARE.contains(&normalised(unit).as_str())
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
    let listed = tables
        .iter()
        .any(|t| t.iter().any(|(name, _)| *name == plain));
    listed || is_bare(text) || OTHER.contains(&plain.as_str())
}

/// One spelling for the many in use: N·m, N.m and N m; µm; m/s², m/s2 and m/s**2.
fn normalised(unit: &str) -> String {
    let word = unit.trim().to_lowercase();
    let word = word
        .strip_suffix('s')
        .filter(|s| s.len() > 1)
        .unwrap_or(&word);
    if let Some((_, short)) = WORDS.iter().find(|(long, _)| *long == word) {
        return (*short).to_owned();
    }
    let mut plain = unit
        .trim()
        .replace(['µ', 'μ'], "u")
        .replace("**2", "^2")
        .replace('²', "^2")
        .replace(['·', '.', ' ', '⋅'], "*")
        .replace('°', "deg");
    if plain.ends_with("/s2") {
        plain.insert(plain.len() - 1, '^');
    }
    match plain.strip_suffix("/s/s") {
        Some(start) => format!("{start}/s^2"),
        None => plain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use AxisKind::{Rotation, Translation};

    #[test]
    fn units_agree_with_hand_conversion() {
        for (quantity, unit, si) in [
            (Quantity::Displacement(Translation), "in", 0.0254),
            (Quantity::Displacement(Translation), "µm", 1e-6),
            (Quantity::Displacement(Rotation), "°", 0.017_453_292_519_943),
            (Quantity::Velocity(Rotation), "rpm", 0.104_719_755_119_66),
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
            (Quantity::Time, "ms", 1e-3),
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
