//! `jointwatch accumulate`: sum records into a part, from which and others a model is made without
//! the records.

use crate::cli::console::Console;
use crate::fit::sums::{Part, Plan};
use crate::study::Study;
use crate::study::further::Template;
use crate::text::error::{Error, Result, in_order};
use crate::text::output;
use crate::text::table::sample_rate;
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Records that are read before their sums are added up: what bounds the memory beside the records
/// themselves.
const AT_A_TIME: usize = 64;

/// Options of `jointwatch accumulate`.
#[derive(Args)]
pub(crate) struct Accumulate {
    /// The study: its study.toml, or the folder that holds it. Its training records set the
    /// filters and what the sums are normalised by.
    study: PathBuf,
    /// Logs to sum in place of the study's training records, with the channels that study.toml
    /// describes.
    #[arg(value_name = "RECORD")]
    records: Vec<PathBuf>,
    /// Where to write the sums.
    #[arg(short, long, value_name = "FILE", default_value = "part.acc")]
    output: PathBuf,
}

impl Accumulate {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("reading the study");
        let study = Study::read_whole(&self.study)?;
        console.check_outputs(&[&self.output], &study)?;
        let template = Template::of_study(&study)?;
        let plan = Plan::of(&study, &template)?;
        let part = if self.records.is_empty() {
            Part::of(&plan, &study)?
        } else {
            working.set_message("summing the records");
            of_files(&plan, &template, &self.records)?
        };
        working.finish_and_clear();
        output::write_whole(&self.output, &part.to_bytes()?)?;
        say(console, &part)?;
        console.say(format!("Sums written to {}.", self.output.display()))?;
        console.json(&as_json(&part, &self.output))
    }
}

/// The sums of log files, read side by side.
fn of_files(plan: &Plan, template: &Template, files: &[PathBuf]) -> Result<Part> {
    let mut whole: Option<Part> = None;
    for files in files.chunks(AT_A_TIME) {
        let parts = in_order(files.par_iter().map(|file| {
            let study = template.read(file)?;
            Part::of(plan, &study)
        }))?;
        for (part, file) in parts.into_iter().zip(files) {
            match &mut whole {
                None => whole = Some(part),
                Some(whole) => whole.merge(&part, &file.display().to_string())?,
            }
        }
    }
    whole.ok_or_else(|| Error::usage("no record was given; name at least one log"))
}

/// What a part holds, and whether it went beyond its plan.
pub(super) fn say(console: &Console, part: &Part) -> Result<()> {
    let filters = &part.plan().filters;
    let records = match part.records().len() {
        1 => "1 record".to_owned(),
        count => format!("{count} records"),
    };
    console.say(format!(
        "Sums of study '{}': {records}, {} rows{}.",
        part.plan().study,
        part.rows(),
        match filters.quasi_static {
            true => String::new(),
            false => format!(" at {}", sample_rate(filters.sample_rate_hz)),
        }
    ))?;
    let beyond = part.beyond();
    if beyond > 1.0 + 1e-9 {
        console.say(format!(
            "Note: the records reach {beyond:.2} times the range of the study's own training records."
        ))?;
    }
    Ok(())
}

/// The same for `--json`.
pub(super) fn as_json(part: &Part, output: &Path) -> serde_json::Value {
    serde_json::json!({
        "sums": output, "study": part.plan().study, "records": part.records(), "rows": part.rows(), "beyond": part.beyond(),
    })
}
