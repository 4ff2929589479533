//! `jointwatch demo`: the whole story on a simulated rig, in a folder that the user can go on with.

use super::Console;
use super::compare::Compare;
use super::export::Export;
use super::identify::Identify;
use super::replay::Replay;
use super::simulate::{Decibels, Simulate};
use crate::device::{self, Board};
use crate::error::{Error, Result};
use crate::export;
use crate::sim::SimulationOptions;
use clap::Args;
use jointwatch_shared::selftest;
use std::path::{Path, PathBuf};

/// Points at which the emulated device and the host evaluate the model, besides the corners of its range.
const POINTS: u32 = 100_000;

/// The slot that the blob is loaded into, as the firmware calls it.
const SLOT: &str = "a";

/// Options of `jointwatch demo`.
#[derive(Args)]
pub(crate) struct Demo {
    /// The folder to make; jointwatch-demo, or the first free jointwatch-demo-2, -3, … when left out.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of the simulated rig's drives and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl Demo {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        let out = self.out.unwrap_or_else(first_free_folder);
        let step = console.inner();
        let file = |name: &str| out.join(name);
        let (study, model, blob) = (file("study.toml"), file("model.json"), file("model.bin"));

        console.say("1. A rig with a joint nobody has the equation of (simulated: clearance on both axes, and coupling)\n")?;
        let simulate = Simulate {
            out: out.clone(),
            axes: 2,
            snr_db: Decibels(Some(60.0)),
            seed: self.seed,
            vary: None,
            duration: SimulationOptions::default().duration_s,
        };
        simulate.run(&step)?;

        console.say("\n2. Learn its restoring force from the three training records: a polynomial of 256 terms per axis\n")?;
        Identify::polynomial(study.clone(), model.clone()).run(&step)?;

        console.say("\n3. Compare the model with measurements, and see where it fails\n")?;
        let writes = step.writing_json_to(file("comparison.json"));
        Compare {
            study: study.clone(),
            model: model.clone(),
        }
        .run(&writes)?;

        console.say("\n4. Export it for the microcontroller: fixed-size, integers only\n")?;
        Export {
            model,
            output: blob.clone(),
            budget: None,
        }
        .run(&step)?;

        console.say("\n5. Replay: what the device would say about the validation record, from raw counts on\n")?;
        let replay = Replay {
            blob: blob.clone(),
            study,
            record: Some("valid.csv".into()),
            output: None,
            frames: None,
        };
        replay.run(&step.writing_json_to(file("replay.json")))?;

        console.say("\n6. The firmware's own evaluation, on an emulated Cortex-M4F\n")?;
        let emulated = emulate(console, &blob)?;
        console.say(&emulated)?;

        console.say(format!(
            "\nAll of it is in {}. Go on with:\n  jointwatch inspect {}\n  jointwatch compare {} {}\n  \
             jointwatch identify {} --model polynomial --fit select -o {}",
            out.display(),
            file("model.bin").display(),
            file("study.toml").display(),
            file("model.json").display(),
            file("study.toml").display(),
            file("few-terms.json").display()
        ))?;
        console.json(&serde_json::json!({ "folder": out, "emulated": emulated }))
    }
}

/// Runs the self-test image with the blob in its flash slot, and holds its digest against the host's.
///
/// A missing emulator or device toolchain is a reason to leave the step out and say so; a digest that differs is a
/// failure.
fn emulate(console: &Console, blob: &Path) -> Result<String> {
    let working = console.working("building the firmware and running it in QEMU");
    let image = match device::require_qemu().and_then(|_| device::selftest(Board::Stm32f405)) {
        Ok(image) => image,
        Err(e) => return Ok(format!("Left out: {e}.")),
    };
    let report = device::run_selftest(Board::Stm32f405, &image, Some(blob), POINTS)?;
    working.finish_and_clear();
    let model = export::read_blob(blob)?;
    let Some(seen) = report.model(SLOT) else {
        return Err(Error::failed(format!(
            "the firmware did not evaluate the model in its flash slot; it said: {}",
            report.complaints.join("; ")
        )));
    };
    let wanted = selftest::digest(&model, seen.seed, seen.points);
    if seen.digest != wanted {
        return Err(Error::failed(format!(
            "the emulated device computed other bits than the host: digest {:016x} where the host has {wanted:016x}",
            seen.digest
        )));
    }
    let counted = seen.instructions.map_or(String::new(), |counted| {
        format!(
            " One evaluation takes {} instructions, whatever the input.",
            counted.most
        )
    });
    Ok(format!(
        "The firmware found the model in flash slot A and evaluated it at {} points: digest {wanted:016x}, the same bits \
         as the host.{counted}",
        seen.points + selftest::CORNER_POINTS
    ))
}

/// A name that is still free, so that the demo can be run again.
fn first_free_folder() -> PathBuf {
    let taken = |path: &Path| path.exists();
    let first = PathBuf::from("jointwatch-demo");
    if !taken(&first) {
        return first;
    }
    (2_u32..)
        .map(|n| PathBuf::from(format!("jointwatch-demo-{n}")))
        .find(|path| !taken(path))
        .unwrap_or(first)
}
