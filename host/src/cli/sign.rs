//! `jointwatch sign`: makes of a blob, and the rig block that goes with it, what a device takes.

use super::console::Console;
use crate::device::rig_block;
use crate::device::signing::{PrivateKey, SignedModel};
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::output;
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `jointwatch sign`.
#[derive(Args)]
pub(crate) struct Sign {
    /// The blob that `export` wrote.
    model: PathBuf,
    /// The rig block that goes with it; without one the device reports raw counts only.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    signer: Signer,
    /// Where to write the signed model.
    #[arg(short, long, value_name = "FILE", default_value = "model.signed")]
    output: PathBuf,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
struct Signer {
    /// The private key that `keygen` wrote.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Sign with the key that everybody knows, for firmware that was built without one of your own.
    #[arg(long)]
    development_key: bool,
}

impl Sign {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let key = match &self.signer.key {
            Some(path) => PrivateKey::read(path)?,
            None => PrivateKey::development(),
        };
        let model = read(&self.model)?;
        let rig = self
            .rig
            .as_deref()
            .map(read)
            .transpose()?
            .unwrap_or_default();
        if let Some(path) = &self.rig {
            rig_block::check_pair(&model, &rig).map_err(|e| Error {
                sentence: format!("{}: {e}", path.display()),
                ..e
            })?;
        }
        let signed = SignedModel::sign(&model, &rig, &key).map_err(|e| {
            let at_fault = if e.sentence.starts_with("the rig") {
                self.rig.as_ref()
            } else {
                None
            };
            Error {
                sentence: format!("{}: {e}", at_fault.unwrap_or(&self.model).display()),
                ..e
            }
        })?;
        output::write_whole(&self.output, &signed.to_bytes())?;
        let with = if self.signer.development_key {
            "the development key, which everybody knows: only firmware built without a key of its own takes it"
        } else {
            "your key"
        };
        console.say(format!(
            "Signed model written to {}, with {with}.",
            self.output.display()
        ))?;
        console.json(&serde_json::json!({
            "signed": self.output, "rig_bytes": signed.rig_len(), "development_key": self.signer.development_key,
        }))
    }
}

fn read(path: &Path) -> Result<Vec<u8>> {
    input::read(path).map_err(|e| {
        Error::data(format!(
            "{}: could not be read ({e}); give a file that `jointwatch export` wrote",
            path.display()
        ))
    })
}
