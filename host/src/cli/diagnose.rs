//! `jointwatch diagnose`: which physical effect a model lacks.

use super::Console;
use super::plots::Plots;
use crate::diagnose::{self, Diagnosis, Verdict};
use crate::error::Result;
use crate::model_file::ModelFile;
use crate::study::Study;
use crate::table::Table;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch diagnose`.
#[derive(Args)]
pub(crate) struct Diagnose {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` wrote.
    model: PathBuf,
    #[command(flatten)]
    plots: Plots,
}

impl Diagnose {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the records");
        let model = ModelFile::read(&self.model)?;
        let study = Study::read(&self.study)?;
        working.set_message("searching for missing effects");
        let diagnosis = diagnose::diagnose(&study, &model)?;
        let drawings = self.plots.of_diagnosis(&study, &model, &diagnosis)?;
        working.finish_and_clear();
        say(console, &diagnosis)?;
        self.plots.write(console, &drawings)?;
        console.json(&diagnosis)
    }
}

fn say(console: &Console, diagnosis: &Diagnosis) -> Result<()> {
    let mut table = Table::new(&[
        "effect",
        "score",
        "error without",
        "with",
        "parameters",
        "like",
    ]);
    for candidate in &diagnosis.ranked {
        let parameters: Vec<String> = candidate
            .parameters
            .iter()
            .map(|p| format!("{} {:.3e} {}", p.name, p.value, p.unit))
            .collect();
        table.row(vec![
            format!("{}@{}", candidate.effect, candidate.axis),
            format!("{:.1}", candidate.score),
            format!("{:.4}", candidate.error_before),
            format!("{:.4}", candidate.error_after),
            parameters.join(", "),
            candidate.equivalent.join(", "),
        ]);
    }
    console.say(table.to_string())?;
    let mut table = Table::new(&["axis", "error before", "after", "noise floor"]);
    for (axis, before) in &diagnosis.relative_error_before {
        table.row(vec![
            axis.clone(),
            format!("{before:.4}"),
            format!("{:.4}", diagnosis.relative_error_after[axis]),
            format!("{:.4}", diagnosis.noise_floor[axis]),
        ]);
    }
    console.say(table.to_string())?;
    let found: Vec<String> = diagnosis
        .found
        .iter()
        .map(|f| format!("{}@{}", f.effect, f.axis))
        .collect();
    let verdict = match diagnosis.verdict {
        Verdict::Effect => format!("Missing: {}.", found.join(", ")),
        Verdict::None => "Nothing is missing.".into(),
        Verdict::Unknown => "Something is missing that is not in the library.".into(),
        Verdict::Data => "The data are at fault.".into(),
    };
    console.say(verdict)?;
    for note in &diagnosis.notes {
        console.say(format!("Note: {note}."))?;
    }
    Ok(())
}
