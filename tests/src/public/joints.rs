//! Public measurements of real joints, from a plain base to what a diagnosis adds: what is said,
//! and what it is worth on validation records.

use crate::program::{measurements, workspace};
use jointwatch::assess::compare::compare;
use jointwatch::diagnose::{SearchOptions, Verdict, apply, with_columns};
use jointwatch::fit::identify::physical;
use jointwatch::model::file::ModelFile;
use jointwatch::study::{Role, Study};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// What stands before and after the table in docs/notebook/joints.md.
pub const MARKS: [&str; 2] = ["<!-- joints: begin -->", "<!-- joints: end -->"];

/// A set: what it is called, the folder of its files, and its study: on the project's pages, or
/// beside the files.
struct Set(&'static str, &'static str, Description);

enum Description {
    /// A study of this project, so that it is always there.
    InProject,
    OnPages(&'static str),
    WithFiles(&'static str),
}

const SETS: [Set; 9] = [
    Set(
        "EMPS, positioning axis",
        "data/emps",
        Description::OnPages("docs/missing-effects/emps.toml"),
    ),
    Set(
        "Silverbox, growing amplitude",
        "data/silverbox",
        Description::OnPages("docs/missing-effects/silverbox.toml"),
    ),
    Set(
        "band brake, sine",
        "data/brfd",
        Description::OnPages("docs/missing-effects/friction-damper.toml"),
    ),
    Set(
        "band brake, earthquakes",
        "data/brfd",
        Description::WithFiles("earthquakes.toml"),
    ),
    Set(
        "band brake, semi-active",
        "data/brfd",
        Description::WithFiles("semi_active.toml"),
    ),
    Set(
        "magnetorheological damper, Vargas",
        "data/mr_damper_vargas",
        Description::WithFiles("study.toml"),
    ),
    Set(
        "magnetorheological damper, Dyke",
        "data/mr_damper_dyke",
        Description::WithFiles("study.toml"),
    ),
    Set(
        "composite beam",
        "data/composite_beam",
        Description::WithFiles("study.toml"),
    ),
    Set(
        "robot joint, TIAGo",
        "tests/data/robot_joint",
        Description::InProject,
    ),
];

/// How many sets there are.
pub const COUNT: usize = SETS.len();

/// What came of a set.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What it is called.
    pub set: &'static str,
    /// NMSE of the base on every validation record and axis, per cent.
    pub base: Vec<f64>,
    /// What the diagnosis says.
    pub verdict: Verdict,
    /// Effects that were added and kept, such as `coulomb@x`.
    pub added: Vec<String>,
    /// NMSE with it, per cent.
    pub after: Vec<f64>,
}

/// Every set that is there, one after the other.
///
/// # Errors
/// One sentence when a file cannot be read or nothing can be learnt from it.
pub fn outcomes(told: &dyn Fn(&str)) -> Result<Vec<Outcome>, String> {
    let mut all = Vec::new();
    for set in &SETS {
        if let Some(files) = files(set) {
            told(set.0);
            all.push(outcome(set, &files).map_err(|e| format!("{}: {e}", set.0))?);
        }
    }
    Ok(all)
}

fn files(set: &Set) -> Option<PathBuf> {
    match set.2 {
        Description::InProject => Some(workspace().join(set.1)),
        _ => measurements(set.1),
    }
}

/// The sets whose files are part of this project.
///
/// # Errors
/// As [`outcomes`].
pub fn outcomes_in_project() -> Result<Vec<Outcome>, String> {
    let sets = SETS.iter();
    let sets = sets.filter(|set| matches!(set.2, Description::InProject));
    let files = sets.filter_map(|set| Some((set, files(set)?)));
    files.map(|(set, files)| outcome(set, &files)).collect()
}

fn outcome(set: &Set, files: &Path) -> Result<Outcome, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    for entry in fs::read_dir(files).map_err(|e| e.to_string())? {
        let path = entry.map_err(|e| e.to_string())?.path();
        let name = path.file_name().unwrap_or_default();
        fs::copy(&path, folder.path().join(name)).map_err(|e| e.to_string())?;
    }
    let description = match set.2 {
        Description::OnPages(page) => workspace().join(page),
        Description::WithFiles(name) => files.join(name),
        Description::InProject => files.join("study.toml"),
    };
    let path = folder.path().join("study.toml");
    fs::copy(description, &path).map_err(|e| e.to_string())?;
    let study = Study::read(&path).map_err(|e| e.to_string())?;
    let base = physical(&study).map_err(|e| e.to_string())?.model;
    let study = with_columns(study, &base).map_err(|e| e.to_string())?.study;
    let applied = apply::apply(&study, &base, &SearchOptions::default(), &|_| ());
    let applied = applied.map_err(|e| e.to_string())?;
    let steps = applied.staircase.steps.iter();
    Ok(Outcome {
        set: set.0,
        base: on_validation(&study, &base)?,
        verdict: applied.first.verdict,
        added: steps
            .flat_map(|step| step.added.clone())
            .filter(|name| applied.model.effects.iter().any(|e| e.name() == *name))
            .collect(),
        after: on_validation(&study, &applied.model)?,
    })
}

fn on_validation(study: &Study, model: &ModelFile) -> Result<Vec<f64>, String> {
    let comparison = compare(study, model).map_err(|e| e.to_string())?;
    let records = comparison.records.iter();
    let records = records.filter(|record| record.role == Role::Validate);
    let errors = records.flat_map(|record| record.axes.values().map(|axis| axis.nmse_percent));
    Ok(errors.collect())
}

/// The table of the page.
pub fn table(outcomes: &[Outcome]) -> String {
    let mut text =
        String::from("| set | base, % | verdict | added | with it, % |\n|---|--:|---|---|--:|\n");
    let in_words = |errors: &[f64]| {
        let errors = errors.iter().map(|e| super::league::digits(*e));
        errors.collect::<Vec<_>>().join(", ")
    };
    for outcome in outcomes {
        let added: Vec<String> = outcome.added.iter().map(|a| format!("`{a}`")).collect();
        let verdict = format!("{:?}", outcome.verdict).to_lowercase();
        let _ = writeln!(
            text,
            "| {} | {} | {verdict} | {} | {} |",
            outcome.set,
            in_words(&outcome.base),
            added.join(", "),
            in_words(&outcome.after)
        );
    }
    text
}
