//! Adding effects to a model: everything is found anew together, and the errors before and after
//! stand side by side.

use crate::assess::compare::{self, RecordFigures};
use crate::assess::noise_floor;
use crate::diagnose::PerAxis;
use crate::diagnose::later::{DELAY, delays_of, read_later};
use crate::diagnose::meaningless::{cancelled, undetermined, unphysical};
use crate::diagnose::search::start::{inherited, start};
use crate::fit::effects::columns::Records;
use crate::fit::identify::{FitResult, Prepared, effect_terms, fit_alone, fit_in_time};
use crate::fit::with_base::{OnRecords, WithBase};
use crate::model::ModelEffect;
use crate::model::corrections::missing_inertia;
use crate::model::effects::{AxisEffect, input_of};
use crate::model::file::{AxisError, Base, ErrorChange, HistoryEntry, JudgedOn, ModelFile};
use crate::model::time_history::{TimeHistory, add_forces};
use crate::signal::motion::Motion;
use crate::study::{Role, Study};
use crate::text::date;
use crate::text::error::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// An effect that lowers no axis's error by this part is of no help.
pub(super) const MIN_HELP: f64 = 0.01;
/// Two effects that cancel are kept for their sum up to this size: beyond it their values lose more
/// than a digit and a half.
const MAX_PAIR: f64 = 30.0;

/// Errors of one axis on one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The record's file, as the study names it.
    pub file: String,
    /// Verification (`train`) or validation (`validate`).
    pub role: Role,
    /// Name of the axis.
    pub axis: String,
    /// NMSE of the model that was given, percent.
    pub before_nmse_percent: f64,
    /// NMSE of the model with the effects, percent.
    pub after_nmse_percent: f64,
    /// RMS error over RMS force of the model that was given.
    pub before: f64,
    /// RMS error over RMS force of the model with the effects.
    pub after: f64,
    /// Relative error that the noise alone makes: no model can go below.
    pub noise_floor: f64,
    /// The axis rests in this record.
    #[serde(rename = "rests")]
    pub at_rest: bool,
}

/// A model with more effects, and what they brought.
pub struct Added {
    /// The model with the effects in it, all its values found anew.
    pub model: ModelFile,
    /// Record by record and axis by axis.
    pub changes: Vec<Change>,
    /// Over all rows that say how good the model is, per axis.
    pub errors: ErrorChange,
    /// Per axis, what no model can go below on those rows; a relative error.
    pub noise_floor: Vec<f64>,
    /// Whether the error falls on an axis, on rows that the model was not fitted to.
    pub helps: bool,
    /// Whether every noise floor was seen on an axis at rest.
    pub floors_at_rest: bool,
    /// An effect so large that only another one cancels it, and how many times as large as is
    /// usual: the two are one too many.
    pub cancels: Option<(String, f64)>,
    /// An effect that has a value which it cannot have, and did not have in the model before.
    pub unphysical: Option<String>,
    /// One of those added of which the records tell no strength, where the error does not halve.
    pub undetermined: Option<String>,
}

impl Added {
    /// Whether no value is one that an effect cannot have, none is there to be cancelled by another
    /// one, and the records tell all.
    pub(super) fn means_something(&self) -> bool {
        self.cancels.is_none() && self.unphysical.is_none() && self.undetermined.is_none()
    }

    /// What `add --json` says; `model` is where the model was written, if it was.
    pub fn as_json(&self, model: Option<&Path>) -> serde_json::Value {
        let axes = self.errors.after.iter().zip(&self.noise_floor);
        let floors: PerAxis = axes.map(|(e, floor)| (e.axis.clone(), *floor)).collect();
        serde_json::json!({
            "model": model, "helps": self.helps, "changes": self.changes, "errors": self.errors,
            "noise_floor": floors, "effects": self.model.effects,
        })
    }
}

/// Adds effects (`coulomb@x`, …) to a model of a study and finds all values anew, those of a
/// polynomial or a network as well.
///
/// # Errors
/// [`crate::text::error::Kind::Data`]: an effect that is not known, is there already, acts on an
/// axis that is not there or does what the model does without it; a study that is not the model's.
pub fn add(study: &Study, from: &ModelFile, effects: &[String]) -> Result<Added> {
    let prepared = Prepared::for_model(study, from)?;
    let mut added = add_to(study, &prepared, from, effects)?;
    if let Some(name) = &added.unphysical {
        added.model.warnings.push(format!(
            "{name} has a value that is not physical: something else acts there, or these records do not determine it"
        ));
    }
    Ok(added)
}

