//! What the shell and the editor want to know: completions, man pages, and the keys of study.toml.

use super::console::Console;
use crate::text::error::{Error, Result};
use crate::text::output;
use clap::{Args, Command};
use clap_complete::Shell;
use std::path::PathBuf;

/// Options of `jointwatch completions`.
#[derive(Args)]
pub(crate) struct Completions {
    /// The shell to write them for.
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self, console: &Console, mut whole: Command) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut whole, "jointwatch", &mut script);
        console.say(String::from_utf8_lossy(&script).trim_end())
    }
}

/// Options of `jointwatch manual`.
#[derive(Args)]
pub(crate) struct Manual {
    /// The folder to write jointwatch.1 and a page for each command to.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

impl Manual {
    pub(super) fn run(self, console: &Console, whole: Command) -> Result<()> {
        let failed = |e: std::io::Error| {
            Error::failed(format!(
                "{}: the pages could not be written ({e}); name a folder that you may write to",
                self.output.display()
            ))
        };
        std::fs::create_dir_all(&self.output).map_err(failed)?;
        let mut pages = vec![(whole.clone(), "jointwatch".to_owned())];
        for command in whole.get_subcommands() {
            let name = format!("jointwatch-{}", command.get_name());
            pages.push((command.clone().display_name(name.clone()), name));
        }
        for (command, name) in &pages {
            let mut page = Vec::new();
            clap_mangen::Man::new(command.clone())
                .title(name.as_str())
                .render(&mut page)
                .map_err(failed)?;
            output::write_whole(&self.output.join(format!("{name}.1")), &page)?;
        }
        console.say(format!(
            "{} pages written to {}; read one with man {}/jointwatch.1",
            pages.len(),
            self.output.display(),
            self.output.display()
        ))
    }
}

/// Options of `jointwatch study`.
#[derive(Args)]
pub(crate) struct StudyKeys {
    /// Print a JSON Schema, with which editors complete and check study.toml.
    #[arg(long)]
    schema: bool,
}

impl StudyKeys {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        if self.schema {
            return console.say(SCHEMA.trim_end());
        }
        console.say(keys()?)
    }
}

/// The schema of study.toml.
const SCHEMA: &str = include_str!("study_schema.json");

/// Every key of study.toml with what it means, table by table.
fn keys() -> Result<String> {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA)
        .map_err(|e| Error::failed(format!("the schema of study.toml is damaged ({e})")))?;
    let mut text = String::from("study.toml describes a rig and its logs.");
    let list = |text: &mut String, heading: &str, table: &serde_json::Value| {
        text.push_str(&format!("\n\n{heading}\n"));
        let needed = |key: &str| {
            let required = table["required"].as_array();
            required.is_some_and(|all| all.iter().any(|k| k == key))
        };
        let keys = table["properties"].as_object().into_iter().flatten();
        for (key, about) in keys.filter(|(_, about)| !about["description"].is_null()) {
            let must = if needed(key) { " (needed)" } else { "" };
            let words = about["description"].as_str().unwrap_or_default();
            text.push_str(&format!("  {key}{must}\n      {words}\n"));
        }
        text.truncate(text.trim_end().len());
    };
    list(&mut text, "At the top:", &schema);
    let definitions = &schema["$defs"];
    for (heading, name) in [
        ("time = { … }:", "time"),
        ("[[axis]], one or two:", "axis"),
        (
            "A channel is a column's name, or a table { … }; SI = (number · scale + offset) · unit:",
            "channel",
        ),
        ("[[record]], one for each log:", "record"),
        ("[[clock]], one for each second logger of a run:", "clock"),
        ("[base]:", "base"),
    ] {
        list(&mut text, heading, &definitions[name]);
    }
    Ok(text)
}
