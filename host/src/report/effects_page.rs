//! What people read about the effects: the list, the page of one with the loop that it draws, the
//! page of all of them.

use crate::text::table::Table;
use crate::text::text_plot::TextPlot;
use jointwatch_shared::base::axis::AxisKind::{Rotation, Translation};
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::effect::{
    Acts, EFFECTS, Entry, Instrument, Kinematics, MAX_PARAMETERS, States, Subsystem,
};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Samples of one cycle of the motion that a loop is drawn for.
const SAMPLES: usize = 400;
/// Cycles of it: the first ones let a memory settle.
const CYCLES: usize = 4;

const PLOT: TextPlot<'_> = TextPlot {
    width: 56,
    height: 12,
    x: "displacement",
    y: "force",
};

fn acts_on(entry: &Entry) -> &'static str {
    match entry.acts {
        Acts::BothAxes => "both axes",
        Acts::OwnAxis if entry.needs_two_axes() => "one axis of two",
        Acts::OwnAxis => "one axis",
    }
}

fn subsystem(entry: &Entry) -> &'static str {
    match entry.subsystem {
        Subsystem::Plant => "joint",
        Subsystem::TimeVaryingPlant => "joint, over time",
        Subsystem::Sensor => "instrument",
    }
}

/// What becomes of it on the device.
fn on_the_device(entry: &Entry) -> &'static str {
    match entry.subsystem {
        Subsystem::Plant => "part of the joint's model: it runs on the device too",
        Subsystem::TimeVaryingPlant => {
            "part of the joint's model on the host; refused at export, because a device that never stops does not know when a \
             record began"
        }
        Subsystem::Sensor if entry.is_zero_per_record() => {
            "a correction, found and taken out in every record anew; refused at export, because a device that never stops has no records"
        }
        Subsystem::Sensor if entry.is_line() => {
            "a correction, found and taken out in every record anew, and by a device sample by sample"
        }
        Subsystem::Sensor => "a correction of the data, on host and device",
    }
}

/// The unit on a translation beside a rotation, and on a rotation beside a translation.
fn units(parameter: &Parameter) -> [String; 2] {
    let unit = |own, other| parameter.dimension.unit(own, other).to_string();
    [unit(Translation, Rotation), unit(Rotation, Translation)]
}

fn unit_in_words(parameter: &Parameter) -> String {
    match units(parameter) {
        [a, b] if a == b && a == "–" => "no unit".into(),
        [a, b] if a == b => a,
        [a, b] => format!("{a}, {b}"),
    }
}

fn found_by(parameter: &Parameter) -> &'static str {
    match parameter.role {
        Role::Linear { positive: true } => "least squares; positive",
        Role::Linear { positive: false } => "least squares",
        Role::SizePerRecord { with_phase: true } => "least squares in every record, with a phase",
        Role::SizePerRecord { with_phase: false } => "least squares in every record",
        Role::Shape(shape) if shape.is_given() => "given, not found",
        Role::Shape(_) => "search",
    }
}

/// All effects in a table.
pub fn list() -> String {
    let mut table = Table::new(&[
        "effect",
        "what it is",
        "acts on",
        "belongs to",
        "parameters",
    ]);
    for entry in EFFECTS {
        let parameters = entry.parameters().iter();
        let parameters: Vec<String> = parameters
            .map(|p| format!("{} [{}]", p.name, unit_in_words(p)))
            .collect();
        table.row(vec![
            entry.about.name.into(),
            entry.about.title.into(),
            acts_on(entry).into(),
            subsystem(entry).into(),
            parameters.join(", "),
        ]);
    }
    format!(
        "{table}\n\n`jointwatch effects NAME` explains one: its equation, its source, what its absence looks like, its loop."
    )
}

fn parameters(entry: &Entry) -> Table {
    let mut table = Table::new(&["parameter", "symbol", "unit", "found by", "meaning"]);
    for p in entry.parameters() {
        table.row(vec![
            p.name.into(),
            p.symbol.into(),
            unit_in_words(p),
            found_by(p).into(),
            p.meaning.into(),
        ]);
    }
    table
}

