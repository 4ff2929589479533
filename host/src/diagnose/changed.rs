//! What is different in a joint now: a model of before, held against records taken since, and
//! against what these records give.

use super::{Found, Verdict, diagnose};
use crate::assess::compare;
use crate::fit::identify::{Prepared, base_terms, fit_alone};
use crate::model::ModelEffect;
use crate::model::file::{AxisError, Base, ModelFile};
use crate::study::{Record, Role, Source, Study};
use crate::text::error::{Error, Result};
use serde::Serialize;

/// The old model's error has grown when it is this many times what it was on its own validation
/// records: records of one joint differ by less.
const GREW: f64 = 1.5;

/// Everything `changed` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Changed {
    /// The records of the study, and which of them the old model has seen.
    pub records: Vec<SeenRecord>,
    /// Where the new values come from, as in a sentence.
    pub new_values_from: Option<String>,
    /// The old model's error then and now, per axis.
    pub errors: Vec<ErrorThenNow>,
    /// Parameters of effects that both models have.
    pub parameters: Vec<ParameterChange>,
    /// Effects that the joint has now and had not.
    pub came: Vec<String>,
    /// Effects that it had and has no longer.
    pub went: Vec<String>,
    /// What to be wary of, one sentence each.
    pub notes: Vec<String>,
}

/// One record of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeenRecord {
    /// The record's file, as the study names it.
    pub file: String,
    /// What the old model used it for; none for a new record.
    pub seen_as: Option<Role>,
}

/// The old model's error on one axis, RMS error over RMS force and NMSE.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorThenNow {
    /// Name of the axis.
    pub axis: String,
    /// On its own validation records, when it was made; none where it had none.
    pub then: Option<AxisError>,
    /// On the new records.
    pub now: AxisError,
    /// Whether it has grown by more than records of one joint differ.
    pub grew: bool,
}

/// One parameter, before and now.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterChange {
    /// The effect and its axis: `stiffness@x`.
    pub effect: String,
    /// The parameter's name, as the effect lists it.
    pub name: String,
    /// The SI unit of the values; – for a number without one.
    pub unit: String,
    /// The old model's value.
    pub old: f64,
    /// The value that the new records give.
    pub new: f64,
    /// New value less old one, in `unit`.
    pub difference: f64,
    /// What the difference may be, by the two 95 % intervals; none where a model states none.
    pub interval: Option<[f64; 2]>,
    /// Whether the difference counts: the two intervals do not overlap. None where they are not
    /// known.
    pub counts: Option<bool>,
}

/// The joint as it is now.
pub struct Now {
    /// The study with the new records alone.
    pub study: Study,
    /// A model of it: the new one that was given, or the old one's effects fitted anew.
    pub model: Option<ModelFile>,
}

/// Holds a model against records taken since. Without a `new` model, the effects of the old one are
/// fitted anew to the new records.
///
/// # Errors
/// [`crate::text::error::Kind::Data`]: a study that is not the model's, or whose records are all
/// those that it was made with.
pub fn changed(study: &Study, old: &ModelFile, new: Option<&ModelFile>) -> Result<(Changed, Now)> {
    old.check_fits(study)?;
    let mut notes = Vec::new();
    let seen: Vec<Option<Role>> = study.sources.iter().map(|s| seen_as(s, old)).collect();
    let records = study.sources.iter().zip(&seen);
    let records: Vec<SeenRecord> = records
        .map(|(source, seen)| SeenRecord {
            file: source.file.clone(),
            seen_as: *seen,
        })
        .collect();
    let fresh = fresh(study, &seen)?;
    if old.records.is_empty() {
        notes.push(
            "the old model does not say which records it was made with, so that all of these count as new".to_owned(),
        );
    }
    let errors = errors(&fresh, old, &mut notes)?;
    let mut changed = Changed {
        records,
        new_values_from: None,
        errors,
        parameters: Vec::new(),
        came: Vec::new(),
        went: Vec::new(),
        notes: Vec::new(),
    };
    let mut model = new.cloned();
    match new {
        Some(new) => {
            changed.new_values_from = Some("the new model".into());
            changed.compare_effects(&old.effects, new);
        }
        None if matches!(old.base, Base::None(_)) => {
            let learnt_from = learning(&fresh, &mut notes);
            let new = refitted(&learnt_from, old)?;
            changed.new_values_from =
                Some("the same effects, fitted anew to the new records".into());
            changed.compare_effects(&old.effects, &new);
            let diagnosis = diagnose(&learnt_from, &new)?;
            match diagnosis.verdict {
                Verdict::Effect => {
                    let found = diagnosis.found.iter();
                    changed
                        .came
                        .extend(found.map(Found::name));
                }
                Verdict::None => {}
                Verdict::Unknown => notes.push(
                    "something else has come that no effect of the library explains".to_owned(),
                ),
                Verdict::Data => notes.extend(diagnosis.data_problems),
            }
            model = Some(new);
        }
        None => notes.push(format!(
            "the old model's base is a {}, whose coefficients have no meaning of their own; give a new physical model, or diagnose \
             the new records, to see what changed",
            old.base.name()
        )),
    }
    changed.notes = notes;
    let now = Now {
        study: fresh,
        model,
    };
    Ok((changed, now))
}

