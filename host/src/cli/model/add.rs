//! `jointwatch add`: add physical effects to a model, and see the error fall.

use crate::cli::console::Console;
use crate::cli::plots::Plots;
use crate::cli::report::Report;
use crate::diagnose::add::{self, Added};
use crate::model::file::{JudgedOn, ModelFile};
use crate::study::Role;
use crate::text::error::{Error, Result};
use crate::text::table::{Table, percent};
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `jointwatch add`.
#[derive(Args)]
pub(crate) struct Add {
    /// The study: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// The model that `identify` or `add` wrote.
    model: PathBuf,
    /// The effects to add, e.g. coulomb@x; `jointwatch effects` lists them.
    #[arg(required = true, value_name = "EFFECT@AXIS")]
    effects: Vec<String>,
    /// Where to write the wider model; the model's own name with -added when left out.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Keep an effect that does not help.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    plots: Plots,
    #[command(flatten)]
    report: Report,
}

impl Add {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the records");
        let model = ModelFile::read(&self.model)?;
        let study = model.read_study(&self.study, &self.effects)?;
        let output = self.output.unwrap_or_else(|| output_beside(&self.model));
        self.report.check(console, Some(&output), &study)?;
        working.set_message("finding all values anew");
        let added = add::add(&study, &model, &self.effects)?;
        let drawings = self.plots.of_added(&study, &added, &self.effects)?;
        let page = self
            .report
            .of_added(&study, &model, &added, &self.effects)?;
        working.finish_and_clear();
        say(console, &added)?;
        if !added.helps && !self.force {
            return Err(Error::failed(format!(
                "{} does not help: on the {} no axis's error falls by as much as a hundredth, so nothing was written; --force \
                 keeps it all the same",
                self.effects.join(", "),
                added.errors.judged_on.words()
            )));
        }
        added.model.write(&output)?;
        console.say(format!("\nModel written to {}.", output.display()))?;
        self.plots.write(console, &drawings)?;
        self.report.write(console, page)?;
        console.json(&added.as_json(Some(&output)))
    }
}

/// Where a model with more effects goes when nobody says.
pub(super) fn output_beside(model: &Path) -> PathBuf {
    let stem = model.file_stem().unwrap_or_default();
    model.with_file_name(format!("{}-added.json", stem.to_string_lossy()))
}

fn say(console: &Console, added: &Added) -> Result<()> {
    super::say_values(console, &added.model)?;
    for (role, heading) in [
        (Role::Train, "Verification (training records)"),
        (Role::Validate, "Validation (other records)"),
    ] {
        let changes = added
            .changes
            .iter()
            .filter(|c| c.role == role && !c.at_rest);
        let mut table = Table::new(&[
            "record",
            "axis",
            "NMSE before",
            "after",
            "relative error before",
            "after",
            "noise floor",
        ]);
        let mut any = false;
        for change in changes {
            any = true;
            table.row(vec![
                change.file.clone(),
                change.axis.clone(),
                percent(change.before_nmse_percent),
                percent(change.after_nmse_percent),
                format!("{:.4}", change.before),
                format!("{:.4}", change.after),
                format!("{:.4}", change.noise_floor),
            ]);
        }
        if any {
            console.say(format!("\n{heading}:\n{table}"))?;
        }
    }
    if added.errors.judged_on == JudgedOn::HeldOutBlocks {
        let mut table = Table::new(&["axis", "relative error before", "after", "noise floor"]);
        let errors = added.errors.before.iter().zip(&added.errors.after);
        for ((before, after), floor) in errors.zip(&added.noise_floor) {
            table.row(vec![
                before.axis.clone(),
                format!("{:.4}", before.relative_error),
                format!("{:.4}", after.relative_error),
                format!("{floor:.4}"),
            ]);
        }
        console.say(format!(
            "\nThe study has no validation records; blocks of its training records, each predicted from the rest:\n{table}"
        ))?;
    }
    if !added.helps {
        console.say("It does not help.")?;
    }
    if !added.floors_at_rest {
        console.say(
            "Note: an axis rests for too short in every record to show its noise, so its noise floor is taken from high frequencies and may be too low.",
        )?;
    }
    console.say_warnings(&added.model.warnings)
}
