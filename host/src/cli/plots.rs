//! The option `--plots DIR`: pictures of a model on its study, drawn first and written when everything else went well.

use super::console::Console;
use crate::assess::compare::{self, Comparison};
use crate::diagnose::add::{Added, Change};
use crate::diagnose::apply::Applied;
use crate::diagnose::{Diagnosis, PerAxis};
use crate::model::file::ModelFile;
use crate::report::{Drawing, Step, drawing, pictures};
use crate::study::{Role, Study};
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Where the pictures go.
#[derive(Args, Clone, Default)]
pub(super) struct Plots {
    /// Draw pictures (SVG) into this folder: force and residual over time, phase plots, the residual over the state plane
    /// with the failing region framed, and the staircase of errors where effects are added.
    #[arg(long = "plots", value_name = "DIR")]
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
            &steps_found(diagnosis),
            &diagnosis.noise_floor,
        )
    }

    /// The pictures of the model with everything that was missing, and the staircase down to it.
    pub(super) fn of_applied(&self, study: &Study, applied: &Applied) -> Result<Vec<Drawing>> {
        self.with_staircase(
            study,
            &applied.model,
            &steps_applied(applied),
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
        let (steps, floors) = steps_added(&added.changes, &effects.join(", "));
        self.with_staircase(study, &added.model, &steps, &floors)
    }

    /// The pictures of a model, and a staircase of errors: what was done step by step, and the floor of each axis.
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
        let mut drawings = pictures::of_model(study, model, &compare::compare(study, model)?)?;
        drawings.push(pictures::of_staircase(model, steps, floors)?);
        Ok(drawings)
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

/// Before, and after each addition.
pub(super) fn steps_applied(applied: &Applied) -> Vec<Step> {
    let steps = applied.staircase.steps.iter().map(|step| Step {
        label: if step.added.is_empty() {
            "before".into()
        } else {
            step.added.join(", ")
        },
        errors: step.relative_error.clone(),
    });
    steps.collect()
}

/// Before, and after everything that was found.
pub(super) fn steps_found(diagnosis: &Diagnosis) -> Vec<Step> {
    let mut steps = vec![Step {
        label: "before".into(),
        errors: diagnosis.relative_error_before.clone(),
    }];
    let found = diagnosis.found.iter();
    let found: Vec<String> = found.map(|f| format!("{}@{}", f.effect, f.axis)).collect();
    if !found.is_empty() {
        steps.push(Step {
            label: found.join(", "),
            errors: diagnosis.relative_error_after.clone(),
        });
    }
    steps
}

/// Before and after on the records that the model has not seen (on all, where it has seen all), several records as the root
/// of their mean square.
fn steps_added(changes: &[Change], label: &str) -> (Vec<Step>, PerAxis) {
    let awake = || changes.iter().filter(|c| !c.at_rest);
    let held_out = awake().any(|c| c.role == Role::Validate);
    let judged = || awake().filter(move |c| !held_out || c.role == Role::Validate);
    let over_records = |figure: fn(&Change) -> f64| -> PerAxis {
        judged()
            .map(|change| {
                let mine = judged().filter(|c| c.axis == change.axis);
                let squares: Vec<f64> = mine.map(|c| figure(c).powi(2)).collect();
                let mean = squares.iter().sum::<f64>() / squares.len() as f64;
                (change.axis.clone(), mean.sqrt())
            })
            .collect()
    };
    let step = |label: &str, errors| Step {
        label: label.into(),
        errors,
    };
    let steps = vec![
        step("before", over_records(|c| c.before)),
        step(label, over_records(|c| c.after)),
    ];
    (steps, over_records(|c| c.noise_floor))
}
