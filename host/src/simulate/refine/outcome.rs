//! What a refinement came to: errors before and after, in force and in simulated motion, and
//! whether it was kept.

use crate::fit::errors::Evaluated;
use crate::model::file::{AxisError, HistoryEntry, ModelFile};
use crate::signal::motion;
use crate::simulate::respond::{Options, Response, respond};
use crate::study::{Role, Study};
use crate::text::date;
use crate::text::error::Result;
use crate::text::table::{Table, significant};
use serde::Serialize;

/// A model, and what its refinement came to.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The refined model, or the one that was given where the refinement was not kept.
    pub model: ModelFile,
    /// Errors before and after.
    pub refinement: Refinement,
}

/// Errors before and after a refinement; the key `simulation` of `identify --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refinement {
    /// Whether the model was changed.
    pub kept: bool,
    /// Length of the stretches that were simulated, s; none where nothing was kept.
    pub stretch_s: Option<f64>,
    /// RMS error of the simulated displacement as a part of its RMS on the last fifth of the
    /// training records, before and after a refinement on the rest.
    pub held_out: [f64; 2],
    /// Equation error on the training records before and after.
    pub verification: [Vec<AxisError>; 2],
    /// The same on the validation records; empty where there are none.
    pub validation: [Vec<AxisError>; 2],
    /// Every record and axis in the order of the study.
    pub records: Vec<SimulatedChange>,
    /// What to be wary of, one sentence each.
    pub notes: Vec<String>,
}

/// One axis of one record, simulated by the model before and after.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedChange {
    /// The record's file, as the study names it.
    pub file: String,
    /// Learnt from or not.
    pub role: Role,
    /// Name of the axis.
    pub axis: String,
    /// By the fit to the equation of motion.
    pub before: SimulatedError,
    /// By the refined model; as before where it was not kept.
    pub after: SimulatedError,
}

/// How far a simulated displacement is from the measured one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SimulatedError {
    /// RMS of the difference, m or rad, over what was simulated.
    pub rms: f64,
    /// 100·⟨(x−x̂)²⟩/var x, percent.
    pub nmse_percent: f64,
    /// Seconds from the beginning of the file at which the simulation diverged.
    pub diverged_at_s: Option<f64>,
}

/// Simulates every record with both models and puts the figures together.
///
/// `logged` is the study as it was logged, `study` the same with its instruments put right.
pub(super) fn outcome(
    (logged, study): (&Study, &Study),
    model: &ModelFile,
    refined: Option<ModelFile>,
    stretch_s: Option<f64>,
    held_out: [f64; 2],
) -> Result<Refined> {
    let kept = refined.is_some();
    let mut after = refined.unwrap_or_else(|| model.clone());
    let motions = motion::motions(logged, &model.filters)?;
    let [of_before, of_after] = [model, &after].map(|m| -> Result<_> {
        let evaluated = Evaluated::as_logged(logged, m, &motions)?;
        Ok([Role::Train, Role::Validate].map(|role| evaluated.pooled(role)))
    });
    let ([v0, w0], [v1, w1]) = (of_before?, of_after?);
    let options = Options {
        measured: true,
        ..Options::default()
    };
    let before = respond(study, model, &options)?;
    let simulated = respond(study, &after, &options)?;
    let records = changes(study, &before, &simulated);
    let notes = notes(kept, held_out, &records);
    if kept {
        after.fit = "output error".into();
        after.verification.clone_from(&v1);
        after.validation.clone_from(&w1);
        after.warnings.extend(notes.iter().cloned());
        after.history.push(HistoryEntry {
            what: "refined: simulated motion fitted to the measured".into(),
            date: date::today()?,
            change: None,
            validation: w1.clone(),
        });
    }
    Ok(Refined {
        model: after,
        refinement: Refinement {
            kept,
            stretch_s,
            held_out,
            verification: [v0, v1],
            validation: [w0, w1],
            records,
            notes,
        },
    })
}

fn changes(study: &Study, before: &Response, after: &Response) -> Vec<SimulatedChange> {
    let mut changes = Vec::new();
    for (old, new) in before.records.iter().zip(&after.records) {
        for axis in &study.axes {
            let [before, after] = [old, new].map(|record| {
                let figures = &record.axes[&axis.name];
                let nmse_percent = figures.displacement_nmse_percent;
                SimulatedError {
                    rms: figures.rms_displacement * (0.01 * nmse_percent).sqrt(),
                    nmse_percent,
                    diverged_at_s: record.diverged.first().map(|d| d.time_s),
                }
            });
            changes.push(SimulatedChange {
                file: old.file.clone(),
                role: old.role,
                axis: axis.name.clone(),
                before,
                after,
            });
        }
    }
    changes
}

fn notes(kept: bool, held_out: [f64; 2], records: &[SimulatedChange]) -> Vec<String> {
    let mut notes = Vec::new();
    if !kept {
        let missed = |part: f64| match part.is_finite() {
            true => format!("misses by {} % of its RMS", significant(100.0 * part)),
            false => "diverges".into(),
        };
        notes.push(format!(
            "the refinement was not kept: on the last fifth of the training records the simulated displacement {} with the fit to the \
             equation of motion, and {} at best after a refinement on the rest",
            missed(held_out[0]),
            missed(held_out[1])
        ));
        return notes;
    }
    for change in records {
        let gone = change.after.diverged_at_s.is_some() && change.before.diverged_at_s.is_none();
        if gone || change.after.rms > change.before.rms {
            notes.push(format!(
                "{}: the refined model simulates {} worse than the fit to the equation of motion, although it did better on held-out \
                 training rows; compare with --criterion equation",
                change.file, change.axis
            ));
        }
    }
    notes
}

/// Both errors before and after, as text.
pub fn in_words(refinement: &Refinement, study: &Study) -> String {
    let mut table = Table::new(&[
        "record",
        "axis",
        "unit",
        "RMS before",
        "after",
        "NMSE before",
        "after",
    ]);
    for change in &refinement.records {
        let unit = study.axes.iter().find(|a| a.name == change.axis);
        let cell = |e: &SimulatedError, text: String| match e.diverged_at_s {
            Some(time_s) => format!("diverged at {time_s:.3} s"),
            None => text,
        };
        let [old, new] = [&change.before, &change.after];
        let percent = |e: &SimulatedError| cell(e, format!("{} %", significant(e.nmse_percent)));
        table.row(vec![
            format!("{} ({})", change.file, change.role.name()),
            change.axis.clone(),
            unit.map_or(String::new(), |axis| {
                axis.kind.displacement_unit().to_string()
            }),
            cell(old, significant(old.rms)),
            cell(new, significant(new.rms)),
            percent(old),
            percent(new),
        ]);
    }
    let mut force = Table::new(&["records", "axis", "NMSE before", "after"]);
    let both = [
        ("training", &refinement.verification),
        ("validation", &refinement.validation),
    ];
    for (records, [before, after]) in both {
        for (before, after) in before.iter().zip(after) {
            force.row(vec![
                records.into(),
                before.axis.clone(),
                format!("{} %", significant(before.nmse_percent)),
                format!("{} %", significant(after.nmse_percent)),
            ]);
        }
    }
    let how = match refinement.stretch_s {
        Some(seconds) => format!("on stretches of {} s", significant(seconds)),
        None => "not kept".into(),
    };
    format!(
        "Refinement by simulation, {how}: simulated displacement\n{table}\nForce at the measured states (equation error)\n{force}"
    )
}