/// The parameters of a model that are others on records which it has not seen: what a diagnosis
/// finds anew in silence. None where a record was seen, the model has no effects alone, or there is
/// nothing to learn from.
///
/// # Errors
/// [`crate::text::error::Kind::Data`]: a study that is not the model's.
pub fn moved(study: &Study, old: &ModelFile) -> Result<Vec<ParameterChange>> {
    let seen = study.sources.iter().any(|s| seen_as(s, old).is_some());
    let learns = study.records.iter().any(|r| r.role == Role::Train);
    if seen || old.records.is_empty() || !learns || !matches!(old.base, Base::None(_)) {
        return Ok(Vec::new());
    }
    old.check_fits(study)?;
    let new = refitted(study, old)?;
    let pairs = old.effects.iter().zip(&new.effects);
    let all = pairs.flat_map(|(was, is)| parameters(&was.name(), was, is));
    Ok(all.filter(|p| p.counts == Some(true)).collect())
}

/// What a model used a record for: the same file with rows in common.
fn seen_as(source: &Source, old: &ModelFile) -> Option<Role> {
    let same = |known: &&Source| {
        known.sha256 == source.sha256
            && known.rows[0].max(source.rows[0]) < known.rows[1].min(source.rows[1])
    };
    let seen = || old.records.iter().filter(same).map(|known| known.role);
    seen().find(|role| *role == Role::Train).or(seen().next())
}

/// The study with the records that the old model has not seen.
fn fresh(study: &Study, seen: &[Option<Role>]) -> Result<Study> {
    let mut fresh = study.clone();
    let is_known = |record: &Record| {
        let sources = study.sources.iter().zip(seen);
        let mut its = sources.filter(|(s, _)| s.file == record.file && s.role == record.role);
        let several = its.clone().nth(1).is_some();
        // A file may stand there twice, with rows that the old model has learnt from and with
        // others.
        let is_it = |s: &Source| !several || (s.rows[0]..s.rows[1]).contains(&record.first_row);
        its.any(|(s, seen)| seen.is_some() && is_it(s))
    };
    fresh.records.retain(|record| !is_known(record));
    let sources = study.sources.iter().zip(seen);
    let unseen = sources.filter(|(_, seen)| seen.is_none());
    fresh.sources = unseen.map(|(source, _)| source.clone()).collect();
    if fresh.records.is_empty() {
        return Err(Error::data(format!(
            "{}: all its records are those that the old model was made with, so that nothing can have changed; add records of the \
             joint as it is now",
            study.path.display()
        )));
    }
    Ok(fresh)
}

