//! Adding effects to a model: everything is found anew together, and the errors before and after stand side by side.

use crate::compare::{self, RecordFigures};
use crate::diagnose::noise;
use crate::error::{Error, Result};
use crate::fit::effects::FoundTerm;
use crate::identify::{Prepared, fit_in_time};
use crate::model::effects::Bound;
use crate::model_file::{Base, HistoryEntry, ModelFile};
use crate::motion::Motion;
use crate::study::{Role, Study};
use jointwatch_shared::model::terms::InSi;
use serde::Serialize;

/// An effect that lowers no axis's error by this part is of no help.
const LEAST_HELP: f64 = 0.01;

/// Errors of one axis on one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The record's file.
    pub file: String,
    /// Verification (`train`) or validation (`validate`).
    pub role: Role,
    /// The axis.
    pub axis: String,
    /// NMSE before, percent.
    pub before_nmse_percent: f64,
    /// NMSE after, percent.
    pub after_nmse_percent: f64,
    /// Relative error before.
    pub before: f64,
    /// Relative error after.
    pub after: f64,
    /// Relative error that the noise alone makes: no model can go below.
    pub noise_floor: f64,
    /// The axis rests in this record.
    pub rests: bool,
}

/// A model with more effects, and what they brought.
pub struct Added {
    /// The model.
    pub model: ModelFile,
    /// Record by record and axis by axis.
    pub changes: Vec<Change>,
    /// Whether the error falls on records the model was not learnt from (on all records, where there are no others).
    pub helps: bool,
    /// Whether every noise floor was seen on an axis at rest.
    pub floors_at_rest: bool,
}

/// Adds effects (`coulomb@x`, …) to a model of a study and finds all values anew.
///
/// # Errors
/// [`crate::error::Kind::Data`]: an effect that is not known, is there already or acts on an axis that is not there; a study that is not
/// the model's; a model whose base is no sum of effects.
pub fn add(study: &Study, model: &ModelFile, effects: &[String]) -> Result<Added> {
    model.check_fits(study)?;
    let names: Vec<&str> = model.axes.iter().map(|a| a.name.as_str()).collect();
    let mut terms: Vec<String> = model.effects.iter().map(|e| e.name()).collect();
    for effect in effects {
        let bound = Bound::parse(effect, &names)?;
        if terms.contains(&bound.name(&names)) {
            return Err(Error::data(format!(
                "the model has {} already: its value is found anew whenever something is added",
                bound.name(&names)
            )));
        }
        terms.push(bound.name(&names));
    }
    let terms = Bound::parse_all(&terms, &names)?;
    if !matches!(model.base, Base::None(_)) {
        return Err(Error::data(format!(
            "the model is a {}, and effects are added to physical models: identify one with --model physical first",
            model.base.name()
        )));
    }
    let prepared = Prepared::with_filters(study, model.filters.clone())?;
    let fit = fit_in_time(study, &prepared, &terms)?;
    let before = compare::compare_motions(study, model, &prepared.motions)?;
    let all: Vec<&Motion> = prepared.motions.iter().collect();
    let inertia: Vec<f64> = fit.inertia.iter().map(|i| i.value).collect();
    let in_si: Vec<InSi> = fit.terms.iter().map(FoundTerm::in_si).collect();
    let floors = noise::floors(&study.axes, &all, &model.filters.band, &in_si, &inertia);
    let mut wider = prepared.physical(study, fit)?.model;
    let after = compare::compare(study, &wider)?;
    let mut changes = Vec::new();
    for (old, new) in before.records.iter().zip(&after.records) {
        for (axis, floor) in names.iter().zip(&floors) {
            changes.extend(change(old, new, axis, floor.rms));
        }
    }
    let helps = {
        let judged = |c: &&Change| c.role == Role::Validate && !c.rests;
        let any = changes.iter().any(|c| judged(&c));
        let counts = changes.iter().filter(|c| !c.rests && (!any || judged(c)));
        counts
            .filter(|c| c.after < (1.0 - LEAST_HELP) * c.before)
            .count()
            > 0
    };
    let mut history = model.history.clone();
    history.push(HistoryEntry {
        what: format!("added: {}", effects.join(", ")),
        validation: wider.validation.clone(),
    });
    wider.history = history;
    Ok(Added {
        model: wider,
        changes,
        helps,
        floors_at_rest: floors.iter().all(|f| f.at_rest),
    })
}

fn change(old: &RecordFigures, new: &RecordFigures, axis: &str, floor: f64) -> Option<Change> {
    let (before, after) = (old.axes.get(axis)?, new.axes.get(axis)?);
    Some(Change {
        file: old.file.clone(),
        role: old.role,
        axis: axis.to_string(),
        before_nmse_percent: before.nmse_percent,
        after_nmse_percent: after.nmse_percent,
        before: before.relative_error,
        after: after.relative_error,
        noise_floor: floor / after.rms_force.max(f64::MIN_POSITIVE),
        rests: after.rests,
    })
}
