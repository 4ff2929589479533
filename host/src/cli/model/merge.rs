//! `jointwatch merge`: add up parts that `accumulate` wrote, in any order.

use super::accumulate::{as_json, say};
use crate::cli::console::Console;
use crate::fit::sums::Part;
use crate::text::error::{Error, Result};
use crate::text::{input, output};
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `jointwatch merge`.
#[derive(Args)]
pub(crate) struct Merge {
    /// Files that `accumulate` or `merge` wrote.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Where to write the sums of all of them.
    #[arg(short, long, value_name = "FILE", default_value = "all.acc")]
    output: PathBuf,
}

impl Merge {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        output::check(&self.output)?;
        let working = console.working("merging");
        let mut whole = read(&self.parts[0])?;
        for path in &self.parts[1..] {
            whole.merge(&read(path)?, &path.display().to_string())?;
        }
        working.finish_and_clear();
        output::write_whole(&self.output, &whole.to_bytes()?)?;
        say(console, &whole)?;
        console.say(format!("Sums written to {}.", self.output.display()))?;
        console.json(&as_json(&whole, &self.output))
    }
}

pub(super) fn read(path: &Path) -> Result<Part> {
    let called = path.display().to_string();
    let bytes = input::read(path).map_err(|e| {
        Error::data(format!(
            "{called}: could not be read ({e}); give a file that `jointwatch accumulate` wrote"
        ))
    })?;
    Part::of_bytes(&called, &bytes)
}
