//! `jointwatch respond`: how the rig would move with the model in place of its joint.

use crate::cli::console::Console;
use crate::cli::report::Report;
use crate::model::file::ModelFile;
use crate::report::page::Asked;
use crate::simulate::respond::{self, Options};
use crate::text::error::{Error, Result};
use crate::text::output;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch respond`.
#[derive(Args)]
pub(crate) struct Respond {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` wrote.
    model: PathBuf,
    /// Only this record, as study.toml names it; all of them when left out.
    #[arg(long, value_name = "FILE")]
    record: Option<String>,
    /// Start anew from the measured motion every so many seconds: how well the model looks that
    /// far ahead.
    #[arg(long, value_name = "SECONDS")]
    restart: Option<f64>,
    /// Drive the body by the logged force also where the study was simulated and its whole rig
    /// could be.
    #[arg(long)]
    measured: bool,
    /// Write simulated and measured states as CSV; needs --record in a study of several.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    report: Report,
}

impl Respond {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("simulating the response");
        let model = ModelFile::read(&self.model)?;
        let logged = model.read_study(&self.study, &[])?;
        self.report
            .check(console, self.output.as_deref(), &logged)?;
        let study = model.corrected(&logged)?.into_owned();
        let options = Options {
            record: self.record,
            restart_s: self.restart,
            measured: self.measured,
        };
        let response = respond::respond(&study, &model, &options)?;
        let page = self
            .report
            .page(Asked::of_response(&logged, &model, &response))?;
        working.finish_and_clear();
        if let Some(path) = &self.output {
            let [only] = response.records.as_slice() else {
                return Err(Error::usage(format!(
                    "--output writes one record, and this study has {}; name one with --record",
                    response.records.len()
                )));
            };
            output::write_whole(path, respond::as_csv(only, &study).as_bytes())?;
        }
        console.say_notes(&study.notes)?;
        console.say(respond::in_words(
            &response,
            &study,
            options.record.is_some(),
        ))?;
        let notes: Vec<String> = response
            .notes
            .iter()
            .map(|n| format!("Note: {n}."))
            .collect();
        if !notes.is_empty() {
            console.say(format!("\n{}", notes.join("\n")))?;
        }
        if let Some(path) = &self.output {
            console.say(format!("States written to {}.", path.display()))?;
        }
        self.report.write(console, page)?;
        console.json(&response)
    }
}
