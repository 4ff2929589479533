//! The words that column names are made of, in English, German, French and other languages, and how
//! surely they are those of a quantity.

use super::units::Quantity;
use crate::study::AxisKind::{Rotation, Translation};

/// Parts of words for a displacement along a line.
const STROKES: [&str; 17] = [
    "displ",
    "posit",
    "auslenk",
    "verschieb",
    "extension",
    "elongation",
    "deflection",
    "spostam",
    "desplaz",
    "stroke",
    "travel",
    "course",
    "einfeder",
    "deplac",
    "déplac",
    "encoder",
    "weggeber",
];

/// Whole words, and words that are long enough to be told inside another.
fn words(quantity: Quantity) -> (&'static [&'static str], &'static [&'static str]) {
    match quantity {
        Quantity::Input => (&[], &[]),
        Quantity::Time => (
            &[
                "t", "ts", "tout", "time", "stamp", "millis", "micros", "zeit", "temps", "tiempo",
                "tempo", "uhrzeit", "x_value", "sec", "seconds", "sekunden",
            ],
            &["time", "zeit", "temps", "uhrzeit", "elapsed", "seconds"],
        ),
        Quantity::Displacement(Translation) => (
            &[
                "x", "y", "z", "d", "s", "q", "qm", "disp", "dist", "drift", "pos", "weg", "hub",
                "lvdt", "u", "enc",
            ],
            &STROKES,
        ),
        Quantity::Velocity(Translation) => (
            &[
                "v", "vel", "xdot", "dx", "vx", "vy", "vz", "qd", "qdot", "dq",
            ],
            &["velocity", "speed", "geschwind", "vitesse"],
        ),
        Quantity::Acceleration(Translation) => (
            &["a", "acc", "accel", "xddot", "ax", "ay", "az", "adxl", "b"],
            &["accel", "accél", "beschl"],
        ),
        Quantity::Force(Translation) => (
            &[
                "f", "force", "forc", "kraft", "load", "last", "fx", "fy", "fz", "effort",
                "thrust", "forza", "fuerza",
            ],
            &["force", "kraft", "loadcell", "effort"],
        ),
        Quantity::Displacement(Rotation) => (
            &["phi", "theta", "angle", "winkel"],
            &["angle", "winkel", "rotation", "theta"],
        ),
        Quantity::Velocity(Rotation) => (
            &["omega", "phidot", "thetadot"],
            &["angvel", "angular_vel", "winkelgeschw", "drehzahl", "omega"],
        ),
        Quantity::Acceleration(Rotation) => (
            &["alpha", "phiddot"],
            &["angacc", "angular_acc", "winkelbeschl", "alpha"],
        ),
        Quantity::Force(Rotation) => (
            &[
                "m",
                "mx",
                "my",
                "mz",
                "torque",
                "trq",
                "tor",
                "tau",
                "moment",
                "drehmoment",
                "couple",
            ],
            &["torque", "drehmom", "moment"],
        ),
    }
}

/// Words that say that a column is what something was told to do, and not what it did.
pub(super) const COMMANDS: [&str; 25] = [
    "cmd",
    "command",
    "commanded",
    "commande",
    "consigne",
    "control",
    "ctrl",
    "demand",
    "des",
    "desired",
    "goal",
    "nominal",
    "ref",
    "reference",
    "referenz",
    "set",
    "setpoint",
    "setpt",
    "soll",
    "sollkraft",
    "sollweg",
    "sollwert",
    "sp",
    "target",
    "vorgabe",
];

/// Words for the position of a motor, which is an angle more often than a length.
pub(super) const POSITIONS: [&str; 6] = ["q", "qm", "pos", "position", "enc", "encoder"];

/// Words for the current of a motor.
pub(super) const CURRENTS: [&str; 7] = [
    "current",
    "iq",
    "motorstrom",
    "strom",
    "courant",
    "corrente",
    "corriente",
];

/// Words that say that a column is what was measured.
pub(super) const MEASURED: [&str; 9] = [
    "act", "actual", "fbk", "feedback", "ist", "istwert", "meas", "measured", "mess",
];

/// Names that are units of time themselves.
pub(super) const CLOCKS: [(&str, &str); 2] = [("millis", "ms"), ("micros", "us")];

/// Parts of words that say that what is measured turns: a `Rotary.Position` is no length.
const TURNING: [&str; 5] = ["angle", "angular", "rotary", "rotation", "winkel"];

/// How surely a name in small letters, with its words, is one for a quantity; 0 for not at all.
pub(super) fn by_name(quantity: Quantity, name: &str, tokens: &[String]) -> u8 {
    use Quantity::{Acceleration, Displacement, Velocity};
    let own = worded(quantity, name, tokens);
    if !TURNING.iter().any(|part| name.contains(part)) {
        return own;
    }
    let along_a_line = match quantity {
        Displacement(Rotation) => Displacement(Translation),
        Velocity(Rotation) => Velocity(Translation),
        Acceleration(Rotation) => Acceleration(Translation),
        Displacement(Translation) | Velocity(Translation) | Acceleration(Translation) => return 0,
        _ => return own,
    };
    own.max(worded(along_a_line, name, tokens))
}

/// The same of the words alone.
fn worded(quantity: Quantity, name: &str, tokens: &[String]) -> u8 {
    let (whole, parts) = words(quantity);
    let is_whole = |t: &str| whole.contains(&t);
    let is_long = |t: &str| t.len() > 1 && is_whole(t);
    let is_current = || tokens.iter().any(|t| CURRENTS.contains(&t.as_str()));
    if tokens.iter().any(|t| is_long(t)) || is_long(name) {
        3
    } else if parts.iter().any(|p| name.contains(p)) {
        2
    } else if tokens.iter().any(|t| is_whole(t)) && !is_current() {
        // A motor's current along q is no position q.
        1
    } else {
        0
    }
}

/// The words of a name in small letters: “x2” is an x, “a_1” an a, “TargetPosition” a target and a
/// position.
pub(super) fn tokens(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut spaced = String::new();
    for (at, letter) in letters.iter().enumerate() {
        let before = at.checked_sub(1).map(|at| letters[at]);
        let after = letters.get(at + 1);
        if letter.is_uppercase()
            && before.is_some_and(char::is_lowercase)
            && after.is_some_and(|c| c.is_lowercase())
        {
            spaced.push(' ');
        }
        spaced.push(*letter);
    }
    spaced
        .to_lowercase()
        .split(|c: char| !c.is_alphanumeric())
        .map(|t| t.trim_matches(|c: char| c.is_ascii_digit()))
        .filter(|t| !t.is_empty())
        .map(str::to_owned)
        .collect()
}
