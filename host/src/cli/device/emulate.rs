//! `jointwatch emulate`: the firmware itself under QEMU, its sensor chips fed with a record, every
//! bit compared with `replay`.

use super::replay::chosen;
use super::serve::{self, Service};
use crate::cli::console::Console;
use crate::device::{export, followed, rig_block};
use crate::emulate::bench::{Instructions, STAGES, Scenario};
use crate::emulate::device::{Emulated, EmulatedDevice};
use crate::emulate::selftest;
use crate::emulate::size::{self, Size};
use crate::study::{Record, Study};
use crate::text::error::{Error, Result};
use clap::Args;
use jointwatch_shared::wire::telemetry::Status;
use std::fmt::Write;
use std::path::PathBuf;

/// Options of `jointwatch emulate`.
#[derive(Args)]
pub(crate) struct Emulate {
    /// The blob that `export` wrote.
    blob: PathBuf,
    /// The study whose records to feed: its study.toml, or the folder that holds it.
    study: PathBuf,
    /// Only this record, as study.toml names it; all of them when left out.
    #[arg(long, value_name = "FILE")]
    record: Option<String>,
    /// The rig block that `export --rig` wrote; when left out, one is made from the study's
    /// records, as by `export --rig defaults`, with limits for the monitor from the validation
    /// records.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Let the device run on and on, driven by one record in a loop, and offer its line on this
    /// port of 127.0.0.1; 0 takes a free one. Lines of standard input change the joint: change
    /// viscous@x*0.5, restore, quit.
    #[arg(long, value_name = "PORT")]
    serve: Option<u16>,
    /// A change of the joint while it is served: an effect of the model, or force@AXIS for all of
    /// it, and what its force is multiplied by, at the same motion.
    #[arg(long, value_name = "EFFECT@AXIS*FACTOR", requires = "serve")]
    change: Option<String>,
    /// Seconds of the device's time after which it comes.
    #[arg(long, value_name = "S", default_value_t = 20.0, requires = "change", value_parser = super::monitor::seconds)]
    after: f64,
}

impl Emulate {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let working = console.working("building the firmware");
        let model = export::read_blob(&self.blob)?;
        let study = Study::read_whole_following(&self.study, &followed::names(&model))?;
        let records = chosen(&study, self.record.as_deref())?;
        let block = self.rig.as_deref().map(rig_block::read).transpose()?;
        let emulated = EmulatedDevice::new(&study, &model, block)?;
        let slot = emulated.slot()?.to_bytes();
        selftest::require_qemu()?;
        if let Some(port) = self.serve {
            let record = serve::driven(&records)?;
            working.finish_and_clear();
            let service = Service {
                port,
                change: self.change.as_deref().map(|text| (text, self.after)),
            };
            return serve::serve(console, &emulated, (&study, &model, record), &service);
        }
        let elf = selftest::emulated()?;
        let size = size::of(&elf)?;
        working.set_message("emulating");
        let mut runs = Vec::new();
        for record in records {
            let scenario = Scenario::default();
            let run = emulated.run(&elf, &slot, record, &[], scenario)?;
            runs.push((record, run));
        }
        working.finish_and_clear();
        console.say(in_words(&runs, &study, size))?;
        console.json(&as_json(&runs, &study, size))?;
        match runs.iter().find(|(_, run)| !agrees(run)) {
            None => Ok(()),
            Some((record, run)) => Err(Error::failed(format!(
                "{}: the firmware and the host do not agree: {}",
                record.file,
                disagreement(run)
            ))),
        }
    }
}

/// Whether the device did what it should, to the bit.
fn agrees(emulated: &Emulated) -> bool {
    let c = &emulated.run.comparison;
    c.outputs > 0 && c.different_bits == 0 && c.wrong_counts == 0 && emulated.run.tally.lost == 0
}

fn disagreement(emulated: &Emulated) -> String {
    let c = &emulated.run.comparison;
    match c.first_difference {
        _ if c.outputs == 0 => "the device said nothing of the joint".into(),
        Some(sample) => format!(
            "{} bits differ, the first at sample {sample}",
            c.different_bits
        ),
        None if c.wrong_counts > 0 => format!(
            "{} samples do not hold what the chips were fed",
            c.wrong_counts
        ),
        None => format!("{} messages were lost", emulated.run.tally.lost),
    }
}

/// Seconds of the record beside seconds on this computer.
fn speed(record: &Record, study: &Study, emulated: &Emulated) -> f64 {
    record.rows as f64 / study.sample_rate_hz / emulated.took.as_secs_f64()
}