/// The old model's errors on all new records together.
fn errors(fresh: &Study, old: &ModelFile, notes: &mut Vec<String>) -> Result<Vec<ErrorThenNow>> {
    let mut judged = fresh.clone();
    for record in &mut judged.records {
        // The old model has learnt from none of them.
        record.role = Role::Validate;
    }
    let now = compare::compare(&judged, old)?.validation;
    if old.validation.is_empty() {
        notes.push(
            "the old model had no validation records, so that nothing says how well it did then"
                .to_owned(),
        );
    }
    Ok(now
        .into_iter()
        .map(|now| {
            let then = old.validation.iter().find(|then| then.axis == now.axis);
            ErrorThenNow {
                axis: now.axis.clone(),
                grew: then.is_some_and(|then| now.relative_error > GREW * then.relative_error),
                then: then.cloned(),
                now,
            }
        })
        .collect())
}

/// The study to learn the new values from: its training records, or all where it has none.
fn learning(fresh: &Study, notes: &mut Vec<String>) -> Study {
    let mut study = fresh.clone();
    if study.records.iter().all(|r| r.role == Role::Validate) {
        notes.push(
            "no new record has role = \"train\": the new values are learnt from all of them, and nothing is left to validate them on"
                .to_owned(),
        );
        study.records.iter_mut().for_each(|r| r.role = Role::Train);
    }
    study
}

/// The old model's effects, fitted anew in its own band.
fn refitted(study: &Study, old: &ModelFile) -> Result<ModelFile> {
    let mut study = study.clone();
    study.base_terms = old.effects.iter().map(ModelEffect::name).collect();
    let (terms, _) = base_terms(&study)?;
    let prepared = Prepared::with_filters(&study, old.filters.clone())?;
    let fit = fit_alone(&study, &prepared, &terms, &|_| Ok(None))?;
    Ok(prepared.physical(&study, fit)?.model)
}

impl ParameterChange {
    /// “stiffness of stiffness@x by +40.0 %”.
    pub fn in_words(&self) -> String {
        format!(
            "{} of {} by {:+.1} %",
            self.name.replace('_', " "),
            self.effect,
            100.0 * self.difference / self.old.abs()
        )
    }
}

impl Changed {
    fn compare_effects(&mut self, old: &[ModelEffect], new: &ModelFile) {
        for was in old {
            let name = was.name();
            match new.effects.iter().find(|e| e.name() == name) {
                Some(is) => self.parameters.extend(parameters(&name, was, is)),
                None => self.went.push(name),
            }
        }
        let known = |e: &ModelEffect| old.iter().any(|was| was.name() == e.name());
        let came = new.effects.iter().filter(|e| !known(e));
        self.came.extend(came.map(ModelEffect::name));
    }

    /// What changed, in a sentence.
    pub fn in_a_sentence(&self) -> String {
        let counted = self.parameters.iter().filter(|p| p.counts == Some(true));
        let mut parts: Vec<String> = counted.map(ParameterChange::in_words).collect();
        parts.extend(self.came.iter().map(|e| format!("{e} has come")));
        parts.extend(self.went.iter().map(|e| format!("{e} has gone")));
        let grew = self.errors.iter().any(|e| e.grew);
        match (parts.is_empty(), grew) {
            (false, _) => format!("Changed: {}.", parts.join("; ")),
            (true, true) => "The old model no longer describes the joint, but what changed is not told by its parameters.".into(),
            (true, false) => "Nothing has changed that these records could tell.".into(),
        }
    }
}

fn parameters(name: &str, was: &ModelEffect, is: &ModelEffect) -> Vec<ParameterChange> {
    let pairs = was.parameters.iter().zip(&is.parameters);
    pairs
        .map(|(was, is)| {
            let ends = was.interval.zip(is.interval);
            let interval = ends.map(|(was, is)| [is[0] - was[1], is[1] - was[0]]);
            ParameterChange {
                effect: name.to_owned(),
                name: is.name.clone(),
                unit: is.unit.clone(),
                old: was.value,
                new: is.value,
                difference: is.value - was.value,
                interval,
                counts: interval.map(|[low, high]| low > 0.0 || high < 0.0),
            }
        })
        .collect()
}
