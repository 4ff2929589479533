//! `jointwatch study-from`: what a device sent becomes records and a study.

use crate::cli::console::Console;
use crate::device::{export, rig_block, study_from};
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::table::Table;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch study-from`.
#[derive(Args)]
pub(crate) struct StudyFrom {
    /// What a device sent: frames that `capture` or `replay --frames` wrote, or that were recorded
    /// from its line.
    frames: PathBuf,
    /// The rig block that the device runs with.
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// The blob that it runs with, when that corrects force channels: the records then hold them
    /// as measured.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The folder to make; it must not exist yet, or be empty.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

impl StudyFrom {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let bytes = input::read(&self.frames).map_err(|e| {
            Error::data(format!(
                "{} cannot be read ({e}); name a file of what a device sent",
                self.frames.display()
            ))
        })?;
        let rig = rig_block::read(&self.rig)?;
        let model = self.model.as_deref().map(export::read_blob).transpose()?;
        let frames = (self.frames.as_path(), bytes.as_slice());
        let written = study_from::write(frames, &rig, model.as_ref(), &self.output)?;
        let mut table = Table::new(&["record", "rows", "gaps", "rows missing", "in study.toml"]);
        for record in &written.records {
            table.row(vec![
                record.file.clone(),
                record.rows.to_string(),
                record.gaps.to_string(),
                record.missing.to_string(),
                if record.in_study { "yes" } else { "no" }.into(),
            ]);
        }
        console.say(table.to_string())?;
        console.say_notes(&written.notes)?;
        let study = self.output.join("study.toml");
        console.say(format!(
            "The study is in {} ({} Hz).\nNext: jointwatch changed MODEL.json {0}, or jointwatch identify {0} --model physical",
            study.display(),
            written.sample_rate_hz
        ))?;
        console.json(&written)
    }
}
