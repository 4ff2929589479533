//! A draft as a study.toml that explains itself.

use super::parts::{Draft, DraftAxis, DraftChannel};
use crate::study::channels::spare::word_of;
use crate::study::channels::units::{is_bare, unit_of_time};
use crate::study::{AxisKind, Convention, Role};
use crate::text::table::short;
use std::fmt::Write as _;
use std::path::Path;

/// The mark of what nobody said.
const GUESSED: &str = "# guessed";

/// The text of study.toml: every key with its meaning, every guess marked.
pub fn text(draft: &Draft) -> String {
    let mut text = String::from(
        "# Written by `jointwatch init`. Lines that end in \"# guessed\" were taken from the numbers or from a short name: check them.\n\
         # SI = (number · scale + offset) · unit for every channel written { column = …, unit = …, scale = …, offset = … }.\n\n",
    );
    let _ = writeln!(text, "name = {}\n", quoted(&draft.name));
    match &draft.time {
        Some(time) => {
            let _ = writeln!(
                text,
                "# The column that counts the time; rates and gaps are checked with it."
            );
            let column = quoted(&time.column);
            let unit = match unit_of_time(time.seconds_per_unit) {
                Some("s") => String::new(),
                Some(unit) => format!(", unit = {}", quoted(unit)),
                None => format!(", scale = {:?}", time.seconds_per_unit),
            };
            let rate = draft
                .resample_hz
                .map_or(String::new(), |rate| format!(", resample_hz = {rate}"));
            let value = match unit + &rate {
                rest if rest.is_empty() => column,
                rest => format!("{{ column = {column}{rest} }}"),
            };
            let guessed = time.guessed || draft.resample_hz.is_some();
            line(&mut text, "time", &value, guessed);
        }
        None => match draft.sample_rate_hz {
            Some(rate) => {
                text.push_str("# Samples per second; no column counts the time.\n");
                let rate = format!("{rate:?}");
                line(&mut text, "sample_rate_hz", &rate, draft.guesses_rate);
            }
            None => text.push_str(
                "# Quasi-static: the rows follow each other, and no time is known. Only effects that do not depend on rate are found.\n\
                 time = \"none\"\n",
            ),
        },
    }
    text.push_str(
        "# Force and features are low-passed alike to this before fits and error figures; chosen from the data when left out.\n\
         # band_hz = 120.0\n\
         # Rows in which nothing moves count for nothing: for a joint that sticks, where its force follows no motion.\n\
         # leave_out_standstill = true\n",
    );
    for axis in &draft.axes {
        axis_text(&mut text, axis);
    }
    input_text(&mut text, &draft.unused);
    records_text(&mut text, draft);
    let terms: Vec<String> = draft
        .axes
        .iter()
        .flat_map(|axis| {
            axis.base
                .iter()
                .map(|t| quoted(&format!("{t}@{}", axis.name)))
        })
        .collect();
    let _ = write!(
        text,
        "\n# The physics you believe in, effect@axis; `jointwatch effects` lists all. `diagnose` says what is missing.\n\
         [base]\nterms = [{}]   {GUESSED}\n",
        terms.join(", ")
    );
    text
}

/// What else was logged, as an input that is not there yet.
fn input_text(text: &mut String, unused: &[(String, Option<String>)]) {
    let mut words = unused
        .iter()
        .filter_map(|entry| Some((word_of(&entry.0)?, entry)));
    let Some((word, (column, unit))) = words.next() else {
        return;
    };
    let others: Vec<String> = words.map(|(_, other)| quoted(&other.0)).collect();
    let others = match others.is_empty() {
        true => String::new(),
        false => format!("   # or {}", others.join(", ")),
    };
    let unit = unit
        .as_ref()
        .map(|unit| format!("\n# unit = {}", quoted(unit)));
    let _ = writeln!(
        text,
        "\n# A column that the joint may follow, as it may a voltage, a temperature or a pressure; any number of them.\n# [[input]]\n\
         # name = {}\n# column = {}{others}{}",
        quoted(&word),
        quoted(column),
        unit.unwrap_or_default()
    );
}

fn records_text(text: &mut String, draft: &Draft) {
    for record in &draft.records {
        let _ = write!(
            text,
            "\n[[record]]\nfile = {}{}\nrole = {}   {}\n",
            quoted(&record.file),
            match Path::new(&record.file).is_absolute() {
                true => "",
                false => "   # relative to this file",
            },
            match record.role {
                Role::Train => "\"train\"",
                Role::Validate => "\"validate\"",
            },
            match record.role {
                Role::Train => "# learnt from",
                Role::Validate => "# kept aside: errors on it say how good the model is  # guessed",
            }
        );
        if let Some([from, to]) = record.rows {
            let _ = writeln!(
                text,
                "rows = [{from}, {to}]   # first row, and the row after the last  {GUESSED}"
            );
        }
        if let Some(columns) = &record.columns {
            let why = match columns.iter().any(String::is_empty) {
                true => "those of this run; the file holds several side by side",
                false => "the file has no heading",
            };
            let columns: Vec<String> = columns.iter().map(|c| quoted(c)).collect();
            let _ = writeln!(text, "columns = [{}]   # {why}", columns.join(", "));
        }
    }
}

