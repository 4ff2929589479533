//! Where a subcommand prints: text, JSON, and the sign that work goes on.

use super::progress_lines;
use crate::study::{Study, mistakes};
use crate::text::error::Result;
use crate::text::output;
use crate::text::printable;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::Duration;

/// What every subcommand has at hand: where to print, and the progress display.
pub(crate) struct Console {
    json: Option<PathBuf>,
    quiet: bool,
    progress_lines: bool,
}

impl Console {
    /// A console that prints unless `quiet`, and writes its result to `json`.
    pub(crate) fn new(json: Option<PathBuf>, quiet: bool) -> Self {
        Self {
            json,
            quiet,
            progress_lines: false,
        }
    }

    /// The same, with progress as lines on standard error: for a program that reads them.
    pub(crate) fn with_progress_lines(self, progress_lines: bool) -> Self {
        Self {
            progress_lines,
            ..self
        }
    }

    /// Prints a paragraph, unless told to be quiet or standard output carries JSON.
    pub(crate) fn say(&self, text: impl AsRef<str>) -> Result<()> {
        if self.quiet || self.json_to_stdout() {
            return Ok(());
        }
        output::print(format!("{}\n", printable::escaped(text.as_ref())).as_bytes())
    }

    /// Prints what is wrong with a study's data, a line each.
    pub(crate) fn say_data_problems(&self, problems: &[String]) -> Result<()> {
        let mut problems = problems.iter();
        problems.try_for_each(|problem| self.say(format!("Data: {problem}.")))
    }

    /// Prints what a model warns of, a line each.
    pub(crate) fn say_warnings(&self, warnings: &[String]) -> Result<()> {
        let mut warnings = warnings.iter();
        warnings.try_for_each(|warning| self.say(format!("Warning: {warning}.")))
    }

    /// Prints what there is to know besides, a line each.
    pub(crate) fn say_notes(&self, notes: &[String]) -> Result<()> {
        let mut notes = notes.iter();
        notes.try_for_each(|note| self.say(format!("Note: {note}.")))
    }

    /// Prints the mistakes of a first study, before anything is fitted to it.
    pub(crate) fn say_first_checks(&self, study: &Study) -> Result<()> {
        let mut found = mistakes::check(study).into_iter();
        found.try_for_each(|sentence| self.say(format!("Check: {sentence}.")))
    }

    /// Writes the result as JSON where `--json` says, if it was given.
    pub(crate) fn json<T: serde::Serialize>(&self, value: &T) -> Result<()> {
        match &self.json {
            None => Ok(()),
            Some(path) => output::write_whole(path, output::json_text(value)?.as_bytes()),
        }
    }

    /// A console for the steps of a larger command: prints alike, writes no JSON of its own.
    pub(crate) fn inner(&self) -> Self {
        Self {
            json: None,
            quiet: self.quiet || self.json_to_stdout(),
            progress_lines: self.progress_lines,
        }
    }

    /// A line on standard error that shows that work goes on; invisible when that is no terminal.
    pub(crate) fn working(&self, what: &'static str) -> ProgressBar {
        if self.progress_lines {
            return progress_lines::bar(what);
        }
        if self.quiet || !std::io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new_spinner().with_message(what);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(120));
        bar
    }

    /// Whether it prints nothing but errors.
    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// The file for JSON lines, if one was asked for.
    pub(crate) fn json_file(&self) -> Option<&PathBuf> {
        self.json.as_ref()
    }

    /// Whether standard output carries JSON in place of the text.
    pub(crate) fn json_to_stdout(&self) -> bool {
        self.json.as_deref().is_some_and(output::is_standard)
    }
}
