//! The answer in one sentence, and a model as an equation with values.

use super::asked::Asked;
use super::contents::{ModelWords, Term, Value};
use super::version::Version;
use crate::assess::where_it_fails::Extent;
use crate::diagnose::apply::WITHOUT;
use crate::diagnose::{Diagnosis, Found, PerAxis, Verdict};
use crate::fit::identify;
use crate::model::corrections::missing_inertia;
use crate::model::effects::is_correction;
use crate::model::file::{Base, ModelFile};
use crate::model::values::stops;
use crate::model::{ModelEffect, ParameterValue};
use crate::report::staircase::Step;
use crate::simulate::respond::Response;
use crate::text::table::rounded;
use jointwatch_shared::effect::Entry;
use jointwatch_shared::effect::about::About;

/// A change of an error is told from this part of it on.
const TOLD: f64 = 0.05;

/// What the page says first.
pub(super) fn answer(
    asked: &Asked<'_>,
    versions: &[Version<'_>],
    steps: &[Step],
    floors: &PerAxis,
) -> String {
    if let Some(answer) = &asked.answer {
        return answer.clone();
    }
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
        return String::new();
    };
    if let Some(response) = asked.response {
        return of_response(response);
    }
    if let (Some(diagnosis), None) = (asked.diagnosis, asked.before) {
        return of_diagnosis(diagnosis, first, last, floors);
    }
    if steps.len() > 1 && asked.steps.is_empty() {
        // Two models of which nobody says that one was made from the other.
        return format!("From before to after, {}.", fall(first, last, floors));
    }
    if steps.len() > 1 {
        let still = match asked.verdict_after {
            Some(Verdict::Unknown) => " Something is still missing that is not in the library.",
            _ => "",
        };
        return of_additions(&steps[1..], &fall(first, last, floors)) + still;
    }
    let axes: Vec<String> = last
        .errors
        .iter()
        .map(|(axis, error)| {
            format!(
                "{} of the RMS force on {axis}{}",
                percent(*error),
                floor(axis, floors)
            )
        })
        .collect();
    // Above its noise, not in percent: an error that is noise lies nowhere.
    let above =
        |(axis, error): &(&String, &f64)| *error / floors.get(*axis).copied().unwrap_or(1.0);
    let worst = last
        .errors
        .iter()
        .max_by(|a, b| above(a).total_cmp(&above(b)));
    let worst = worst.map_or("", |(axis, _)| axis.as_str());
    let mut text = format!(
        "On the {}, the {} model is off by {}",
        asked.judged_on,
        asked.model.base.name(),
        axes.join(" and ")
    );
    if let Some(version) = versions.last()
        && let Some(place) = version
            .comparison
            .places
            .iter()
            .filter(|p| p.axis == worst && p.kind != "frequency" && p.extent != Extent::Everywhere)
            .max_by(|a, b| {
                contrast(a.share_of_error, a.share_of_rows)
                    .total_cmp(&contrast(b.share_of_error, b.share_of_rows))
            })
    {
        text.push_str(&format!(
            "; {:.0} % of the error of {} lies in {:.0} % of the rows: {}",
            100.0 * place.share_of_error,
            place.axis,
            100.0 * place.share_of_rows,
            place.region
        ));
    }
    text + "."
}

/// What was added and left out again, and how the errors fell.
fn of_additions(steps: &[Step], fall: &str) -> String {
    let labels = steps.iter().map(|s| s.label.as_str());
    let (left_out, added): (Vec<&str>, Vec<&str>) = labels.partition(|l| l.starts_with(WITHOUT));
    let left_out = left_out.iter().filter_map(|l| l.strip_prefix(WITHOUT));
    let left_out: String = left_out
        .map(|name| format!(" and {name} left out again"))
        .collect();
    format!("With {} added{left_out}, {fall}.", added.join(", "))
}

/// How much denser the error is in a place than elsewhere.
fn contrast(error: f64, rows: f64) -> f64 {
    error / rows.max(1e-9)
}

/// `With the model in place of the joint the displacement of x differs by 3.1 % NMSE in valid.csv
/// …`.
fn of_response(response: &Response) -> String {
    let records = response.records.iter().flat_map(|record| {
        let moving = record.axes.iter().filter(|(_, figures)| !figures.at_rest);
        moving.map(|(axis, figures)| {
            let nmse = rounded(figures.displacement_nmse_percent);
            format!("{axis} in {} by {nmse} % NMSE", record.file)
        })
    });
    format!(
        "With the model in place of the joint, the simulated displacement is off by: {}.",
        records.collect::<Vec<_>>().join("; ")
    )
}

