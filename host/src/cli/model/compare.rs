//! `jointwatch compare`: a model against the records of a study.

use crate::assess::compare;
use crate::assess::compared::compared;
use crate::cli::console::Console;
use crate::cli::plots::Plots;
use crate::cli::report::Report;
use crate::model::file::ModelFile;
use crate::report::page::Asked;
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch compare`.
#[derive(Args)]
pub(crate) struct Compare {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` or `add` wrote.
    model: PathBuf,
    /// With --report: another model of the study, shown beside it as the one before.
    #[arg(long, value_name = "MODEL")]
    beside: Option<PathBuf>,
    #[command(flatten)]
    plots: Plots,
    #[command(flatten)]
    report: Report,
}

impl Compare {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("comparing");
        let model = ModelFile::read(&self.model)?;
        let beside = self.beside.as_deref().map(ModelFile::read).transpose()?;
        let study = model.read_study(&self.study, &[])?;
        self.report.check(console, None, &study)?;
        let found = compared(&study, &model)?;
        let comparison = &found.comparison;
        let drawings = self.plots.of_comparison(&study, &model, comparison)?;
        let page = self.report.page(Asked {
            before: beside.as_ref(),
            ..Asked::of_model(&study, &model)
        })?;
        working.finish_and_clear();
        console.say_first_checks(&study)?;
        console.say_notes(&study.notes)?;
        console.say_data_problems(&found.data_problems)?;
        if found.serious {
            console.say("The data are at fault: the errors below say little of the model before they are put right.")?;
        }
        console.say(compare::in_words(comparison, &model))?;
        self.plots.write(console, &drawings)?;
        self.report.write(console, page)?;
        console.json(&found)
    }
}
