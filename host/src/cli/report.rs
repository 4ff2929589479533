//! The option `--report FILE`: a page that shows a model on its study, made before anything is printed and written at the end.

use super::console::Console;
use super::plots;
use crate::diagnose::add::Added;
use crate::diagnose::apply::Applied;
use crate::diagnose::changed::{Changed, Now};
use crate::diagnose::{Diagnosis, PerAxis};
use crate::lab;
use crate::model::file::{JudgedOn, ModelFile};
use crate::report::Step;
use crate::report::page::{self, Asked, Gathered};
use crate::simulate::respond::Response;
use crate::study::{Role, Study};
use crate::text::error::Result;
use crate::text::output;
use clap::Args;
use std::path::{Path, PathBuf};

/// Where the page goes.
#[derive(Args, Clone, Default)]
pub(super) struct Report {
    /// Write a page (HTML, one file, opens without a network) that shows the model on its study: errors, forces over time, loops,
    /// the residual and where it is large.
    #[arg(long = "report", value_name = "FILE")]
    file: Option<PathBuf>,
    /// Write what that page shows as JSON, for the lab's page.
    #[arg(long, value_name = "FILE", hide = true)]
    contents: Option<PathBuf>,
}

impl Report {
    /// The page's file, to be checked before work begins.
    pub(super) fn outputs(&self) -> impl Iterator<Item = &Path> {
        let files = [self.file.as_deref(), self.contents.as_deref()];
        files.into_iter().flatten()
    }

    /// The page of a model, beside another one if there is one; none when none was asked for.
    pub(super) fn of_model(
        &self,
        study: &Study,
        model: &ModelFile,
        beside: Option<&ModelFile>,
    ) -> Result<Option<Gathered>> {
        self.page(Asked {
            judged_on: judged_on(study),
            before: beside,
            ..asked(study, model)
        })
    }

    /// The page of the model that was diagnosed, with the candidates.
    pub(super) fn of_diagnosis(
        &self,
        study: &Study,
        model: &ModelFile,
        diagnosis: &Diagnosis,
    ) -> Result<Option<Gathered>> {
        self.page(Asked {
            steps: plots::steps_found(diagnosis),
            floors: Some(diagnosis.noise_floor.clone()),
            judged_on: diagnosis.judged_on.words().into(),
            diagnosis: Some(diagnosis),
            ..asked(study, model)
        })
    }

    /// The page of a model with everything that was missing, beside the one that was brought.
    pub(super) fn of_applied(
        &self,
        study: &Study,
        before: &ModelFile,
        applied: &Applied,
    ) -> Result<Option<Gathered>> {
        let steps = plots::steps_applied(applied);
        self.page(Asked {
            before: (steps.len() > 1).then_some(before),
            steps,
            floors: Some(applied.staircase.noise_floor.clone()),
            judged_on: applied.staircase.judged_on.words().into(),
            diagnosis: Some(&applied.first),
            ..asked(study, &applied.model)
        })
    }

    /// The page of a joint that may have changed: the old model on the new records, and beside it one of the joint as it is now.
    pub(super) fn of_change(
        &self,
        old: &ModelFile,
        changed: &Changed,
        now: &Now,
    ) -> Result<Option<Gathered>> {
        self.page(Asked {
            answer: Some(changed.in_a_sentence()),
            before: now.model.as_ref().map(|_| old),
            judged_on: "new records".into(),
            ..asked(&now.study, now.model.as_ref().unwrap_or(old))
        })
    }

    /// The page of the wider model, beside the one that was brought.
    pub(super) fn of_added(
        &self,
        study: &Study,
        before: &ModelFile,
        added: &Added,
        effects: &[String],
    ) -> Result<Option<Gathered>> {
        let errors = |errors: &[crate::model::file::AxisError]| -> PerAxis {
            let errors = errors.iter();
            errors.map(|e| (e.axis.clone(), e.relative_error)).collect()
        };
        let floors = added.errors.after.iter().zip(&added.noise_floor);
        self.page(Asked {
            before: Some(before),
            steps: vec![
                Step {
                    label: "before".into(),
                    errors: errors(&added.errors.before),
                },
                Step {
                    label: effects.join(", "),
                    errors: errors(&added.errors.after),
                },
            ],
            floors: Some(floors.map(|(e, f)| (e.axis.clone(), *f)).collect()),
            judged_on: added.errors.judged_on.words().into(),
            ..asked(study, &added.model)
        })
    }

    /// The page of a model with the motion that it gives the rig.
    pub(super) fn of_response(
        &self,
        study: &Study,
        model: &ModelFile,
        response: &Response,
    ) -> Result<Option<Gathered>> {
        self.page(Asked {
            judged_on: judged_on(study),
            response: Some(response),
            ..asked(study, model)
        })
    }

    fn page(&self, asked: Asked<'_>) -> Result<Option<Gathered>> {
        let wanted = self.outputs().next().is_some();
        wanted.then(|| page::gathered(&asked)).transpose()
    }

    /// Writes the page and says how to open it.
    pub(super) fn write(&self, console: &Console, page: Option<Gathered>) -> Result<()> {
        let Some(page) = page else {
            return Ok(());
        };
        if let Some(file) = &self.contents {
            output::write_whole(file, page.json.as_bytes())?;
        }
        let Some(file) = &self.file else {
            return Ok(());
        };
        output::write_whole(file, page.html().as_bytes())?;
        console.say(format!(
            "\nReport written to {}; open it in a browser.",
            file.display()
        ))
    }
}

/// What every page is told.
fn asked<'a>(study: &'a Study, model: &'a ModelFile) -> Asked<'a> {
    // What the lab asks for besides is not what the user typed.
    let words = std::env::args().skip(1);
    let words = words.filter(|w| !lab::HIDDEN.iter().any(|h| w.starts_with(h)));
    let words: Vec<String> = std::iter::once("jointwatch".to_string())
        .chain(words)
        .collect();
    Asked {
        answer: None,
        command: words.join(" "),
        study,
        model,
        before: None,
        steps: Vec::new(),
        floors: None,
        judged_on: String::new(),
        diagnosis: None,
        response: None,
    }
}

/// The records that say how good a model is.
fn judged_on(study: &Study) -> String {
    let validates = study.records.iter().any(|r| r.role == Role::Validate);
    match validates {
        true => JudgedOn::Validation.words().into(),
        false => "training records (the study has no others)".into(),
    }
}