/// One effect for a terminal.
pub fn in_words(entry: &Entry) -> String {
    let about = &entry.about;
    format!(
        "{}: {}\n\n  {}\n\nSource: {}.\nActs on: {}. It is {}.\n\n{}\n\nWhere it is missing: {}.\nTold apart: {}\n\n{}\n{}",
        about.name,
        about.title,
        about.equation,
        about.source,
        acts_on(entry),
        on_the_device(entry),
        parameters(entry),
        about.residual_signature,
        about.separated_by,
        PLOT.draw(&curve(entry)),
        caption(entry)
    )
}

fn caption(entry: &Entry) -> String {
    let examples = entry.parameters().iter().enumerate();
    let examples: Vec<_> = examples
        .map(|(place, p)| (p.symbol, example(entry, place), p.is_linear()))
        .collect();
    let (ones, others): (Vec<_>, Vec<_>) = examples
        .into_iter()
        .partition(|(_, value, linear)| *linear && *value == 1.0);
    let ones: Vec<&str> = ones.into_iter().map(|(symbol, ..)| symbol).collect();
    let others = others.into_iter();
    let others: Vec<String> = others
        .map(|(symbol, value, _)| format!("{symbol} = {value}"))
        .collect();
    let moving = match entry.subsystem {
        Subsystem::TimeVaryingPlant => format!("{CYCLES} cycles of a sine"),
        _ => "one cycle of a sine".into(),
    };
    let other = if entry.needs_two_axes() {
        ", the other axis a quarter of a cycle ahead"
    } else if entry.subsystem == Subsystem::Sensor {
        ", the applied force a tenth of a cycle ahead"
    } else {
        ""
    };
    let all = [
        vec![format!("{} = 1", ones.join(" = "))],
        others,
        vec![format!("over {moving}{other}")],
    ];
    all.concat().join(", ")
}

/// What a parameter that is never less than another one exceeds it by in a loop, as a factor: else
/// nothing would be seen of it.
const EXCEEDS: f64 = 1.5;

/// The value that a loop is drawn with, relative to a displacement and a velocity of 1.
fn example(entry: &Entry, place: usize) -> f64 {
    match entry.parameters()[place].role {
        _ if entry.never_less.iter().any(|(more, _)| *more == place) => EXCEEDS,
        Role::Linear { .. } | Role::SizePerRecord { .. } => 1.0,
        Role::Shape(shape) => shape
            .starts
            .get(shape.starts.len() / 2)
            .copied()
            .unwrap_or(1.0),
    }
}

/// Force over displacement along a sine of amplitude 1 and velocity 1.
fn curve(entry: &Entry) -> Vec<(f64, f64)> {
    let mut taken = [0.0; MAX_PARAMETERS];
    let parameters = entry.parameters().iter().enumerate();
    for (place, (index, parameter)) in taken.iter_mut().zip(parameters) {
        *place = parameter.as_law_takes_it(example(entry, index));
    }
    let mut states: States<f64> = [0.0; _];
    let period = TAU / SAMPLES as f64;
    let all = (0..=CYCLES * SAMPLES).map(|n| {
        let t = n as f64 * period;
        // The applied force leads the motion by a tenth of a cycle.
        let lead = t + 0.6;
        let at = Kinematics {
            displacement: t.sin(),
            velocity: t.cos(),
            step: if n == 0 {
                0.0
            } else {
                t.sin() - (t - period).sin()
            },
            other_displacement: t.cos(),
            other_velocity: -t.sin(),
            period,
            instrument: Instrument {
                time: t,
                acceleration: -t.sin(),
                force: lead.sin(),
                force_rate: lead.cos(),
                other_force: t.cos(),
                phase: 0.0,
            },
        };
        let [force, _] = (entry.real)(&taken, &at, &mut states);
        (at.displacement, force)
    });
    let skipped = match entry.subsystem {
        Subsystem::TimeVaryingPlant => 0,
        _ => (CYCLES - 1) * SAMPLES,
    };
    all.skip(skipped).collect()
}

