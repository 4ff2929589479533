//! What the monitor would have said over the records of a study: for `replay --monitor`.

use crate::device::monitor_limits::{Calibration, Healthy};
use crate::device::replay;
use crate::study::{Record, Study};
use crate::text::error::{Error, Result};
use clap::ValueEnum;
use jointwatch_shared::base::Model;
use jointwatch_shared::monitor::limits::Limits;
use jointwatch_shared::monitor::{AxisHealth, Monitor, MonitorState, RECENT, State, Verdict};
use std::fmt::Write;

/// What makes `replay --monitor` end with exit code 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FailOn {
    /// An alarm.
    Alarm,
    /// An alarm, or a suspicion.
    Suspect,
}

/// Where the monitor's limits come from.
pub(super) enum Basis {
    /// The study's own validation records.
    Study(Calibration),
    /// Those in a rig block.
    Board(Limits),
}

/// One axis over one record.
struct OfAxis {
    /// Every change of its verdict, with its time in s.
    changes: Vec<(f64, Verdict)>,
    /// At the end of the record.
    health: AxisHealth,
    /// The part of the record that passed less than a block after one that was judged.
    judged: f64,
}

/// What the monitor said over one record, from a fresh start.
struct OfRecord {
    file: String,
    /// Every change of the joint's verdict, with its time in s.
    changes: Vec<(f64, Verdict)>,
    axes: Vec<OfAxis>,
}

/// What the monitor said over records.
pub(super) struct Watched {
    basis: Basis,
    records: Vec<OfRecord>,
}

/// The monitor with these limits behind a study's chain.
pub(super) fn monitor(study: &Study, set_up: &replay::SetUp, limits: &Limits) -> Result<Monitor> {
    Monitor::new(limits.clone(), &set_up.chain)
        .map_err(|e| Error::data(format!("{}: {e}", study.path.display())))
}

impl Basis {
    fn limits(&self) -> &Limits {
        match self {
            Self::Study(calibration) => &calibration.limits,
            Self::Board(limits) => limits,
        }
    }
}

/// Runs the monitor over every record, each from a fresh start.
pub(super) fn watch(
    study: &Study,
    records: &[&Record],
    set_up: &replay::SetUp,
    model: &Model,
    basis: Basis,
) -> Result<Watched> {
    let monitor = monitor(study, set_up, basis.limits())?;
    let over = |record: &&Record| {
        let mut state = MonitorState::default();
        let mut changes = Vec::new();
        let mut of_axes = vec![(Vec::new(), 0_usize); study.axes.len()];
        let mut rows = 0;
        for (row, sample) in set_up.samples(record, model).enumerate() {
            let output = sample.output.as_ref();
            let verdict = monitor.update(&mut state, &sample.raw, output, &sample.faults);
            let time = row as f64 / study.sample_rate_hz;
            note(&mut changes, time, verdict);
            for (axis, (changes, judged)) in of_axes.iter_mut().enumerate() {
                let health = state.axis(&monitor, axis);
                note(changes, time, health.verdict);
                // Before the first block is judged the age is that of the record.
                *judged += usize::from(health.unjudged_samples == 0 && health.judged_permille > 0);
            }
            rows = row + 1;
        }
        let axes = of_axes.into_iter().enumerate();
        OfRecord {
            file: record.file.clone(),
            changes,
            axes: axes
                .map(|(axis, (changes, judged))| OfAxis {
                    changes,
                    health: state.axis(&monitor, axis),
                    judged: judged as f64 / rows.max(1) as f64,
                })
                .collect(),
        }
    };
    let records = records.iter().map(over).collect();
    Ok(Watched { basis, records })
}

/// What changes of each axis the monitor finds, and how soon: a line each, behind a line break.
pub(super) fn detected(names: &[&str], healthy: &[[Healthy; 5]], block_s: f64) -> String {
    let line = |(name, sides): (&&str, &[Healthy; 5])| {
        let [error, rest @ ..] = sides.map(|side| side.blocks_to_alarm * block_s);
        let slowest = rest.into_iter().fold(0.0, f64::max);
        format!(
            "\n  {name}: a stiffness or viscous friction that changes by 10 % of the RMS force is expected to raise the alarm \
             within {slowest:.1} s, any other change of that size within {error:.1} s of driven motion"
        )
    };
    names.iter().zip(healthy).map(line).collect()
}

