//! `jointwatch compare`: a model against the records of a study.

use super::Console;
use super::plots::Plots;
use crate::compare;
use crate::error::Result;
use crate::model_file::ModelFile;
use crate::study::Study;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch compare`.
#[derive(Args)]
pub(crate) struct Compare {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` wrote.
    model: PathBuf,
    #[command(flatten)]
    plots: Plots,
}

impl Compare {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("comparing");
        let model = ModelFile::read(&self.model)?;
        let study = Study::read(&self.study)?;
        let comparison = compare::compare(&study, &model)?;
        let drawings = self.plots.of_comparison(&study, &model, &comparison)?;
        working.finish_and_clear();
        for note in &study.notes {
            console.say(format!("Note: {note}."))?;
        }
        console.say(compare::in_words(&comparison, &model))?;
        self.plots.write(console, &drawings)?;
        console.json(&comparison)
    }
}