/// The same for the motions that the model's filters make of the study.
///
/// # Errors
/// As [`add`].
pub(super) fn add_to(
    study: &Study,
    prepared: &Prepared,
    from: &ModelFile,
    effects: &[String],
) -> Result<Added> {
    let mut terms = wider(study, from, effects)?;
    let mut added = refitted(study, prepared, from, terms.clone(), effects)?;
    let Some((other, times)) = added.cancels.take() else {
        return Ok(added);
    };
    // What was added takes the place of the other one, as a damper of some power may that of a
    // viscous one.
    let (listed, mut change) = (effects.join(", "), added.errors.clone());
    if !effects.contains(&other) {
        let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
        terms.retain(|term| term.name(&names) != other);
        let mut alone = refitted(study, prepared, from, terms, effects)?;
        if alone.helps && alone.means_something() {
            change.before.clone_from(&alone.errors.after);
            if times > MAX_PAIR || !change.halves() {
                let place = format!("{listed} takes the place of {other}, which would cancel it");
                alone.model.warnings.push(place);
                return Ok(alone);
            }
        }
    }
    // Together they may be the only description of a law that has no name here: better a force that
    // is right than none.
    if change.halves() && times <= MAX_PAIR {
        added.model.warnings.push(format!(
            "{listed} and {other} cancel for the most part: their sum describes the force, neither value means anything by itself"
        ));
    } else {
        added.cancels = Some((other, times));
    }
    Ok(added)
}

/// The model with all of its parts found anew beside these terms, which hold the added `effects`,
/// and its errors.
pub(super) fn refitted(
    study: &Study,
    prepared: &Prepared,
    from: &ModelFile,
    terms: Vec<AxisEffect>,
    effects: &[String],
) -> Result<Added> {
    from.check_motion(study, &prepared.motions)?;
    let before = compare::compare_motions(study, from, &prepared.motions)?;
    let blocks = prepared.validation(study).is_empty();
    let errors_before = match blocks {
        true => held_out_errors(study, prepared, from)?,
        false => before.validation.clone(),
    };
    let learnt = learnt_without_vanished(study, prepared, from, terms, effects)?;
    let inertia: Vec<f64> = learnt.inertia.iter().map(|i| i.value).collect();
    let mut model = with_history(study, prepared, learnt, from)?;
    let after = compare::compare_motions(study, &model, &prepared.motions)?;
    let floors = floors(study, prepared, &model, &inertia)?;
    let changes = before.records.iter().zip(&after.records);
    let changes = changes.flat_map(|(old, new)| {
        let axes = study.axes.iter().zip(&floors);
        axes.filter_map(|(axis, floor)| change(old, new, &axis.name, floor.rms))
    });
    let errors = ErrorChange {
        judged_on: match blocks {
            true => JudgedOn::HeldOutBlocks,
            false => JudgedOn::Validation,
        },
        before: errors_before,
        after: match blocks {
            true => held_out_errors(study, prepared, &model)?,
            false => after.validation.clone(),
        },
    };
    let fell = |(before, after): (&AxisError, &AxisError)| {
        after.relative_error < (1.0 - MIN_HELP) * before.relative_error
    };
    let role = if blocks { Role::Train } else { Role::Validate };
    let force = |axis: usize| rms_force(&after.records, role, &study.axes[axis].name);
    let noise_floor = floors.iter().enumerate();
    let noise_floor = noise_floor.map(|(axis, floor)| floor.rms / force(axis));
    model.history.push(HistoryEntry {
        what: format!("added: {}", effects.join(", ")),
        date: date::today()?,
        change: Some(errors.clone()),
        validation: model.validation.clone(),
    });
    let training = prepared.training(study);
    let records = Records::new(&study.axes, &training, &model.filters.band);
    Ok(Added {
        changes: changes.collect(),
        helps: errors.before.iter().zip(&errors.after).any(fell),
        noise_floor: noise_floor.collect(),
        floors_at_rest: floors.iter().all(|f| f.at_rest),
        // Of the two terms of a strength a + b·u one cancels the mean of the other.
        cancels: match effects.iter().any(|e| input_of(e).is_some()) {
            true => None,
            false => cancelled(study, &records, from, &model)?,
        },
        unphysical: unphysical(&records, from, &model)?,
        // Better a force that is right than none.
        undetermined: undetermined(&model, effects).filter(|_| !errors.halves()),
        errors,
        model,
    })
}

