//! `jointwatch upload`: puts a signed model onto the device.

use crate::cli::console::Console;
use crate::device::signing::SignedModel;
use crate::device::telemetry::line::connect;
use crate::device::upload::{Patience, upload};
use crate::text::error::{Error, Result};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use jointwatch_shared::wire::telemetry::BAUD;
use std::io::IsTerminal;
use std::path::PathBuf;

/// Options of `jointwatch upload`.
#[derive(Args)]
pub(crate) struct Upload {
    /// The signed model that `sign` wrote.
    model: PathBuf,
    /// The serial port (/dev/ttyUSB0, COM3), or tcp:HOST:PORT or unix:PATH for an emulator's
    /// socket.
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Bits per second of a serial port; the default is what the firmware speaks.
    #[arg(long, value_name = "BAUD", default_value_t = BAUD)]
    baud: u32,
}

impl Upload {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let model = SignedModel::read(&self.model)?;
        let mut line = connect(&self.port, self.baud)?;
        let total = model.content().len() as u64;
        let bar = progress_bar(console, total);
        let done = upload(&mut line, &model, Patience::default(), |bytes| {
            bar.set_position(bytes.into())
        });
        bar.finish_and_clear();
        let done = done.map_err(|e| Error {
            sentence: format!("{}: {e}", self.model.display()),
            ..e
        })?;
        let slot = done
            .slot
            .map_or(String::new(), |slot| format!(" into slot {slot:?}"));
        console.say(format!(
            "Uploaded {} bytes{slot}; {} requests were sent again. The device has checked the model, restarts by itself within \
             about a second and runs it on trial for 10 s; if it restarts before that is over, or has not run for 10 s after a minute, it goes back to the old model.",
            done.bytes, done.repeated
        ))?;
        console.json(&done)
    }
}

fn progress_bar(console: &Console, total: u64) -> ProgressBar {
    if console.is_quiet() || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {bytes} of {total_bytes} ({elapsed})")
    {
        bar.set_style(style);
    }
    bar
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Words {
        #[command(flatten)]
        upload: Upload,
    }

    /// The firmware sets its divider from the same constant.
    #[test]
    fn without_a_rate_the_port_is_opened_at_that_of_the_firmware() {
        let parse = |words: &[&str]| Words::parse_from(words).upload.baud;
        let words = ["upload", "model.signed", "--port", "/dev/ttyUSB0"];
        assert_eq!(parse(&words), BAUD);
        assert_eq!(parse(&[&words[..], &["--baud", "57600"]].concat()), 57_600);
    }
}
