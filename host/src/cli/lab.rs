//! `jointwatch lab`: the local page for the whole loop.

use super::console::Console;
use crate::lab;
use crate::text::error::{Error, Result};
use clap::Args;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Options of `jointwatch lab`.
#[derive(Args)]
pub(crate) struct Lab {
    /// A study.toml or its folder, or logs of one folder that no study describes yet, and after it
    /// a model (.json) to begin with; the working folder when left out.
    #[arg(value_name = "STUDY|LOG… [MODEL]")]
    named: Vec<PathBuf>,
    /// The port on 127.0.0.1; any free one when left out.
    #[arg(long)]
    port: Option<u16>,
    /// Open the page in the browser.
    #[arg(long)]
    open: bool,
}

impl Lab {
    pub(super) fn run(mut self, console: &Console) -> Result<()> {
        let is_model = |path: &PathBuf| path.extension().is_some_and(|e| e == "json");
        let model = match self.named.len() {
            0 | 1 => None,
            _ => self.named.pop_if(|last| is_model(last)),
        };
        serve(console, self.named, model, self.port, self.open)
    }
}

/// Opens the lab and stays.
pub(super) fn serve(
    console: &Console,
    named: Vec<PathBuf>,
    model: Option<PathBuf>,
    port: Option<u16>,
    open: bool,
) -> Result<()> {
    let program = std::env::current_exe().map_err(|e| {
        Error::failed(format!(
            "this program cannot be found ({e}); install it anew"
        ))
    })?;
    let lab = lab::Lab {
        named,
        model,
        port,
        program,
    };
    let started = lab.start()?;
    console.say(format!(
        "The lab is open on this machine only:\n\n  {}\n\nIt works in {} and writes into jointwatch-lab there. Ctrl-C ends it.",
        started.url,
        started.folder.display()
    ))?;
    console.json(&serde_json::json!({ "url": started.url, "folder": started.folder }))?;
    if open {
        open_browser(&started.url)?;
    }
    started.serve()
}

/// Shows a page in the user's browser.
fn open_browser(url: &str) -> Result<()> {
    let (program, first): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("rundll32", &["url.dll,FileProtocolHandler"]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(first).arg(url);
    let silent = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    silent.spawn().map(drop).map_err(|e| {
        Error::failed(format!(
            "{program} could not be started ({e}); leave --open out and open the address yourself"
        ))
    })
}
