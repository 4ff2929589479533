//! `jointwatch compare`: a model against the records of a study.

use super::console::Console;
use super::plots::Plots;
use super::report::Report;
use crate::assess::compare::{self, Comparison};
use crate::assess::data_checks;
use crate::model::file::ModelFile;
use crate::study::Study;
use crate::text::error::Result;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Options of `jointwatch compare`.
#[derive(Args)]
pub(crate) struct Compare {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` or `add` wrote.
    model: PathBuf,
    #[command(flatten)]
    plots: Plots,
    #[command(flatten)]
    report: Report,
}

/// The output of `compare --json`.
#[derive(Serialize)]
struct Compared {
    #[serde(flatten)]
    comparison: Comparison,
    /// What is wrong with the data, as `diagnose` finds it.
    data_problems: Vec<String>,
}

impl Compare {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("comparing");
        let model = ModelFile::read(&self.model)?;
        let study = Study::read(&self.study)?;
        let written: Vec<&Path> = self.report.outputs().collect();
        console.check_outputs(&written, &study, Some(&self.model))?;
        let comparison = compare::compare(&study, &model)?;
        let problems = data_checks::check(&study, &model.filters);
        let drawings = self.plots.of_comparison(&study, &model, &comparison)?;
        let page = self.report.of_model(&study, &model)?;
        working.finish_and_clear();
        for note in &study.notes {
            console.say(format!("Note: {note}."))?;
        }
        let serious = problems.iter().any(|finding| finding.serious);
        let data_problems = data_checks::sentences(problems);
        console.say_data_problems(&data_problems)?;
        if serious {
            console.say("The data are at fault: the errors below say little of the model before they are put right.")?;
        }
        console.say(compare::in_words(&comparison, &model))?;
        self.plots.write(console, &drawings)?;
        self.report.write(console, page)?;
        console.json(&Compared {
            comparison,
            data_problems,
        })
    }
}
