//! `jointwatch keygen`: a pair of keys, one to sign models with, one to build into the firmware.

use crate::cli::console::Console;
use crate::device::signing::PrivateKey;
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch keygen`.
#[derive(Args)]
pub(crate) struct Keygen {
    /// Where to write the private key; the public one goes beside it, with .pub behind its name.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl Keygen {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let public = PrivateKey::generate()?.write_new(&self.output)?;
        console.say(format!(
            "Private key written to {}: keep it to yourself, whoever has it can put a model onto your devices.\n\
             Public key written to {}: build the firmware with JOINTWATCH_PUBLIC_KEY={}.",
            self.output.display(),
            public.display(),
            std::path::absolute(&public).unwrap_or_else(|_| public.clone()).display()
        ))?;
        console.json(&serde_json::json!({ "private_key": self.output, "public_key": public }))
    }
}
