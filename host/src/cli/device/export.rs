//! `jointwatch export`: from a model to the blob that the device evaluates.

use super::watched;
use crate::cli::console::Console;
use crate::device::monitor_limits::BoardError;
use crate::device::{export, followed, rig_block};
use crate::model::file::ModelFile;
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use crate::text::output;
use crate::text::table::Table;
use clap::Args;
use jointwatch_shared::base::Model;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Mean time between false alarms of the monitor unless another one is asked for.
const FALSE_ALARM_DAYS: u32 = 30;

/// Options of `jointwatch export`.
#[derive(Args)]
pub(crate) struct Export {
    /// The model that `identify` wrote.
    pub(super) model: PathBuf,
    /// Where to write the blob (default: model.bin), or with --rig the rig block (default:
    /// rig.bin).
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Write the rig block instead, which the device needs besides the model: from a rig.toml that
    /// says how the sensors are wired (docs/reference/rig-block.md), or `defaults` for the
    /// emulated rig of --study.
    #[arg(long, value_name = "FILE|defaults")]
    pub(super) rig: Option<PathBuf>,
    /// With --rig: the study from whose validation records the monitor's limits are set (left out,
    /// the block has none, and the device does not judge the joint), and with `defaults` what
    /// the sensors of the emulated rig are set to.
    #[arg(long, value_name = "FILE")]
    pub(super) study: Option<PathBuf>,
    /// With --rig and --study: mean time between the monitor's false alarms for which the limits
    /// are set, in days (default: 30).
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u32).range(1..=36_500), requires_all = ["rig", "study"])]
    pub(super) false_alarm_days: Option<u32>,
    /// With --rig and --study: by how much gain and stiffness may drift on a healthy joint without
    /// an alarm, such as 2% (default: 0%).
    #[arg(long, value_name = "PERCENT", value_parser = drift, requires_all = ["rig", "study"])]
    pub(super) drift: Option<f64>,
    /// The largest error that fixed point may cost, as a part of each axis's RMS training force
    /// (default: 1e-5 for a polynomial, 1e-3 for a network).
    #[arg(long, value_name = "PART")]
    pub(super) budget: Option<f64>,
}

/// The largest drift that limits are set for: beyond it a tenth of the force, which they are tuned
/// to, would hardly show.
const MAX_DRIFT_PERCENT: f64 = 8.0;

/// A drift in percent, with or without its sign, as a part.
pub(super) fn drift(text: &str) -> std::result::Result<f64, String> {
    match text.strip_suffix('%').unwrap_or(text).trim().parse() {
        Ok(percent) if (0.0..=MAX_DRIFT_PERCENT).contains(&percent) => Ok(percent / 100.0),
        _ => Err(format!("a drift from 0% to {MAX_DRIFT_PERCENT}% is wanted")),
    }
}

impl Export {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        if let Some(budget) = self.budget.filter(|part| part.is_nan() || *part <= 0.0) {
            return Err(Error::usage(format!(
                "--budget {budget} has to be above zero"
            )));
        }
        let file = ModelFile::read(&self.model)?;
        let exported = export::export(&file, self.budget).map_err(|e| Error {
            sentence: format!("{}: {e}", self.model.display()),
            ..e
        })?;
        if let Some(rig) = &self.rig {
            return self.write_rig(rig, &exported.model, console);
        }
        if self.study.is_some() {
            return Err(Error::usage(
                "--study goes with --rig; leave it out to export the model",
            ));
        }
        let path = self.output.unwrap_or_else(|| "model.bin".into());
        output::write_whole(&path, &exported.blob)?;
        let mut table = Table::new(&[
            "axis",
            "force unit",
            "largest error seen",
            "proven bound",
            "bound / RMS force",
        ]);
        for (axis, learnt) in exported.axes.iter().zip(&file.axes) {
            let unit = learnt.kind.force_unit();
            table.row(vec![
                axis.axis.clone(),
                format!("{:.3e} {unit}", axis.force_per_lsb),
                format!("{:.2e} {unit}", axis.largest_error),
                format!("{:.2e} {unit}", axis.error_bound),
                format!("{:.1e}", axis.bound_relative),
            ]);
        }
        console.say(format!(
            "Blob of {} bytes written to {}.\nWhat fixed point costs against f64, over the whole training range:\n{table}",
            exported.blob.len(),
            path.display()
        ))?;
        console.json(&exported.as_json(Some(&path)))
    }
    fn write_rig(&self, rig: &Path, model: &Model, console: &Console) -> Result<()> {
        let names = followed::names(model);
        let study = self
            .study
            .as_ref()
            .map(|path| Study::read_following(path, &names));
        let study = study.transpose()?;
        let mut block = match (rig.as_os_str() == "defaults", &study) {
            (true, Some(study)) => rig_block::of_study(study, model)?,
            (true, None) => {
                return Err(Error::usage(
                    "--rig defaults needs --study: the ranges of its records say what the emulated sensors are set to",
                ));
            }
            (false, _) => rig_block::of_file(rig, model)?,
        };
        // An emulated rig needs the study for its sensors, whether it has records for the monitor
        // or not.
        let asked = self.false_alarm_days.is_some() || self.drift.is_some();
        let judged = asked || rig.as_os_str() != "defaults";
        let mut said = String::new();
        if let Some(study) = &study
            && (judged || study.records.iter().any(|r| r.role == Role::Validate))
        {
            let days = self.false_alarm_days.unwrap_or(FALSE_ALARM_DAYS);
            let drift = self.drift.unwrap_or(0.0);
            let set = rig_block::set_limits(&mut block, study, model, days, drift)?;
            let block_s = f64::from(set.limits.block) / study.sample_rate_hz;
            let names: Vec<&str> = study.axes.iter().map(|axis| axis.name.as_str()).collect();
            said = format!(
                "What the monitor finds:{}",
                watched::detected(&names, &set.healthy, block_s)
            );
            for doubt in set.board.iter().filter_map(BoardError::doubt) {
                let _ = write!(said, "\nWarning: {doubt}.");
            }
        }
        let path = self.output.clone().unwrap_or_else(|| "rig.bin".into());
        let bytes = rig_block::encode(&block)?;
        output::write_whole(&path, &bytes)?;
        console.say(format!(
            "Rig block of {} bytes written to {}.\n{}",
            bytes.len(),
            path.display(),
            rig_block::in_words(&block)
        ))?;
        if !said.is_empty() {
            console.say(said)?;
        }
        if block.limits.is_none() {
            console.say(
                "The monitor has no limits in it, so the device will not judge the joint; give --study with validation records.",
            )?;
        }
        console.json(&rig_block::as_json(&block))
    }
}