/// The model with all of its parts found anew beside these terms; once more without those that have
/// no strength beside what is added.
fn learnt_without_vanished(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    mut terms: Vec<AxisEffect>,
    added: &[String],
) -> Result<FitResult> {
    let learnt = learnt_with(study, prepared, model, &terms)?;
    let vanished = learnt.effects.iter().filter(|e| e.has_vanished());
    let mut gone: Vec<String> = vanished.map(ModelEffect::name).collect();
    gone.retain(|name| !added.contains(name));
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    terms.retain(|term| !gone.contains(&term.name(&names)));
    // A sum of effects has one at least.
    if gone.is_empty() || terms.is_empty() {
        return Ok(learnt);
    }
    let mut learnt = learnt_with(study, prepared, model, &terms)?;
    let gone = gone.join(", ");
    learnt.warnings.push(match added {
        [] => format!("{gone} is left out, which would have no strength beside the others"),
        _ => format!(
            "{} takes the place of {gone}, which would have no strength beside it",
            added.join(", ")
        ),
    });
    Ok(learnt)
}

/// The model's terms, without those that are special cases of what is added, and those to be added.
fn wider(study: &Study, model: &ModelFile, effects: &[String]) -> Result<Vec<AxisEffect>> {
    let names: Vec<&str> = model.axes.iter().map(|a| a.name.as_str()).collect();
    let mut terms: Vec<String> = model.effects.iter().map(|e| e.name()).collect();
    for bound in AxisEffect::parse_all(effects, &names)? {
        bound.check_in(study, &names)?;
        if terms.contains(&bound.name(&names)) {
            return Err(Error::data(format!(
                "the model has {} already: its value is found anew whenever something is added",
                bound.name(&names)
            )));
        }
        let special = |term: &String| {
            let term = AxisEffect::parse(term, &names);
            term.is_ok_and(|term| bound.replaces(&term))
        };
        terms.retain(|term| !special(term));
        terms.push(bound.name(&names));
    }
    AxisEffect::parse_all(&terms, &names)
}

/// The model that `learnt` makes, with the history of the one that it came from.
fn with_history(
    study: &Study,
    prepared: &Prepared,
    learnt: FitResult,
    from: &ModelFile,
) -> Result<ModelFile> {
    let mut model = prepared.finish(study, learnt)?.model;
    model.history = from.history.clone();
    let mut said = Vec::new();
    model.warnings.retain(|warning| {
        let new = !said.contains(warning);
        said.push(warning.clone());
        new
    });
    Ok(model)
}

/// The model with all of its parts found anew beside these terms, before its errors are known.
fn learnt_with(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    terms: &[AxisEffect],
) -> Result<FitResult> {
    let of_model = model.effects_in_si()?;
    let mut known = of_model.clone();
    known.retain(|old| {
        let mut kept = terms.iter();
        kept.any(|term| {
            let same = term.entry == old.entry && term.input == old.input;
            same && term.axis == usize::from(old.axis)
        })
    });
    let mut values: Vec<Vec<f64>> = known.into_iter().map(|effect| effect.values).collect();
    if let [special] = &terms[values.len()..] {
        values.extend(inherited(&of_model, special));
    }
    let (known, added) = terms.split_at(values.len());
    let search = |records: &Records<'_>| start(records, known, &values, added);
    if let Base::None(_) = model.base {
        let fit = fit_alone(study, prepared, terms, &search)?;
        return Ok(prepared.fit_result(study, fit));
    }
    let ridge = strengths(prepared, study, model);
    let (effects, (base, ridge, effective)) = fit_in_time(study, prepared, |motions| {
        let WithBase {
            effects,
            base,
            ridge,
            effective_parameters,
        } = OnRecords::new(&study.axes, motions, model)?.fit(
            &study.axes,
            terms,
            &ridge,
            &search,
        )?;
        Ok((effects, (base, ridge, effective_parameters)))
    })?;
    let rows = training_rows(prepared, study);
    let mut fits = model.fits.clone();
    for (index, fit) in fits.iter_mut().enumerate() {
        let acting = terms.iter().filter(|t| t.acts_on(index));
        let parameters: usize = acting.map(|t| t.entry.parameters().len()).sum();
        let (own, scale) = match &base {
            Base::Polynomial(polynomial) => {
                let coefficients = polynomial.coefficients[index].iter();
                (coefficients.filter(|c| **c != 0.0).count(), 1.0)
            }
            Base::Network(network) => (network.parameters(), rows),
            Base::None(_) => (0, 1.0),
        };
        fit.terms = own + parameters;
        fit.ridge = ridge[index] * scale;
        fit.effective_parameters = effective[index] + parameters as f64;
        fit.training_force_rms =
            prepared.training_force_rms(study, index, effects.inertia[index].value);
        fit.cross_validation_nmse_percent = None;
    }
    let mut warnings = model.warnings.clone();
    warnings.extend(effects.warnings);
    Ok(FitResult {
        state_input: model.state_input.clone(),
        base,
        effects: effect_terms(&study.axes, &effects.terms),
        inertia: effects.inertia,
        fit: model.fit.clone(),
        fits,
        warnings,
    })
}