/// What the last status of a run says of the joint.
fn verdict(status: &Status, names: &[&str]) -> String {
    status.verdict.read().map_or("unknown".into(), |verdict| {
        format!("{}: {}", verdict.state.words(), verdict.words(names))
    })
}

fn in_words(runs: &[(&Record, Emulated)], study: &Study, size: Size) -> String {
    let names: Vec<&str> = study.axes.iter().map(|axis| axis.name.as_str()).collect();
    let mut text = String::from("The firmware under QEMU, its chips fed row by row:\n");
    for (record, emulated) in runs {
        let run = &emulated.run;
        let c = &run.comparison;
        let _ = writeln!(
            text,
            "  {}: {} samples, {} outputs compared with the host's chain: {} bits of predicted force and residual differ, {} of \
             everything; {} with `replay` of the record alone: {} bits. {:.1} times as fast as the rig ran.",
            record.file,
            c.samples,
            c.outputs,
            c.different_force_bits,
            c.different_bits,
            c.replayed,
            c.different_replayed_bits,
            speed(record, study, emulated)
        );
        if let Some(status) = run.said.statuses.last() {
            let _ = writeln!(text, "    at its end {}", verdict(status, &names));
        }
    }
    if runs
        .iter()
        .any(|(_, emulated)| emulated.run.comparison.different_replayed_bits > 0)
    {
        let _ = writeln!(
            text,
            "  `replay` begins with the record; the device runs before it and remembers that: in an effect with a memory, or in a line of the \
             mains that it follows"
        );
    }
    if let Some(count) = runs.iter().filter_map(|(_, e)| e.run.start).max() {
        let _ = writeln!(
            text,
            "  instructions of the start, a signature verified: {:.1} million",
            1e-6 * f64::from(count)
        );
    }
    for (stage, sum) in STAGES.iter().zip(all_stages(runs)) {
        let _ = writeln!(
            text,
            "  instructions per sample, {stage}: {:.0} ({} to {})",
            sum.mean(),
            sum.least,
            sum.most
        );
    }
    let peak = runs
        .iter()
        .filter_map(|(_, e)| e.run.memory)
        .max_by_key(|m| m.stack_peak);
    if let Some(memory) = peak {
        let _ = writeln!(
            text,
            "  RAM: {:.1} KiB of variables, {:.1} KiB reserved for the stack, of which {:.0} % were ever used",
            kib(memory.variables.into()),
            kib(memory.stack_reserved.into()),
            100.0 * f64::from(memory.stack_peak) / f64::from(memory.stack_reserved.max(1))
        );
    }
    let _ = write!(text, "  flash: {:.1} KiB", kib(size.flash));
    text
}

fn kib(bytes: u64) -> f64 {
    bytes as f64 / 1024.0
}

/// Every stage over all records.
fn all_stages(runs: &[(&Record, Emulated)]) -> Vec<Instructions> {
    let mut sums: Vec<Instructions> = Vec::new();
    for (_, emulated) in runs {
        for (at, stage) in emulated.run.instructions.iter().enumerate() {
            match sums.get_mut(at) {
                Some(sum) => sum.merge(stage),
                None => sums.push(*stage),
            }
        }
    }
    sums
}

fn as_json(runs: &[(&Record, Emulated)], study: &Study, size: Size) -> serde_json::Value {
    let names: Vec<&str> = study.axes.iter().map(|axis| axis.name.as_str()).collect();
    let records = runs.iter().map(|(record, emulated)| {
        let run = &emulated.run;
        let stages = STAGES.iter().zip(&run.instructions).map(|(stage, sum)| {
            let figures =
                serde_json::json!({ "mean": sum.mean(), "least": sum.least, "most": sum.most });
            ((*stage).to_string(), figures)
        });
        serde_json::json!({
            "file": record.file,
            "instants": run.instants,
            "comparison": run.comparison,
            "messages": run.tally,
            "agrees": agrees(emulated),
            "verdict": run.said.statuses.last().map(|status| verdict(status, &names)),
            "counters": run.said.statuses.last().map(|status| status.counters),
            "instructions": stages.collect::<serde_json::Map<_, _>>(),
            "start_instructions": run.start,
            "memory": run.memory,
            "times_real_time": speed(record, study, emulated),
        })
    });
    serde_json::json!({ "records": records.collect::<Vec<_>>(), "image": size })
}