fn axis_text(text: &mut String, axis: &DraftAxis) {
    let (unit, kind) = match axis.kind {
        AxisKind::Translation => ("m", "translation"),
        AxisKind::Rotation => ("rad", "rotation"),
    };
    let mut channels = axis
        .displacement
        .iter()
        .chain(&axis.velocity)
        .chain(&axis.force);
    let states_units = channels.any(|channel| channel.unit.is_some());
    let _ = write!(
        text,
        "\n[[axis]]\nname = {}   # stands behind the @ of an effect\nkind = \"{kind}\"   # or \"{}\"{}\n",
        quoted(&axis.name),
        match axis.kind {
            AxisKind::Translation => "rotation",
            AxisKind::Rotation => "translation",
        },
        if states_units {
            String::new()
        } else {
            format!("  {GUESSED}")
        }
    );
    displacement_text(text, axis, unit);
    optional(
        text,
        "velocity",
        "Relative velocity, as displacement; derived from it when left out.",
        axis.velocity.as_ref(),
    );
    optional(
        text,
        "body_position",
        "Absolute position of the body that carries the inertia; the displacement when left out.",
        axis.body_position.as_ref(),
    );
    optional(
        text,
        "acceleration",
        "That body's absolute acceleration; derived from its position when left out.",
        axis.acceleration.as_ref(),
    );
    let _ = writeln!(text, "# The applied force on that body; a list is summed.");
    match &axis.force {
        Some(force) => line(text, "force", &written(force), force.guessed),
        None => line(text, "force", "0", false),
    }
    inertia_text(text, axis);
}

/// The displacement, and how it is made of accelerations.
fn displacement_text(text: &mut String, axis: &DraftAxis, unit: &str) {
    let list: Vec<String> = axis.displacement.iter().map(written).collect();
    match list.as_slice() {
        [] => {
            let _ = writeln!(
                text,
                "# Relative displacement, {unit}; the integral of the velocity where none was logged.\n# displacement = …"
            );
        }
        [one] => {
            let _ = writeln!(
                text,
                "# Displacement of one side of the joint relative to the other, {unit}; of two columns the second is subtracted."
            );
            line(text, "displacement", one, axis.displacement[0].guessed);
        }
        list => {
            let _ = writeln!(
                text,
                "# Relative displacement, {unit}: the first column minus the second, the body's."
            );
            line(
                text,
                "displacement",
                &format!("[{}]", list.join(", ")),
                true,
            );
        }
    }
    if let Some(hz) = axis.integrate_above_hz {
        let _ = writeln!(
            text,
            "# These are accelerations, integrated twice above this frequency, below which nothing is known of the motion.\n\
             integrate_above_hz = {hz:?}   {GUESSED}"
        );
    }
}

/// Inertia, sign, encoder and ground.
fn inertia_text(text: &mut String, axis: &DraftAxis) {
    let unit = axis.kind.displacement_unit();
    let inertia_unit = axis.kind.inertia_unit();
    let _ = writeln!(
        text,
        "# Inertia of the body, {inertia_unit}. Left out, it is identified; 0 when the force already is the joint's own."
    );
    let _ = match (axis.inertia, axis.inertia_seen) {
        (Some(0.0), _) => writeln!(text, "inertia = 0.0   {GUESSED}"),
        (Some(1.0), _) if axis.force.is_none() => {
            writeln!(
                text,
                "inertia = 1.0   # every force is one per {inertia_unit}"
            )
        }
        (Some(inertia), _) => writeln!(text, "inertia = {inertia:?}"),
        (None, Some(seen)) => writeln!(
            text,
            "# inertia = {}   # about this, by these logs; weigh it if you can",
            short(seen)
        ),
        (None, None) => writeln!(text, "# inertia = 1.0"),
    };
    let (chosen, meaning, other) = match axis.restoring_force {
        Convention::ForceMinusInertia => (
            "force_minus_inertia",
            "the joint opposes a positive displacement: m·a = F − r",
            "inertia_minus_force",
        ),
        Convention::InertiaMinusForce => (
            "inertia_minus_force",
            "the joint pulls the body towards a positive displacement: m·a = F + r",
            "force_minus_inertia",
        ),
    };
    let _ = writeln!(
        text,
        "# Sign of the joint's force: {meaning}; or \"{other}\"."
    );
    let _ = writeln!(text, "restoring_force = \"{chosen}\"   {GUESSED}");
    let _ = writeln!(
        text,
        "# One count of the encoder, {unit}, where there is one: its rounding is then allowed for."
    );
    let _ = writeln!(text, "# encoder_step = 1e-6");
    let _ = writeln!(
        text,
        "# A known spring and damper from the body to ground, subtracted from the force."
    );
    let _ = writeln!(text, "# ground_stiffness = 0.0\n# ground_damping = 0.0");
}

fn optional(text: &mut String, key: &str, meaning: &str, channel: Option<&DraftChannel>) {
    let _ = writeln!(text, "# {meaning}");
    match channel {
        Some(channel) => line(text, key, &written(channel), channel.guessed),
        None => {
            let _ = writeln!(text, "# {key} = …");
        }
    }
}

fn line(text: &mut String, key: &str, value: &str, guessed: bool) {
    let mark = if guessed {
        format!("   {GUESSED}")
    } else {
        String::new()
    };
    let _ = writeln!(text, "{key} = {value}{mark}");
}

/// A channel as study.toml has it.
fn written(channel: &DraftChannel) -> String {
    let column = quoted(&channel.column);
    let mut parts = vec![format!("column = {column}")];
    if let Some(unit) = &channel.unit {
        parts.push(format!("unit = {}", quoted(unit)));
    }
    // What has no size of its own cannot be read without one.
    if channel.scale != 1.0 || channel.unit.as_deref().is_some_and(is_bare) {
        parts.push(format!("scale = {:?}", channel.scale));
    }
    if let Some(bit) = channel.sign_bit {
        parts.push(format!("sign_bit = {bit}"));
    }
    match parts.len() {
        1 => column,
        _ => format!("{{ {} }}", parts.join(", ")),
    }
}

/// A text as a TOML string, with its quotes.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
