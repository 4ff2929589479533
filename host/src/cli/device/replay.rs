//! `jointwatch replay`: what the device would say about a logged record, bit for bit.

use super::export::drift;
use super::watched::{self, Basis, FailOn};
use crate::assess::compare::relative_to_applied;
use crate::cli::console::Console;
use crate::device::monitor_limits::{self, Purpose};
use crate::device::replay::{self, RecordReplay, Replayed};
use crate::device::rig_block;
use crate::device::telemetry::frames;
use crate::device::{export, followed};
use crate::fit::errors::AT_REST_BELOW;
use crate::study::{Record, Study};
use crate::text::error::{Error, Result};
use crate::text::output;
use crate::text::table::{Table, percent, rounded};
use clap::Args;
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::Cause;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::Rig;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Options of `jointwatch replay`.
#[derive(Args)]
pub(crate) struct Replay {
    /// The blob that `export` wrote.
    pub(super) blob: PathBuf,
    /// The study whose records to run: its study.toml, or the folder that holds it.
    pub(super) study: PathBuf,
    /// Only this record, as study.toml names it; all of them when left out.
    #[arg(long, value_name = "FILE")]
    pub(super) record: Option<String>,
    /// The rig block that `export --rig` wrote: read the records through its sensors, as `emulate`
    /// does, rather than through converters that are set to what the records reach.
    #[arg(long, value_name = "FILE")]
    pub(super) rig: Option<PathBuf>,
    /// Write every output of the chain (raw 32-bit numbers and SI values) as CSV; needs --record
    /// in a study of several.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Say what the monitor would have said over each record, with the limits of --rig, or else
    /// with limits set from the study's validation records.
    #[arg(long)]
    pub(super) monitor: bool,
    /// Mean time between the monitor's false alarms, in days.
    #[arg(long, value_name = "DAYS", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=36_500), requires = "monitor", conflicts_with = "rig")]
    pub(super) false_alarm_days: u32,
    /// By how much gain and stiffness may drift on a healthy joint without an alarm, such as 2%.
    #[arg(long, value_name = "PERCENT", value_parser = drift, default_value = "0%", requires = "monitor", conflicts_with = "rig")]
    pub(super) drift: f64,
    /// Exit with code 4 when the monitor raised an alarm, or was suspicious, over any record.
    #[arg(long, value_name = "STATE", requires = "monitor")]
    pub(super) fail_on: Option<FailOn>,
    /// Write the frames that the device would send, streaming every sample, for `jointwatch
    /// monitor`, the residual around an alarm among them; needs --record in a study of
    /// several.
    #[arg(long, value_name = "FILE")]
    pub(super) frames: Option<PathBuf>,
}

impl Replay {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("replaying");
        let model = export::read_blob(&self.blob)?;
        let study = Study::read_whole_following(&self.study, &followed::names(&model))?;
        let records = chosen(&study, self.record.as_deref())?;
        let block = match &self.rig {
            Some(path) => Some((path, rig_block::read(path)?)),
            None => None,
        };
        let set_up = match &block {
            None => replay::SetUp::new(&study, &model)?,
            Some((_, block)) => replay::SetUp::of_block(&study, &model, block)?,
        };
        let replayed = records
            .iter()
            .map(|record| set_up.replay(&study, record, &model));
        let replayed: Vec<Replayed> = replayed.collect::<Result<_>>()?;
        let board = block.as_ref().map(|(path, block)| (path.as_path(), block));
        let basis = self.basis(&study, &set_up, &model, board)?;
        let watched = basis.map(|basis| watched::watch(&study, &records, &set_up, &model, basis));
        let watched = watched.transpose()?;
        working.finish_and_clear();
        let only = |option: &str| match (records.as_slice(), replayed.as_slice()) {
            ([record], [replayed]) => Ok((*record, replayed)),
            _ => Err(Error::usage(format!(
                "{option} writes one record, and this study has {}; name one with --record",
                replayed.len()
            ))),
        };
        if let Some(path) = &self.output {
            let (_, replayed) = only("--output")?;
            output::write_whole(path, as_csv(replayed, &study, &model).as_bytes())?;
        }
        if let Some(path) = &self.frames {
            let (record, _) = only("--frames")?;
            let limits = watched.as_ref().map(|w| Ok(w.limits()));
            let limits = limits.unwrap_or_else(|| match &block {
                Some((_, block)) => rig_block::usable_limits(block, &model),
                None => Err(Cause::NoLimits),
            });
            let monitor = match limits {
                Ok(limits) => Ok(watched::monitor(&study, &set_up, limits)?),
                Err(cause) => Err(cause),
            };
            let monitor = monitor.as_ref().map_err(|cause| *cause);
            let rig_crc = match &block {
                Some((_, block)) => rig_block::checksum(block)?,
                None => 0,
            };
            let bytes = frames::of(&set_up, record, &model, monitor, rig_crc);
            output::write_whole(path, &bytes)?;
        }
        let summaries: Vec<RecordReplay> = replayed.into_iter().map(|r| r.summary).collect();
        let logged = |r: &Record| r.axes.iter().any(|axis| axis.velocity.is_some());
        if study.records.iter().any(logged) {
            console.say(
                "Note: the logs hold a velocity; the device has no such sensor and derives its own from the displacement.",
            )?;
        }
        console.say(in_words(&summaries, &study, set_up.delays_s(&study)))?;
        if let Some(path) = &self.output {
            console.say(format!("Outputs written to {}.", path.display()))?;
        }
        if let Some(path) = &self.frames {
            console.say(format!("Frames written to {}.", path.display()))?;
        }
        let Some(watched) = watched else {
            return console.json(&serde_json::json!({ "records": summaries }));
        };
        console.say(watched.in_words(&study))?;
        console.json(
            &serde_json::json!({ "records": summaries, "monitor": watched.as_json(&study) }),
        )?;
        match self.fail_on {
            Some(fail_on) => watched.fail_on(fail_on),
            None => Ok(()),
        }
    }

    /// What the monitor judges by, where it is asked for.
    fn basis(
        &self,
        study: &Study,
        set_up: &replay::SetUp,
        model: &Model,
        board: Option<(&Path, &Rig)>,
    ) -> Result<Option<Basis>> {
        if !self.monitor {
            return Ok(None);
        }
        if let Some((path, block)) = board {
            let limits = rig_block::limits_for(path, block, model)?;
            return Ok(Some(Basis::Board(limits.clone())));
        }
        let purpose = Purpose {
            model_checksum: blob::checksum_of(model),
            false_alarm_hours: 24 * self.false_alarm_days,
            drift: self.drift,
        };
        let limits = monitor_limits::limits(study, set_up, model, purpose)?;
        Ok(Some(Basis::Study(limits)))
    }
}

