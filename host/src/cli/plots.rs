//! The option `--plots DIR`: pictures of a model on its study, drawn first and written when
//! everything else went well.

use super::console::Console;
use crate::assess::compare::Comparison;
use crate::diagnose::add::Added;
use crate::diagnose::apply::Applied;
use crate::diagnose::{Diagnosis, PerAxis};
use crate::model::file::ModelFile;
use crate::report::{Drawing, Step, drawing, pictures, steps};
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

    /// The pictures of the model that was brought, and the staircase of what was found.
    pub(super) fn of_diagnosis(
        &self,
        study: &Study,
        model: &ModelFile,
        diagnosis: &Diagnosis,
    ) -> Result<Vec<Drawing>> {
        self.with_staircase(
            study,
            model,
            &steps::found(diagnosis),
            &diagnosis.noise_floor,
        )
    }

    /// The pictures of the model with everything that was missing, and the staircase down to it.
    pub(super) fn of_applied(&self, study: &Study, applied: &Applied) -> Result<Vec<Drawing>> {
        self.with_staircase(
            study,
            &applied.model,
            &steps::applied(applied),
            &applied.staircase.noise_floor,
        )
    }

    /// The pictures of the wider model, and the staircase down to it.
    pub(super) fn of_added(
        &self,
        study: &Study,
        added: &Added,
        effects: &[String],
    ) -> Result<Vec<Drawing>> {
        let (steps, floors) = steps::added(added, &effects.join(", "));
        self.with_staircase(study, &added.model, &steps, &floors)
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
