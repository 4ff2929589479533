//! The option `--report FILE`: a page that shows a model on its study, made before anything is
//! printed and written at the end.

use super::console::Console;
use crate::lab;
use crate::report::page::{self, Asked, Gathered};
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

    /// The page; none when none was asked for.
    pub(super) fn page(&self, asked: Asked<'_>) -> Result<Option<Gathered>> {
        let command = command();
        let wanted = self.outputs().next().is_some();
        wanted
            .then(|| page::gathered(&Asked { command, ..asked }))
            .transpose()
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
