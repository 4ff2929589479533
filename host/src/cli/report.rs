//! The option `--report FILE`: a page that shows a model on its study, made before anything is
//! printed and written at the end.

use super::console::Console;
use crate::diagnose::Diagnosis;
use crate::diagnose::add::Added;
use crate::diagnose::apply::Applied;
use crate::diagnose::changed::{Changed, Now};
use crate::lab;
use crate::model::file::ModelFile;
use crate::report::page::{self, Asked, Gathered};
use crate::simulate::respond::Response;
use crate::study::Study;
use crate::text::error::Result;
use crate::text::output;
use clap::Args;
use std::path::{Path, PathBuf};

/// Where the page goes.
#[derive(Args, Clone, Default)]
pub(super) struct Report {
    /// Write a page (HTML, one file, opens without a network) that shows the model on its study:
    /// errors, forces over time, loops, the residual and where it is large.
    #[arg(long = "report", id = "report", value_name = "FILE")]
    file: Option<PathBuf>,
    /// Write what that page shows as JSON, for the lab's page.
    #[arg(long, value_name = "FILE", hide = true)]
    contents: Option<PathBuf>,
}

impl Report {
    /// Refuses the page, and the `output` of the command besides, where they could not be written
    /// or are a record of the study.
    ///
    /// # Errors
    /// As [`Console::check_outputs`].
    pub(super) fn check(
        &self,
        console: &Console,
        output: Option<&Path>,
        study: &Study,
    ) -> Result<()> {
        let written = output.into_iter().chain(self.outputs());
        console.check_outputs(&written.collect::<Vec<_>>(), study)
    }

    /// Its files.
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
            before: beside,
            ..Asked::of_model(command(), study, model)
        })
    }

    /// The page of the model that was diagnosed, with the candidates.
    pub(super) fn of_diagnosis(
        &self,
        study: &Study,
        model: &ModelFile,
        diagnosis: &Diagnosis,
    ) -> Result<Option<Gathered>> {
        self.page(Asked::of_diagnosis(command(), study, model, diagnosis))
    }

    /// The page of a model with everything that was missing, beside the one that was brought.
    pub(super) fn of_applied(
        &self,
        study: &Study,
        before: &ModelFile,
        applied: &Applied,
    ) -> Result<Option<Gathered>> {
        self.page(Asked::of_applied(command(), study, before, applied))
    }

    /// The page of a joint that may have changed: the old model on the new records, and beside it
    /// one of the joint as it is now.
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
            ..Asked::of_model(command(), &now.study, now.model.as_ref().unwrap_or(old))
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
        self.page(Asked::of_added(command(), study, before, (added, effects)))
    }

    /// The page of a model with the motion that it gives the rig.
    pub(super) fn of_response(
        &self,
        study: &Study,
        model: &ModelFile,
        response: &Response,
    ) -> Result<Option<Gathered>> {
        self.page(Asked::of_response(command(), study, model, response))
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

/// The command as it was typed, without what the lab asks for besides.
fn command() -> String {
    let words = std::env::args().skip(1);
    let words = words.filter(|w| !lab::HIDDEN.iter().any(|h| w.starts_with(h)));
    let words: Vec<String> = std::iter::once("jointwatch".to_string())
        .chain(words)
        .collect();
    words.join(" ")
}
