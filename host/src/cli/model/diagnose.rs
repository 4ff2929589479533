//! `jointwatch diagnose`: which physical effect a model lacks; with `--apply`, the model with
//! everything that was missing.

use super::staircase;
use crate::cli::console::Console;
use crate::cli::plots::Plots;
use crate::cli::report::Report;
use crate::diagnose::apply::{self, Applied};
use crate::diagnose::changed::{self, ParameterChange};
use crate::diagnose::{self, Columns, Diagnosis, Found, Ranked, SearchOptions, Verdict};
use crate::model::file::ModelFile;
use crate::model::values::stops;
use crate::model::{corrections, effects};
use crate::report::page::Asked;
use crate::report::steps;
use crate::text::error::{Error, Result};
use crate::text::table::{Table, first_few, quantity};
use clap::Args;
use jointwatch_shared::effect::Entry;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Options of `jointwatch diagnose`.
#[derive(Args)]
pub(crate) struct Diagnose {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` or `add` wrote.
    model: PathBuf,
    /// Add what is missing, diagnose again, and so on until nothing is missing; shows the
    /// staircase of errors.
    #[arg(long)]
    apply: bool,
    /// Where --apply writes the model; the model's own name with -added when left out.
    #[arg(short, long, value_name = "FILE", requires = "apply")]
    output: Option<PathBuf>,
    /// An effect that is not to be thought of; may be given several times.
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// List every set of effects that was looked at, how well it predicts, and why it was not
    /// chosen.
    #[arg(long)]
    explain: bool,
    #[command(flatten)]
    plots: Plots,
    #[command(flatten)]
    report: Report,
}

impl Diagnose {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the records");
        let model = ModelFile::read(&self.model)?;
        let study = model.read_study(&self.study, &[])?;
        working.set_message("columns that the study does not name");
        let Columns { study, notes } = diagnose::with_columns(study, &model)?;
        let output = self
            .output
            .unwrap_or_else(|| super::add::output_beside(&self.model));
        let model_written = self.apply.then_some(output.as_path());
        self.report.check(console, model_written, &study)?;
        working.set_message("searching for missing effects");
        let asked = SearchOptions::checked(self.without, self.explain)?;
        if self.apply {
            let each = |effect: &str| working.set_message(format!("adding {effect}"));
            let mut applied = apply::apply(&study, &model, &asked, &each)?;
            applied.first.notes.extend(notes);
            let drawings = self.plots.with_staircase(
                &study,
                &applied.model,
                &steps::applied(&applied),
                &applied.staircase.noise_floor,
            )?;
            let page = self
                .report
                .page(Asked::of_applied(&study, &model, &applied))?;
            working.finish_and_clear();
            console.say_first_checks(&study)?;
            end(console, &output, &applied)?;
            self.plots.write(console, &drawings)?;
            self.report.write(console, page)?;
            return write_json(console, &output, &applied);
        }
        let mut diagnosis = diagnose::diagnose_with(&study, &model, &asked)?;
        diagnosis.notes.extend(notes);
        let moved = changed::moved(&study, &model)?;
        let drawings = self.plots.with_staircase(
            &study,
            &model,
            &steps::found(&diagnosis),
            &diagnosis.noise_floor,
        )?;
        let page = self
            .report
            .page(Asked::of_diagnosis(&study, &model, &diagnosis))?;
        working.finish_and_clear();
        console.say_first_checks(&study)?;
        say_moved(console, &moved)?;
        say(console, &diagnosis)?;
        self.plots.write(console, &drawings)?;
        self.report.write(console, page)?;
        console.json(&Printed {
            diagnosis: &diagnosis,
            moved,
        })
    }
}

/// What `--json` holds: the diagnosis, and what moved since the model was made.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    moved: Vec<ParameterChange>,
}

/// Says which values of the model are others on these records.
fn say_moved(console: &Console, moved: &[ParameterChange]) -> Result<()> {
    if moved.is_empty() {
        return Ok(());
    }
    let words: Vec<String> = moved.iter().map(ParameterChange::in_words).collect();
    console.say(format!(
        "Changed since the model was made: {}. The search uses the new values; `jointwatch changed` shows both.\n",
        words.join("; ")
    ))
}

/// Shows what was done and writes the model.
fn end(console: &Console, output: &Path, applied: &Applied) -> Result<()> {
    let added = applied.staircase.steps.len() > 1;
    if added {
        applied.model.write(output)?;
    }
    say(console, &applied.first)?;
    console.say(format!("\n{}", staircase::in_words(&applied.staircase)))?;
    if added {
        super::say_values(console, &applied.model)?;
        for note in [applied.not_kept(), applied.unsure()].into_iter().flatten() {
            console.say(format!("Note: {note}."))?;
        }
        console.say_warnings(&applied.model.warnings)?;
        console.say(format!("\nModel written to {}.", output.display()))?;
    } else {
        console.say("Nothing was added, so no model was written.")?;
    }
    Ok(())
}

/// What scripts read of it.
fn write_json(console: &Console, output: &Path, applied: &Applied) -> Result<()> {
    let added = applied.staircase.steps.len() > 1;
    let mut json = serde_json::to_value(&applied.first).map_err(not_json)?;
    let more = serde_json::json!({
        "staircase": applied.staircase,
        "model": added.then_some(output),
        "verdict_after": applied.last.verdict,
        "effects": applied.model.effects,
    });
    if let (Some(json), serde_json::Value::Object(more)) = (json.as_object_mut(), more) {
        json.extend(more);
    }
    console.json(&json)
}

fn not_json(error: serde_json::Error) -> Error {
    Error::failed(format!("the result could not be written as JSON ({error})"))
}

fn say(console: &Console, diagnosis: &Diagnosis) -> Result<()> {
    console.say_data_problems(&diagnosis.data_problems)?;
    if !diagnosis.ranked.is_empty() {
        console.say(format!(
            "Candidates for what is missing. Probability: that it acts, alone or beside others, so they need not sum to 1. Errors: RMS \
             error over RMS force of its axis with it alone, on stretches of the training records that it was not fitted to:\n{}\n{}\n",
            candidates(diagnosis),
            of_no_effect(diagnosis)
        ))?;
    }
    if !diagnosis.looked_at.is_empty() {
        console.say(format!(
            "Everything that was looked at:\n{}\n",
            looked_at(diagnosis)
        ))?;
    }
    let mut table = Table::new(&["axis", "error before", "after", "noise floor"]);
    for (axis, before) in &diagnosis.relative_error_before {
        table.row(vec![
            axis.clone(),
            format!("{before:.4}"),
            format!("{:.4}", diagnosis.relative_error_after[axis]),
            format!("{:.4}", diagnosis.noise_floor[axis]),
        ]);
    }
    console.say(format!(
        "With everything that is missing added, RMS error over RMS force on the {}:\n{table}\n",
        diagnosis.judged_on.words()
    ))?;
    let found: Vec<String> = diagnosis.found.iter().map(Found::name).collect();
    let verdict = match diagnosis.verdict {
        Verdict::Effect => format!("{}{}", told(diagnosis, &found), beside(diagnosis)),
        Verdict::None => format!("Nothing is missing{}.", diagnosis.but_above_noise()),
        Verdict::Unknown => diagnosis.unknown_in_words(),
        Verdict::Data => "The data are at fault: what is said above of effects means nothing before they are put right.".into(),
    };
    console.say(verdict)?;
    if diagnosis.verdict != Verdict::None {
        for candidate in diagnosis.found_candidates() {
            console.say(values(candidate))?;
            let alike = in_one_group(candidate, diagnosis);
            if !alike.is_empty() {
                console.say(alike)?;
            }
        }
    }
    console.say_notes(&diagnosis.notes)?;
    Ok(())
}

/// What was found: effects of the joint are missing, faults of the instruments are said for what
/// they are.
fn told(diagnosis: &Diagnosis, found: &[String]) -> String {
    let (instruments, joint): (Vec<_>, Vec<_>) = found
        .iter()
        .zip(&diagnosis.found)
        .partition(|(_, f)| effects::is_correction(&f.effect));
    let mut sentences = Vec::new();
    if !joint.is_empty() {
        let names: Vec<&str> = joint.iter().map(|(name, _)| name.as_str()).collect();
        sentences.push(format!("Missing: {}.", names.join(", ")));
    }
    for (name, fault) in instruments {
        let mut ranked = diagnosis.ranked.iter();
        let ranked = ranked.find(|r| r.effect == fault.effect && r.axis == fault.axis);
        let words = ranked
            .map(Ranked::as_a_term)
            .map(|term| corrections::in_words(&[term]));
        match words.as_deref() {
            Some([words, ..]) => sentences.push(format!("Instrument: {words} ({name}).")),
            _ => sentences.push(format!("Instrument: {name}.")),
        }
    }
    sentences.join(" ")
}

/// What is left beside what was found, in a sentence.
fn beside(diagnosis: &Diagnosis) -> String {
    let most = diagnosis.remainder.iter();
    let most = most.max_by(|a, b| a.relative_error.total_cmp(&b.relative_error));
    most.map_or_else(String::new, |left| {
        format!(
            " Something smaller besides: relative error {:.4} is left on axis {}, of whose power {:.0} % follows {}.",
            left.relative_error,
            left.axis,
            100.0 * left.explainable,
            left.follows
        )
    })
}

/// A row per set of effects that was looked at, the best of each axis first.
fn looked_at(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new(&[
        "axis",
        "effects",
        "mean log error",
        "error",
        "numbers",
        "outcome",
    ]);
    for looked in &diagnosis.looked_at {
        table.row(vec![
            looked.axis.clone(),
            if looked.effects.is_empty() {
                "the base alone".into()
            } else {
                looked.effects.join(" + ")
            },
            format!("{:.3}", looked.mean_log_error),
            format!("{:.4}", looked.error),
            looked.numbers.to_string(),
            looked.outcome.clone(),
        ]);
    }
    table
}

/// A row per candidate, without its values: those of laws with five would fill the screen.
fn candidates(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new(&["effect", "probability", "error without", "with", "like"]);
    for candidate in &diagnosis.ranked {
        table.row(vec![
            format!("{}@{}", candidate.effect, candidate.axis),
            format!("{:.2}", candidate.probability),
            format!("{:.4}", candidate.error_before),
            format!("{:.4}", candidate.error_after),
            first_few(&candidate.equivalent, 3),
        ]);
    }
    table
}

/// How likely it is that nothing is missing, and that something is which has no name here.
fn of_no_effect(diagnosis: &Diagnosis) -> String {
    let of = |key: &str| diagnosis.probabilities.get(key).copied().unwrap_or(0.0);
    format!(
        "Nothing is missing with probability {:.2}, something without a name is with {:.2}.",
        of("none"),
        of("unknown")
    )
}

/// The values of a candidate, in words.
fn values(candidate: &Ranked) -> String {
    let stops = stops(&candidate.effect, &candidate.parameters);
    let values = candidate.parameters.iter().chain(&stops);
    let values: Vec<String> = values
        .map(|p| quantity(&p.name, p.value, &p.unit))
        .collect();
    format!(
        "{}@{} would have {}.",
        candidate.effect,
        candidate.axis,
        values.join(", ")
    )
}

/// What these records cannot tell from a candidate, and the experiment that would; then what is
/// much like it and predicts worse. Nothing when it has no look-alike.
fn in_one_group(candidate: &Ranked, diagnosis: &Diagnosis) -> String {
    let own = format!("{}@{}", candidate.effect, candidate.axis);
    let (as_good, worse) = diagnosis.equivalents(candidate);
    let mut sentences = Vec::new();
    if !as_good.is_empty() {
        // What is likeliest may have more parameters than these records call for.
        let parameters = |name: &str| Entry::named(name).map_or(0, |e| e.parameters().len());
        let fewest = parameters(&candidate.effect);
        let is_simplest = as_good.iter().all(|e| fewest <= parameters(e));
        let simplest =
            match is_simplest && candidate.probability < 0.5 * candidate.group_probability {
                true => ", which is named because it is the simplest,",
                false => "",
            };
        sentences.push(format!(
            "These records cannot tell {own}{simplest} from {}: one of them acts with probability {:.2}. To tell them apart: {}",
            as_good.join(", "),
            candidate.group_probability,
            candidate.separating_experiment
        ));
    }
    if !worse.is_empty() {
        sentences.push(format!(
            "Much like {own}, but worse here: {}.",
            worse.join(", ")
        ));
    }
    sentences.join("\n")
}