fn of_diagnosis(diagnosis: &Diagnosis, first: &Step, last: &Step, floors: &PerAxis) -> String {
    let found: Vec<String> = diagnosis.found.iter().map(Found::name).collect();
    let stands: Vec<String> = first
        .errors
        .iter()
        .map(|(axis, error)| format!("{} on {axis}{}", percent(*error), floor(axis, floors)))
        .collect();
    match diagnosis.verdict {
        Verdict::Effect => format!(
            "The model lacks {}: with {} added, {}.",
            found.join(" and "),
            if found.len() > 1 { "them" } else { "it" },
            fall(first, last, floors)
        ),
        Verdict::None => format!("Nothing is missing: the error is {} of the RMS force.", stands.join(" and ")),
        Verdict::Unknown if found.is_empty() => format!(
            "{} The error is {} of the RMS force.",
            diagnosis.unknown_in_words(),
            stands.join(" and ")
        ),
        Verdict::Unknown => format!(
            "{} With {} added, {}.",
            diagnosis.unknown_in_words(),
            found.join(" and "),
            fall(first, last, floors)
        ),
        Verdict::Data => {
            "The data are at fault: what is said below of effects means nothing before they are put right.".into()
        }
    }
}

/// `the error of x falls from 12 % to 2 % of the RMS force (noise floor 1.8 %)`, for every axis on
/// which it changes by a twentieth, the largest change first.
fn fall(first: &Step, last: &Step, floors: &PerAxis) -> String {
    let ratio = |axis: &String, before: f64| Some(last.errors.get(axis)? / before);
    let mut changes: Vec<(f64, String)> = Vec::new();
    for (axis, before) in &first.errors {
        let Some(ratio) = ratio(axis, *before).filter(|r| (r - 1.0).abs() > TOLD) else {
            continue;
        };
        let verb = if ratio < 1.0 { "falls" } else { "grows" };
        let text = format!(
            "the error of {axis} {verb} from {} to {} of the RMS force{}",
            percent(*before),
            percent(before * ratio),
            floor(axis, floors)
        );
        changes.push((ratio, text));
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let changes: Vec<String> = changes.into_iter().map(|(_, text)| text).collect();
    match changes.is_empty() {
        true => "no error changes by a twentieth".into(),
        false => changes.join(" and "),
    }
}

fn percent(ratio: f64) -> String {
    format!("{} %", rounded(100.0 * ratio))
}

fn floor(axis: &str, floors: &PerAxis) -> String {
    floors.get(axis).map_or(String::new(), |floor| {
        format!(" (noise floor {})", percent(*floor))
    })
}

/// The model of one axis as an equation.
pub(super) fn model(model: &ModelFile, axis: usize) -> ModelWords {
    let own = &model.axes[axis];
    let acts = |term: &&ModelEffect| term.axis.as_ref().is_none_or(|a| *a == own.name);
    let terms: Vec<&ModelEffect> = model.effects.iter().filter(acts).collect();
    let joint = terms.iter().filter(|t| !is_correction(&t.effect));
    let mut summands: Vec<String> = joint.map(|t| t.effect.replace('_', " ")).collect();
    let mut notes = Vec::new();
    let polynomial = identify::equations(model);
    match &model.base {
        Base::Polynomial(p) => {
            let count = p.coefficients[axis].iter().filter(|c| **c != 0.0).count();
            summands.insert(0, format!("polynomial of {count} terms"));
            let heading = format!("r_{} [", own.name);
            let equation = polynomial
                .iter()
                .find(|e| e.trim_start().starts_with(&heading));
            notes.extend(equation.map(|e| e.trim_matches('\n').to_string()));
        }
        Base::Network(n) => summands.insert(
            0,
            format!("network of {} tanh neurons", n.hidden_bias.len()),
        ),
        Base::None(_) => {}
    }
    if summands.is_empty() {
        summands.push("0".into());
    }
    let inertia = if own.inertia_identified {
        "identified from the records"
    } else if missing_inertia(&model.effects, &own.name) != 0.0 {
        "what the study states and its error together"
    } else {
        "as the study states"
    };
    notes.push(format!(
        "Inertia {} {}, {inertia}.",
        rounded(own.inertia),
        own.kind.inertia_unit()
    ));
    ModelWords {
        equation: format!("r_{} = {}", own.name, summands.join(" + ")),
        notes,
        terms: terms.into_iter().map(term).collect(),
    }
}

/// Values of an effect, with the symbols and meanings that it gives them.
pub(super) fn values(about: Option<&About>, parameters: &[ParameterValue]) -> Vec<Value> {
    let value = |(at, p): (usize, &ParameterValue)| {
        let known = about.and_then(|a| a.parameters.get(at));
        Value {
            symbol: known.map_or(p.name.as_str(), |k| k.symbol).into(),
            meaning: known.map_or(p.name.as_str(), |k| k.meaning).into(),
            value: p.value,
            unit: p.unit.clone(),
            interval: p.interval,
        }
    };
    let stops = about.map(|about| stops(about.name, parameters));
    let stop = |stop: ParameterValue| Value {
        meaning: stop.name.replace('_', " "),
        symbol: String::new(),
        value: stop.value,
        unit: stop.unit,
        interval: stop.interval,
    };
    let listed = parameters.iter().enumerate().map(value);
    listed
        .chain(stops.into_iter().flatten().map(stop))
        .collect()
}

fn term(term: &ModelEffect) -> Term {
    let about = Entry::named(term.effect.split('*').next().unwrap_or_default()).map(|e| e.about);
    Term {
        name: term.name(),
        title: about.map_or("", |a| a.title).into(),
        law: about.map_or("", |a| a.equation).into(),
        values: values(about.as_ref(), &term.parameters),
    }
}
