//! `jointwatch sign`: makes of a blob, and the rig block that goes with it, what a device takes.

use crate::cli::console::Console;
use crate::device::rig_block;
use crate::device::signing::{PrivateKey, SignedModel, Stamp};
use crate::text::date;
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::output;
use clap::Args;
use jointwatch_shared::wire::slot::CLASS_LEN;
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
    /// The number of this release, larger than that of what runs on the device; the time in
    /// seconds when left out.
    #[arg(long, value_name = "N")]
    release: Option<u32>,
    /// The class of devices that the firmware was built for with JOINTWATCH_DEVICE_CLASS.
    #[arg(long, value_name = "NAME", value_parser = class)]
    class: Option<[u8; CLASS_LEN]>,
    /// Where to write the signed model.
    #[arg(short, long, value_name = "FILE", default_value = "model.signed")]
    output: PathBuf,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
pub(super) struct Signer {
    /// The private key that `keygen` wrote.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Sign with the key that everybody knows, for firmware that was built without one of your
    /// own.
    #[arg(long)]
    development_key: bool,
}

impl Signer {
    /// The private key: that of the file, or the development key.
    pub(super) fn key(&self) -> Result<PrivateKey> {
        match &self.key {
            Some(path) => PrivateKey::read(path),
            None => Ok(PrivateKey::development()),
        }
    }
}

/// The name of a class, and zeros behind it.
fn class(name: &str) -> std::result::Result<[u8; CLASS_LEN], String> {
    let mut bytes = [0; CLASS_LEN];
    match bytes.get_mut(..name.len()) {
        Some(place) if name.bytes().all(|byte| byte.is_ascii_graphic()) => {
            place.copy_from_slice(name.as_bytes());
            Ok(bytes)
        }
        _ => Err(format!(
            "a name of at most {CLASS_LEN} letters, digits and signs without spaces is wanted"
        )),
    }
}

impl Sign {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let key = self.signer.key()?;
        let stamp = Stamp {
            release: match self.release {
                Some(release) => release,
                // Until the year 2106.
                None => date::moment()?.map_or(1, |now| now.min(u32::MAX.into()) as u32),
            },
            class: self.class.unwrap_or_default(),
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
        let signed = SignedModel::sign(&model, &rig, &key, &stamp).map_err(|e| {
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
            "Signed model written to {}, release {}, with {with}.",
            self.output.display(),
            stamp.release
        ))?;
        console.json(&serde_json::json!({
            "signed": self.output, "rig_bytes": signed.rig_len(), "release": stamp.release, "development_key": self.signer.development_key,
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
