//! The option `--plots DIR`: pictures of a model on its study, drawn first and written when
//! everything else went well.

use super::console::Console;
use crate::assess::compare::Comparison;
use crate::diagnose::PerAxis;
use crate::model::file::ModelFile;
use crate::report::{Drawing, Step, drawing, pictures};
use crate::study::Study;
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Where the pictures go.
#[derive(Args, Clone, Default)]
pub(super) struct Plots {
    /// Draw pictures (SVG) into this folder: force and residual over time, phase plots, the
    /// residual over the state plane with the failing region framed, and the staircase of
    /// errors where effects are added.
    #[arg(long = "plots", id = "plots", value_name = "DIR")]
    folder: Option<PathBuf>,
}

impl Plots {
    /// The pictures of a comparison; none when none were asked for.
    pub(super) fn of_comparison(
        &self,
        study: &Study,
        model: &ModelFile,
        comparison: &Comparison,
    ) -> Result<Vec<Drawing>> {
        match &self.folder {
            None => Ok(Vec::new()),
            Some(folder) => {
                // Before anything is printed: what cannot be written is told first.
                drawing::make(folder)?;
                pictures::of_model(study, model, comparison)
            }
        }
    }

    /// The pictures of a model, and a staircase of errors: what was done step by step, and the
    /// floor of each axis.
    pub(super) fn with_staircase(
        &self,
        study: &Study,
        model: &ModelFile,
        steps: &[Step],
        floors: &PerAxis,
    ) -> Result<Vec<Drawing>> {
        let Some(folder) = &self.folder else {
            return Ok(Vec::new());
        };
        drawing::make(folder)?;
        pictures::with_staircase(study, model, steps, floors)
    }

    /// Writes what was drawn, and says in a line what that is.
    pub(super) fn write(&self, console: &Console, drawings: &[Drawing]) -> Result<()> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        drawing::write(drawings, folder)?;
        let names: Vec<&str> = drawings.iter().map(|d| d.file.as_str()).collect();
        console.say(format!(
            "\nPictures in {}: {}.",
            folder.display(),
            names.join(", ")
        ))
    }
}
