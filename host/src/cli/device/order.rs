//! `jointwatch order`: what a device does only when its owner signs for it.

use super::sign::Signer;
use crate::cli::console::Console;
use crate::device::order::give;
use crate::device::telemetry::line::connect;
use crate::text::error::{Error, Result};
use clap::{Args, ValueEnum};
use jointwatch_shared::wire::slot;
use jointwatch_shared::wire::telemetry::BAUD;

/// Options of `jointwatch order`.
#[derive(Args)]
pub(crate) struct Order {
    /// What the device is to do.
    order: What,
    /// The serial port, or tcp:HOST:PORT or unix:PATH for an emulator's socket.
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Bits per second of a serial port; the default is what the firmware speaks.
    #[arg(long, value_name = "BAUD", default_value_t = BAUD)]
    baud: u32,
    #[command(flatten)]
    signer: Signer,
}

/// What a device can be ordered to do.
#[derive(Clone, Copy, ValueEnum)]
enum What {
    /// Restart the device.
    Restart,
    /// Go back to the model before the one that runs.
    RollBack,
    /// The alarm that stands has been seen.
    Acknowledge,
    /// Trust only the key that signs this, and no longer the other one.
    RevokeOther,
}

impl Order {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let key = self.signer.key()?;
        let (order, done) = match self.order {
            What::Restart => (slot::Order::Restart, "The device restarts within a second."),
            What::RollBack => (
                slot::Order::RollBack,
                "The device restarts within a second, with the model before this one.",
            ),
            What::Acknowledge => (slot::Order::Acknowledge, "The alarm is acknowledged."),
            What::RevokeOther => (
                slot::Order::RevokeOther,
                "The device trusts only this key from now on.",
            ),
        };
        let mut line = connect(&self.port, self.baud)?;
        give(&mut line, order, &key).map_err(|e| Error {
            sentence: format!("{}: {e}", self.port),
            ..e
        })?;
        console.say(done)?;
        console.json(&serde_json::json!({ "done": order }))
    }
}