/// Notes a verdict that says something else than the last one.
fn note(changes: &mut Vec<(f64, Verdict)>, time: f64, verdict: Verdict) {
    if !changes
        .last()
        .is_some_and(|(_, last)| last.same_reason(&verdict))
    {
        changes.push((time, verdict));
    }
}

impl Watched {
    /// The limits by which it was judged.
    pub(super) fn limits(&self) -> &Limits {
        self.basis.limits()
    }

    /// The error that exit code 4 stands for, when a record held what is to be failed on.
    pub(super) fn fail_on(&self, fail_on: FailOn) -> Result<()> {
        let least = match fail_on {
            FailOn::Alarm => State::Alarm,
            FailOn::Suspect => State::Suspect,
        };
        for record in &self.records {
            let first = record.changes.iter().find(|(_, v)| v.state >= least);
            if let Some((time, verdict)) = first {
                return Err(Error::found(format!(
                    "{}: {} at {time:.3} s",
                    record.file,
                    verdict.state.words()
                )));
            }
        }
        Ok(())
    }

    /// For a person to read.
    pub(super) fn in_words(&self, study: &Study) -> String {
        let names: Vec<&str> = study.axes.iter().map(|axis| axis.name.as_str()).collect();
        let limits = self.basis.limits();
        let block_s = f64::from(limits.block) / study.sample_rate_hz;
        let mut text = format!(
            "The monitor, {} to one false alarm in {} days, in blocks of {:.0} ms:",
            match &self.basis {
                Basis::Study(_) => "set from the validation records",
                Basis::Board(_) => "set by the rig block",
            },
            limits.false_alarm_hours / 24,
            1e3 * block_s
        );
        let healthy = match &self.basis {
            Basis::Study(calibration) => calibration.healthy.as_slice(),
            Basis::Board(_) => &[],
        };
        text.push_str(&detected(&names, healthy, block_s));
        for record in &self.records {
            for (time, verdict) in &record.changes {
                let _ = write!(
                    text,
                    "\n  {} {time:8.3} s  {}: {}",
                    record.file,
                    verdict.state.words(),
                    verdict.words(&names)
                );
            }
            for (name, axis) in names.iter().zip(&record.axes) {
                let health = &axis.health;
                let _ = write!(
                    text,
                    "\n  {} at its end   {name}: {}, {}; last judged {:.1} s before, {:.0} % of the last {:.0} s and {:.0} % of \
                     the record",
                    record.file,
                    health.verdict.state.words(),
                    health.verdict.words(&names),
                    f64::from(health.unjudged_samples) / study.sample_rate_hz,
                    f64::from(health.judged_permille) / 10.0,
                    f64::from(RECENT) * block_s,
                    100.0 * axis.judged,
                );
            }
        }
        text
    }

    /// The same as JSON.
    pub(super) fn as_json(&self, study: &Study) -> serde_json::Value {
        let names: Vec<&str> = study.axes.iter().map(|axis| axis.name.as_str()).collect();
        let listed = |changes: &[(f64, Verdict)]| -> Vec<serde_json::Value> {
            let changes = changes.iter().map(|(time_s, verdict)| {
                serde_json::json!({
                    "time_s": time_s,
                    "state": verdict.state.words(),
                    "cause": verdict.cause.tag(),
                    "reason": verdict.words(&names).to_string(),
                    "permille": verdict.permille,
                })
            });
            changes.collect()
        };
        let records = self.records.iter().map(|record| {
            let axes = names.iter().zip(&record.axes).map(|(name, axis)| {
                let health = &axis.health;
                let of_axis = serde_json::json!({
                    "changes": listed(&axis.changes),
                    "state": health.verdict.state.words(),
                    "reason": health.verdict.words(&names).to_string(),
                    "unjudged_s": f64::from(health.unjudged_samples) / study.sample_rate_hz,
                    "judged_share_recent": f64::from(health.judged_permille) / 1e3,
                    "judged_share": axis.judged,
                });
                ((*name).to_string(), of_axis)
            });
            let axes: serde_json::Map<String, serde_json::Value> = axes.collect();
            serde_json::json!({
                "file": record.file,
                "changes": listed(&record.changes),
                "axes": axes,
            })
        });
        let mut json = serde_json::json!({
            "false_alarm_hours": self.basis.limits().false_alarm_hours,
            "records": records.collect::<Vec<_>>(),
        });
        if let Basis::Study(calibration) = &self.basis {
            json["healthy"] = serde_json::json!(calibration.healthy);
            json["judged_blocks"] = serde_json::json!(calibration.blocks);
        }
        json
    }
}
