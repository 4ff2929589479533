//! `jointwatch capture`: fetches the counts that a device keeps around its alarm.

use crate::cli::console::Console;
use crate::device::capture::fetch;
use crate::device::telemetry::line::connect;
use crate::text::error::{Error, Result};
use crate::text::output;
use clap::Args;
use jointwatch_shared::wire::telemetry::BAUD;
use std::path::PathBuf;

/// Options of `jointwatch capture`.
#[derive(Args)]
pub(crate) struct Capture {
    /// The serial port, or tcp:HOST:PORT or unix:PATH for an emulator's socket.
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Bits per second of a serial port; the default is what the firmware speaks.
    #[arg(long, value_name = "BAUD", default_value_t = BAUD)]
    baud: u32,
    /// The file of frames to write, for `study-from`.
    #[arg(short, long, value_name = "FILE", default_value = "capture.bin")]
    output: PathBuf,
}

impl Capture {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        output::check(&self.output)?;
        let mut line = connect(&self.port, self.baud)?;
        let working = console.working("fetching the counts around the alarm");
        let fetched = fetch(&mut line, |piece, pieces| {
            working.set_message(format!("piece {piece} of {pieces}"));
        })
        .map_err(|e| Error {
            sentence: format!("{}: {e}", self.port),
            ..e
        })?;
        working.finish_and_clear();
        output::write_whole(&self.output, &fetched.frames)?;
        let file = self.output.display();
        console.say(format!(
            "{} pieces of the counts around the alarm at sample {} written to {file}.\n\
             Next: jointwatch study-from {file} --rig RIG -o DIR",
            fetched.pieces, fetched.alarm
        ))?;
        console.json(&fetched)
    }
}