/// All effects as the page docs/reference/effects.md.
pub fn markdown() -> String {
    let mut text = String::from(
        "# The effects\n\nWhat a model can hold and a diagnosis looks for, generated from \
         `shared/src/effect/`:\n\n```\njointwatch effects --markdown > docs/reference/effects.md\n```\n\nx is the displacement \
         of the axis that the effect is bound to (`effect@axis`), and ẋ its velocity. φ and φ̇ are those of the other axis. F \
         is the applied force and a the acceleration of the body; s = 1 for r = F − m·a and −1 for r = m·a − F. Loops are drawn \
         in units of the motion: displacement and velocity reach 1. What belongs to the joint runs on the device too. Starred \
         parameters are searched, others solved for. Units are of translations; for rotations put N·m for N, rad for m. Each \
         ends with its source, what its absence leaves in a residual, and what tells it apart. Blank cells: one axis, \
         joint.\n\n| effect | what it is | acts on | belongs to | number in a blob |\n|---|---|---|---|---|\n",
    );
    for entry in EFFECTS {
        let about = &entry.about;
        let _ = writeln!(
            text,
            "| [{0}](#{0}) | {1} | {2} | {3} | {4} |",
            about.name,
            about.title,
            if entry.acts == Acts::OwnAxis && !entry.needs_two_axes() {
                ""
            } else {
                acts_on(entry)
            },
            if entry.subsystem == Subsystem::Plant {
                ""
            } else {
                subsystem(entry)
            },
            entry.tag
        );
    }
    // What the parameters of several effects have in common is said once.
    let mut said = BTreeMap::new();
    for entry in EFFECTS {
        let about = &entry.about;
        let _ = write!(text, "\n## {}\n\n`{}`\n\n", about.name, about.equation);
        let first_at = |p: &Parameter| *said.entry((p.name, p.meaning)).or_insert(about.name);
        let firsts: Vec<&str> = entry.parameters().iter().map(first_at).collect();
        let listed: Vec<_> = entry.parameters().iter().zip(firsts).collect();
        for alike in listed.chunk_by(|(_, a), (_, b)| a == b && *a != about.name) {
            let (p, first) = alike[0];
            if first == about.name {
                let _ = writeln!(text, "{}", described(p));
                continue;
            }
            let names = alike
                .iter()
                .map(|(p, _)| format!("`{}` {}", p.name, p.symbol));
            let names: Vec<String> = names.collect();
            let _ = writeln!(text, "- {}: as in {first}", names.join(", "));
        }
        // Of a part of the joint the table above says it all.
        let fate = match entry.subsystem {
            Subsystem::Plant => String::new(),
            _ => format!("- It is {}.\n", on_the_device(entry)),
        };
        let _ = write!(
            text,
            "{fate}- {}.\n- {}.\n- {}\n\n```\n{}\n{}\n```\n",
            about.source,
            about.residual_signature,
            about.separated_by,
            PLOT.draw(&curve(entry)),
            caption(entry)
        );
    }
    text.trim_end().into()
}

/// A parameter with what it means, as an item of a list.
fn described(p: &Parameter) -> String {
    let searched = match p.role {
        Role::Shape(shape) if !shape.is_given() => "*",
        _ => "",
    };
    let unit = match units(p) {
        [unit, _] if unit == "–" => String::new(),
        [unit, _] => format!(" ({unit})"),
    };
    format!("- `{}`{searched} {}{unit}: {}", p.name, p.symbol, p.meaning)
}

/// One effect as `--json` gives it.
pub fn as_json(entry: &Entry) -> serde_json::Value {
    let about = &entry.about;
    let parameters = entry.parameters().iter().map(|p| {
        let [translation, rotation] = units(p);
        serde_json::json!({
            "name": p.name,
            "symbol": p.symbol,
            "meaning": p.meaning,
            "unit": { "translation": translation, "rotation": rotation },
            "linear": p.is_linear(),
        })
    });
    serde_json::json!({
        "name": about.name,
        "title": about.title,
        "acts_on": acts_on(entry),
        "belongs_to": subsystem(entry),
        "equation": about.equation,
        "source": about.source,
        "absence": about.residual_signature,
        "separated_by": about.separated_by,
        "parameters": parameters.collect::<Vec<_>>(),
    })
}
