//! What a column is, by its name and unit, which may be written in brackets or behind the name.

use super::units::{Quantity, is_a_unit, is_bare, is_g};
use super::words::{CLOCKS, COMMANDS, CURRENTS, MEASURED, POSITIONS, by_name, tokens};
use crate::study::AxisKind::{Rotation, Translation};

/// What a name and a unit say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Named {
    /// The unit that stands in the name.
    pub(crate) unit: Option<String>,
    /// How surely this is the time; 0 for not at all.
    pub(crate) time: u8,
    /// Whether its name is that of a current that something really took.
    pub(crate) current: bool,
    /// Whether its name is that of a force that was commanded and not measured.
    pub(crate) commanded_force: bool,
    /// Whether its name is that of a position which may be a motor's.
    pub(crate) position: bool,
    /// What it may measure, with how surely.
    pub(crate) quantities: Vec<(Quantity, u8)>,
}

impl Named {
    /// How surely it measures a quantity; 0 for not at all.
    pub(crate) fn score(&self, quantity: Quantity) -> u8 {
        let found = self.quantities.iter().find(|(q, _)| *q == quantity);
        found.map_or(0, |(_, score)| *score)
    }
}

/// Every quantity but time.
pub(crate) const QUANTITIES: [Quantity; 8] = [
    Quantity::Displacement(Translation),
    Quantity::Velocity(Translation),
    Quantity::Acceleration(Translation),
    Quantity::Force(Translation),
    Quantity::Displacement(Rotation),
    Quantity::Velocity(Rotation),
    Quantity::Acceleration(Rotation),
    Quantity::Force(Rotation),
];

/// Reads a column's name, and its unit where the file states one.
pub(crate) fn read(name: &str, stated: Option<&str>) -> Named {
    let name = without_index(name).0;
    let (written, own) = match split_unit(name) {
        // What is in square brackets is a unit even where nobody here knows it.
        (whole, None) => bracketed(whole).unwrap_or((whole, None)),
        known => known,
    };
    let stem = written.to_lowercase();
    let tokens = tokens(written);
    let clock = CLOCKS
        .iter()
        .find(|(word, _)| tokens.iter().any(|t| t == word));
    let unit = stated.map(str::to_owned).or(own);
    let unit = unit.or(clock.map(|(_, unit)| (*unit).to_owned()));
    let among = |words: &[&str]| tokens.iter().any(|t| words.contains(&t.as_str()));
    let by_name = |quantity: Quantity| by_name(quantity, &stem, &tokens);
    // A name that is no word for anything may be a unit; an n or an in is more often something
    // else, so it says little beside other names.
    let is_word = |q: &Quantity| by_name(*q) > 0;
    let is_word = is_word(&Quantity::Time) || QUANTITIES.iter().any(is_word);
    let bare = (unit.is_none() && !is_word && is_a_unit(name) && !is_bare(name) && name != "in")
        .then_some(name);
    let unit = unit.or(bare.map(str::to_owned));
    let known = unit.as_deref().filter(|u| is_a_unit(u));
    let (commanded, measured) = (among(&COMMANDS), among(&MEASURED));
    let by_unit = |quantity: Quantity| known.map(|unit| quantity.factor(unit, false).is_ok());
    let score = |quantity: Quantity| match by_unit(quantity) {
        Some(true)
            if quantity == Quantity::Force(Translation)
                && known.is_some_and(is_g)
                && by_name(quantity) == 0 =>
        {
            0
        }
        Some(true) if bare.is_some() => 1,
        Some(true) => 4 + by_name(quantity),
        // A volt or a count says nothing; any other unit says that it is something else.
        Some(false) if !known.is_some_and(is_bare) => 0,
        _ => by_name(quantity),
    };
    // Much is written in milliseconds that does not count the time: the width of a pulse, a delay.
    let time = match by_name(Quantity::Time) {
        0 => score(Quantity::Time).min(1),
        name => match by_unit(Quantity::Time) {
            Some(false) => score(Quantity::Time),
            Some(true) => 5 + name,
            None => 1 + name,
        },
    };
    Named {
        time,
        // Behind another word an i is an index.
        current: (among(&CURRENTS) || tokens.first().is_some_and(|t| t == "i")) && !commanded,
        commanded_force: commanded
            && [Translation, Rotation]
                .into_iter()
                .any(|kind| score(Quantity::Force(kind)) > 0),
        position: among(&POSITIONS) && !commanded,
        quantities: QUANTITIES
            .into_iter()
            .map(|q| (q, score(q)))
            .filter(|(_, score)| *score > 0 && !commanded)
            .map(|(q, score)| (q, score + u8::from(measured)))
            .collect(),
        unit,
    }
}

