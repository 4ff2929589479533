//! `jointwatch simulate`: a rig with a nonlinear joint, logged as a real one would be.

use crate::cli::console::Console;
use crate::simulate::{self, Hide, RigParameters, SimulationOptions};
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch simulate`.
#[derive(Args)]
pub(crate) struct Simulate {
    /// The folder to make; it must not exist yet, or be empty.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Axes: 2 for translation and rotation with their coupling, 1 for translation alone.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    axes: u8,
    /// Signal-to-noise ratio of accelerometers, force and torque, dB; "none" for noiseless ones.
    #[arg(long, value_name = "DB", default_value = "60", value_parser = decibels)]
    snr_db: Decibels,
    /// Seed of the drives and the noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Draw the rig's masses, stiffnesses, clearances and coupling around the documented ones, by
    /// this seed.
    #[arg(long, value_name = "N")]
    vary: Option<u64>,
    /// Length of each record, s.
    #[arg(long, value_name = "S", default_value_t = SimulationOptions::default().duration_s)]
    duration: f64,
    /// An effect that the rig has and its study does not list, e.g. jenkins@x; the axes are x and
    /// phi.
    #[arg(long, value_name = "EFFECT@AXIS")]
    hidden: Option<String>,
    /// RMS of the hidden effect's force over RMS of the restoring force.
    #[arg(long, value_name = "S", default_value_t = SHARE, requires = "hidden")]
    share: f64,
}

/// The share of a hidden effect when nothing is said of it.
const SHARE: f64 = 0.1;

/// A signal-to-noise ratio, or none at all.
#[derive(Clone, Copy)]
struct Decibels(Option<f64>);

fn decibels(text: &str) -> std::result::Result<Decibels, String> {
    if text == "none" {
        return Ok(Decibels(None));
    }
    match text.parse::<f64>() {
        Ok(value) if (-20.0..=200.0).contains(&value) => Ok(Decibels(Some(value))),
        _ => Err("a number of dB from -20 to 200, or none".into()),
    }
}

impl Simulate {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let options = SimulationOptions {
            rig: self
                .vary
                .map_or_else(RigParameters::default, RigParameters::draw),
            axes: self.axes.into(),
            snr_db: self.snr_db.0,
            seed: self.seed,
            duration_s: self.duration,
            hidden: self.hidden.map(|effect| Hide {
                effect,
                share: self.share,
            }),
            ..SimulationOptions::default()
        };
        let working = console.working("simulating the rig");
        let simulation = simulate::write_study(&self.out, &options)?;
        working.finish_and_clear();
        let study = &simulation.study;
        let [low, high] = options.band_hz;
        let noise = match options.snr_db {
            Some(snr) => format!("sensor noise {snr} dB below the signals"),
            None => "no sensor noise".into(),
        };
        console.say(format!(
            "Simulated '{}': {} records of {} rows at {} Hz, driven at random from {low} to {high} Hz, {noise}, seed {}.\n\
             The study is in {}; what was hidden in it is in {}.",
            study.name,
            study.records.len(),
            study.records.first().map_or(0, |r| r.rows),
            study.sample_rate_hz,
            options.seed,
            self.out.join("study.toml").display(),
            self.out.join("truth").display()
        ))?;
        if let Some(hidden) = &simulation.hidden {
            console.say(format!(
                "Hidden in it is {}, {:.1} % of the RMS force; the study's base does not list it.",
                hidden.term.name(),
                100.0 * hidden.share
            ))?;
        }
        let records: Vec<_> = study
            .records
            .iter()
            .map(|r| serde_json::json!({ "file": r.file, "role": r.role, "rows": r.rows }))
            .collect();
        console.json(&serde_json::json!({
            "study": self.out.join("study.toml"),
            "seed": options.seed,
            "sample_rate_hz": study.sample_rate_hz,
            "records": records,
        }))
    }
}