fn training_rows(prepared: &Prepared, study: &Study) -> f64 {
    let motions = prepared.training(study);
    motions.iter().map(|m| m.rows()).sum::<usize>() as f64
}

/// Per axis, the strength of the penalty on a model's base, beside products that are means over the
/// rows.
pub(crate) fn strengths(prepared: &Prepared, study: &Study, model: &ModelFile) -> Vec<f64> {
    // α/β of a network stands beside sums over the rows it was trained on.
    let rows = match model.base {
        Base::Network(_) => training_rows(prepared, study),
        _ => 1.0,
    };
    model.fits.iter().map(|fit| fit.ridge / rows).collect()
}

/// Errors on blocks of the training records that the model's linear parameters were not fitted to.
///
/// # Errors
/// Records that leave the model's base undetermined.
pub(crate) fn held_out_errors(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
) -> Result<Vec<AxisError>> {
    // By more than a small part of a period the law of a delay, its first order, is none.
    let in_time = read_later(prepared, delays_of(model)?);
    let training = in_time.training(study);
    let mut terms: Vec<(AxisEffect, Vec<f64>)> = model
        .effects_in_si()?
        .into_iter()
        .map(|term| (AxisEffect::from(&term), term.values))
        .collect();
    let late = terms
        .iter_mut()
        .filter(|(term, _)| term.entry.about.name == DELAY);
    late.for_each(|(_, values)| values.fill(0.0));
    let ridge = strengths(prepared, study, model);
    Ok(OnRecords::new(&study.axes, &training, model)?.held_out_errors(&terms, &ridge))
}

/// What no model can go below, per axis, under the whole model.
fn floors(
    study: &Study,
    prepared: &Prepared,
    model: &ModelFile,
    inertia: &[f64],
) -> Result<Vec<noise_floor::Floor>> {
    let conventions: Vec<_> = study.axes.iter().map(|a| a.restoring_force).collect();
    let effects = model.effects_in_si()?;
    let predicted = |motion: &Motion| {
        let input = model.state_input.as_deref();
        let mut forces = model.base.predict(&motion.base_states(input))?;
        let history = TimeHistory::of_motion(motion, &conventions);
        add_forces(&effects, &history, &mut forces);
        Ok(forces)
    };
    let predicted = prepared
        .motions
        .iter()
        .map(predicted)
        .collect::<Result<_>>()?;
    let all: Vec<&Motion> = prepared.motions.iter().collect();
    let band = &model.filters.band;
    Ok(noise_floor::floors_under(
        &study.axes,
        &all,
        band,
        predicted,
        &effects,
        inertia,
    ))
}

/// Per axis the relative error that the noise alone makes: what no model can go below.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study is not the model's or has no training record.
pub(crate) fn noise_floors(study: &Study, model: &ModelFile) -> Result<PerAxis> {
    let prepared = Prepared::with_filters(study, model.filters.clone())?;
    let inertia = model.axes.iter();
    let inertia: Vec<f64> = inertia
        .map(|axis| axis.inertia - missing_inertia(&model.effects, &axis.name))
        .collect();
    let compared = compare::compare_motions(study, model, &prepared.motions)?;
    let role = match prepared.validation(study).is_empty() {
        true => Role::Train,
        false => Role::Validate,
    };
    let floors = floors(study, &prepared, model, &inertia)?;
    let axes = study.axes.iter().zip(floors);
    let relative = axes.map(|(axis, floor)| {
        let force = rms_force(&compared.records, role, &axis.name);
        (axis.name.clone(), floor.rms / force)
    });
    Ok(relative.collect())
}

/// RMS force of an axis over all records of a role.
fn rms_force(records: &[RecordFigures], role: Role, axis: &str) -> f64 {
    let (mut sum, mut rows) = (0.0, 0.0);
    for record in records.iter().filter(|r| r.role == role) {
        if let Some(figures) = record.axes.get(axis) {
            sum += record.rows as f64 * figures.rms_force * figures.rms_force;
            rows += record.rows as f64;
        }
    }
    f64::sqrt(sum / f64::max(rows, 1.0)).max(f64::MIN_POSITIVE)
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
        at_rest: after.at_rest,
    })
}