/// What the name of a variant says: behind a name that another column has without it, an `m` or `s`
/// is no unit but says which one this is, as a model's or a motor's, and nothing is lost without
/// it.
pub(crate) fn variant(name: &str, names: &[String]) -> Option<Named> {
    let (stem, end) = name.rsplit_once(['_', ' '])?;
    let is_variant = ["m", "s"].contains(&end) && names.iter().any(|other| other == stem);
    let named = read(stem, None);
    (is_variant && named.time == 0).then_some(named)
}

/// The name before square brackets, and the word in them.
fn bracketed(name: &str) -> Option<(&str, Option<String>)> {
    let (stem, rest) = name.split_once('[')?;
    let unit = rest.split_once(']')?.0.trim();
    let is_word = unit.parse::<usize>().is_err() && !unit.is_empty();
    is_word.then(|| (stem.trim(), Some(unit.to_owned())))
}

/// Seconds per unit of time.
pub(crate) fn seconds(unit: &str) -> Option<f64> {
    Quantity::Time.factor(unit, false).ok()
}

/// The unit that stands in the name of a column of this quantity: whatever is in brackets, and
/// behind the name what fits the quantity, as `a_in` may be an input and no inch.
pub(crate) fn unit_for(quantity: Quantity, name: &str) -> Option<String> {
    let name = without_index(name).0;
    let unit = split_unit(name).1?;
    let is_word = unit.chars().any(|c| c.is_alphabetic() || c == '°');
    let in_brackets = name.contains(['[', '(', '{', '<']);
    let fits = in_brackets || quantity.factor(&unit, false).is_ok() && unit != "in";
    (is_word && fits && quantity != Quantity::Input).then_some(unit)
}

/// The name of a matrix and which of its columns this is, where it is one: `acc_g[3]`.
pub(crate) fn without_index(name: &str) -> (&str, Option<usize>) {
    let split = name.strip_suffix(']').and_then(|n| n.rsplit_once('['));
    let number = split.and_then(|(stem, index)| Some((stem, index.parse().ok()?)));
    number.map_or((name, None), |(stem, index)| (stem, Some(index)))
}

/// The name and the unit in it: `Weg [mm]`, `Weg (mm)`, `Weg/mm`, `Weg in mm`, `Weg: mm`, `x2_m`,
/// `a_m_s2`, `v_m_per_s`.
pub(crate) fn split_unit(name: &str) -> (&str, Option<String>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let Some((stem, rest)) = name.split_once(open)
            && let Some((unit, _)) = rest.split_once(close)
            && unit.parse::<usize>().is_err()
            && is_a_unit(unit)
        {
            return (stem.trim(), Some(unit.trim().to_owned()));
        }
    }
    for between in [" in ", " / ", ", ", ": ", ":"] {
        if let Some((stem, unit)) = name.split_once(between)
            && is_a_unit(unit)
            && !stem.trim().is_empty()
        {
            return (stem.trim(), Some(unit.trim().to_owned()));
        }
    }
    for (at, _) in name.match_indices(['_', ' ']).filter(|(at, _)| *at > 0) {
        let unit = name[at + 1..].replace("_per_", "/").replace('_', "/");
        // `chan_1` is the first of several, and `torque_in` goes in.
        let is_meant = || unit != "in" || measures(&name[..at], "in");
        if is_a_unit(&unit) && unit.parse::<usize>().is_err() && is_meant() {
            return (&name[..at], Some(unit));
        }
    }
    if let Some((stem, unit)) = name.split_once('/')
        && is_a_unit(unit)
        && !stem.trim().is_empty()
    {
        return (stem.trim(), Some(unit.trim().to_owned()));
    }
    inner_unit(name).unwrap_or((name.trim(), None))
}

/// A unit between other words, `load_kN_left`, where the words before it are for what it measures:
/// of `force_min_1` the minutes are none.
fn inner_unit(name: &str) -> Option<(&str, Option<String>)> {
    let starts = name.match_indices(['_', ' ']).map(|(at, _)| at);
    starts.filter(|at| *at > 0).find_map(|at| {
        let stem = name[..at].trim();
        let (unit, _) = name[at + 1..].split_once(['_', ' '])?;
        let is_meant = unit.len() > 1 && unit != "in" && measures(stem, unit);
        is_meant.then(|| (stem, Some(unit.to_owned())))
    })
}