/// The records to run: all of a study's, or the one that was named.
pub(super) fn chosen<'a>(study: &'a Study, wanted: Option<&str>) -> Result<Vec<&'a Record>> {
    let Some(wanted) = wanted else {
        return Ok(study.records.iter().collect());
    };
    let chosen: Vec<&Record> = study
        .records
        .iter()
        .filter(|record| record.file == wanted)
        .collect();
    if chosen.is_empty() {
        let files: Vec<&str> = study
            .records
            .iter()
            .map(|record| record.file.as_str())
            .collect();
        return Err(Error::usage(format!(
            "--record {wanted}: the study has no such record; it has {}",
            files.join(", ")
        )));
    }
    Ok(chosen)
}

fn in_words(records: &[RecordReplay], study: &Study, delays_s: [f64; 2]) -> String {
    let mut table = Table::new(&[
        "record",
        "axis",
        "NMSE",
        "relative error",
        "peak error",
        "outside range",
        "digest",
    ]);
    for record in records {
        for axis in &study.axes {
            let Some(figures) = record.axes.get(&axis.name) else {
                continue;
            };
            let others = records.iter().filter_map(|r| r.axes.get(&axis.name));
            let largest = others.map(|f| f.rms_force).fold(0.0, f64::max);
            let unless_at_rest = |text: String| {
                if figures.rms_force < AT_REST_BELOW * largest {
                    "rests".to_string()
                } else {
                    text
                }
            };
            table.row(vec![
                record.file.clone(),
                axis.name.clone(),
                unless_at_rest(percent(figures.nmse_percent)),
                unless_at_rest(format!("{:.4}", figures.relative_error)),
                format!("{} {}", rounded(figures.peak_error), axis.kind.force_unit()),
                format!("{:.2} %", 100.0 * record.outside_range),
                record.digest.clone(),
            ]);
        }
    }
    let saturated: usize = records
        .iter()
        .flat_map(|r| r.axes.values())
        .map(|a| a.saturated)
        .sum();
    let rails = if saturated > 0 {
        format!("\nIn {saturated} outputs a force ran into the rail of its 32 bits.")
    } else {
        String::new()
    };
    let axes = study.axes.iter().filter(|axis| axis.inertia.is_none());
    let relative: String = axes.map(|axis| relative_to_applied(&axis.name)).collect();
    format!(
        "{relative}The device's integers, from raw counts on (errors in the common band, over rows inside the training range):\n\
         {table}\nForce and residual lag the sensors by {:.1} ms, the band-limited residual by {:.1} ms.{rails}",
        1e3 * delays_s[0],
        1e3 * delays_s[1]
    )
}

/// One line per output: the row it describes, then raw integers, then SI.
fn as_csv(replayed: &Replayed, study: &Study, model: &Model) -> String {
    let mut text = String::from("row,outside");
    for axis in &study.axes {
        let (name, unit) = (&axis.name, axis.kind.force_unit().replace('·', ""));
        for quantity in ["measured", "predicted", "residual"] {
            let _ = write!(text, ",{name}_{quantity}_raw,{name}_{quantity}_{unit}");
        }
    }
    text.push('\n');
    for (at, output) in replayed.outputs.iter().enumerate() {
        let _ = write!(text, "{},{}", replayed.first_row + at, output.outside);
        for axis in 0..study.axes.len() {
            let unit = model.outputs()[axis].force_per_lsb;
            for raw in [
                output.measured[axis],
                output.predicted[axis],
                output.residual[axis],
            ] {
                let _ = write!(text, ",{raw},{:e}", f64::from(raw) * unit);
            }
        }
        text.push('\n');
    }
    text
}