/// Whether words are for a quantity that has a unit.
fn measures(words: &str, unit: &str) -> bool {
    let (small, tokens) = (words.to_lowercase(), tokens(words));
    let is_of = |q: &Quantity| by_name(*q, &small, &tokens) > 0 && q.factor(unit, false).is_ok();
    QUANTITIES.iter().any(is_of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_three_languages() {
        use Quantity::{Acceleration, Displacement, Force, Velocity};
        for (name, unit, quantity) in [
            ("Weg", Some("mm"), Displacement(Translation)),
            ("Beschleunigung", Some("g"), Acceleration(Translation)),
            ("Kraft [kN]", None, Force(Translation)),
            ("x2_m", None, Displacement(Translation)),
            ("a2_m_s2", None, Acceleration(Translation)),
            ("alpha2_rad_s2", None, Acceleration(Rotation)),
            ("torque_Nm", None, Force(Rotation)),
            ("torAct", None, Force(Rotation)),
            ("Drehwinkel (°)", None, Displacement(Rotation)),
            ("Rotary.Position", None, Displacement(Rotation)),
            ("angular velocity", None, Velocity(Rotation)),
            ("Déplacement", None, Displacement(Translation)),
            ("vitesse m/s", None, Velocity(Translation)),
            ("Force", None, Force(Translation)),
            ("F", None, Force(Translation)),
            ("N", None, Force(Translation)),
            ("acc_g[3]", None, Acceleration(Translation)),
            ("run/laser_um[12]", None, Displacement(Translation)),
            ("mm", None, Displacement(Translation)),
            ("s", None, Displacement(Translation)),
        ] {
            let found = read(name, unit);
            let best = found.quantities.iter().max_by_key(|(_, s)| *s);
            assert_eq!(best.map(|b| b.0), Some(quantity), "{name}: {found:?}");
            assert_eq!(found.time, 0, "{name}: {found:?}");
        }
        let time = |name| read(name, None).time;
        assert!(time("Time (s)") > time("ESC signal (ms)") && time("t") > time("ESC signal (ms)"));
        for (name, unit) in [
            ("Zeit", None),
            ("t_s", None),
            ("Time", Some("ms")),
            ("Temps (s)", None),
        ] {
            assert!(read(name, unit).time > 0, "{name}");
        }
    }

    #[test]
    fn a_command_is_no_measurement_and_a_number_no_unit() {
        for name in [
            "goal_rad",
            "cmd_mm",
            "Force setpoint (N)",
            "x_target_m",
            "x_ref_mm",
            "TargetPosition",
            "posSoll [mm]",
            "Force SP (N)",
            "CONTROL_TORQUE",
        ] {
            assert_eq!(read(name, None).quantities, [], "{name}");
        }
        let commanded = |name| read(name, None).commanded_force;
        assert!(commanded("tau_cmd_Nm") && commanded("CONTROL_TORQUE"));
        assert!(!commanded("torque_Nm") && !commanded("x_ref_mm"));
        assert_eq!(read("chan_1", None).unit, None);
        assert_eq!(read("Q_CURRENT", None).quantities, []);
        assert!(!read("current_position", None).quantities.is_empty());
        let score = |name| read(name, None).score(Quantity::Displacement(Translation));
        assert!(score("PosIst [mm]") > score("Pos [mm]"));
        let unknown = read("Kraft [Blub]", None);
        assert_eq!(unknown.unit.as_deref(), Some("Blub"));
        assert!(unknown.score(Quantity::Force(Translation)) > 0);
    }

    #[test]
    fn a_unit_in_a_name_counts_where_it_is_meant_as_one() {
        let length = Quantity::Displacement(Translation);
        for (name, unit) in [
            ("Weg (mm)", Some("mm")),
            ("stroke (V)", Some("V")),
            ("x_mm", Some("mm")),
            ("x_F[1]", None),
            ("x_in", None),
            ("x_N", None),
            ("x", None),
        ] {
            assert_eq!(unit_for(length, name), unit.map(str::to_owned), "{name}");
        }
        assert_eq!(unit_for(Quantity::Input, "coil (mA)"), None);
    }

    #[test]
    fn units_are_taken_out_of_names() {
        for (name, stem, unit) in [
            ("a2_m_s2", "a2", Some("m/s2")),
            ("phi_rad", "phi", Some("rad")),
            ("shear_rate_1/s", "shear_rate", Some("1/s")),
            ("v_mm_per_s", "v", Some("mm/s")),
            ("alpha_rad_per_s2", "alpha", Some("rad/s2")),
            ("omega [rad per s]", "omega", Some("rad per s")),
            ("Kraft in N", "Kraft", Some("N")),
            ("far side", "far side", None),
            ("Stroke:mm", "Stroke", Some("mm")),
            ("Stroke <mm>", "Stroke", Some("mm")),
            ("Load {KN}", "Load", Some("KN")),
            ("Load [left]", "Load [left]", None),
            ("load_kN_a", "load", Some("kN")),
            ("Weg mm links", "Weg", Some("mm")),
            ("force_min_1", "force_min_1", None),
            ("stroke_in_left", "stroke_in_left", None),
            ("F", "F", None),
        ] {
            assert_eq!(split_unit(name), (stem, unit.map(str::to_owned)), "{name}");
        }
    }

    #[test]
    fn an_m_behind_the_name_of_another_column_is_no_unit() {
        let names = ["t", "t_s", "omega", "omega_m", "x_m", "F", "F_N"].map(str::to_owned);
        let variants = names.iter().filter(|name| variant(name, &names).is_some());
        assert_eq!(variants.collect::<Vec<_>>(), ["omega_m"]);
        let named = variant("omega_m", &names).unwrap();
        assert_eq!(named, read("omega", None));
    }
}
