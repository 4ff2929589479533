//! Learning a sum of named physical effects from a study.

use super::{FitResult, Identified, Prepared};
use crate::fit::effects::{AnotherStart, EffectsFit, FittedEffect, fit_effects_also_from};
use crate::fit::polynomial::input_ranges;
use crate::fit::stretches::Stretches;
use crate::model::corrections::Corrections;
use crate::model::effects::AxisEffect;
use crate::model::file::{AxisFit, Base, NoBase};
use crate::model::{InputRange, ModelEffect};
use crate::signal::motion::{self, Motion};
use crate::study::{Axis, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::axis::AxisKind;
use jointwatch_shared::base::corrections::ForceCorrection;

/// How often late channels are shifted before the last fit, at least and at most.
const SHIFTS: [usize; 2] = [2, 12];
/// Samples that a shift may leave for that fit.
const LEFT: f64 = 0.02;
/// What is believed of an axis when the study says nothing.
const DEFAULT_TERMS: [&str; 3] = ["stiffness", "viscous", "preload"];
/// The same where there is no time.
const QUASI_STATIC_TERMS: [&str; 3] = ["stiffness", "coulomb", "preload"];

/// Learns the values of the study's `[base] terms`, or of a spring, a damper and a constant force
/// where it names none.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when a term is not known, stands twice or names an axis that
/// is not there, when the study has no training record or its records cannot be fitted.
pub fn physical(study: &Study) -> Result<Identified> {
    let (terms, proposed) = base_terms(study)?;
    let prepared = Prepared::new(study)?;
    let mut fit = fit_alone(study, &prepared, &terms, &|_| Ok(None))?;
    if let Some(proposed) = proposed {
        fit.warnings.insert(0, proposed);
    }
    prepared.physical(study, fit)
}

impl Prepared {
    /// The model that a fit of effects makes, with its errors on every record.
    ///
    /// # Errors
    /// As [`Prepared::finish`].
    pub(crate) fn physical(self, study: &Study, fit: EffectsFit) -> Result<Identified> {
        let fit_result = self.fit_result(study, fit);
        self.finish(study, fit_result)
    }

    /// What a fit of effects alone found.
    pub(crate) fn fit_result(&self, study: &Study, fit: EffectsFit) -> FitResult {
        let training = self.training(study);
        let inputs = input_ranges(&training, None);
        FitResult::of_effects(&study.axes, fit, inputs, |axis, inertia| {
            self.training_force_rms(study, axis, inertia)
        })
    }
}

/// Fits effects alone, with late channels put in time; from one more start than a scan of the
/// effects' own values finds.
///
/// # Errors
/// As [`fit_effects_also_from`].
pub(crate) fn fit_alone(
    study: &Study,
    prepared: &Prepared,
    terms: &[AxisEffect],
    another: AnotherStart<'_>,
) -> Result<EffectsFit> {
    let band = &prepared.filters.band;
    let fit = |motions: &[&Motion]| {
        let fit = fit_effects_also_from(&study.axes, motions, band, terms, another)?;
        Ok((fit, ()))
    };
    Ok(fit_in_time(study, prepared, fit)?.0)
}

/// Fits by `fit` to the training records; where force channels may be late, again with the channels
/// put in time. Of very many rows some stretches are enough.
///
/// The law of a delay is the first order of a shift. What the second order leaves would be taken
/// for a wrong gain, so the channels are shifted by what was found and the rest is found anew
/// (Gauss–Newton), until next to nothing is left: of a delay that is much of a period in the band,
/// one step finds a part.
pub(crate) fn fit_in_time<T>(
    study: &Study,
    prepared: &Prepared,
    fit_to: impl Fn(&[&Motion]) -> Result<(EffectsFit, T)>,
) -> Result<(EffectsFit, T)> {
    let training = prepared.training(study);
    let rows: Vec<usize> = training.iter().map(|motion| motion.rows()).collect();
    let stretches = Stretches::of(&rows);
    let (mut fit, mut more) = match &stretches {
        None => fit_to(&training)?,
        Some(stretches) => {
            let motions = training.iter().enumerate();
            let motions: Vec<Motion> = motions.flat_map(|(n, m)| stretches.cut(n, m)).collect();
            fit_to(&motions.iter().collect::<Vec<_>>())?
        }
    };
    let said = stretches.as_ref().map(|s| s.in_words(rows.iter().sum()));
    let late = |term: &FittedEffect| term.bound.entry.about.name == "time_delay";
    if !fit.terms.iter().any(late) {
        fit.warnings.extend(said);
        return Ok((fit, more));
    }
    let mut delays = Corrections {
        force: [ForceCorrection::NONE; 2],
        per_record: Vec::new(),
    };
    let [least, most] = SHIFTS;
    for shifts in 0..most {
        let rest = fit.terms.iter().filter(|term| late(term));
        let rest = rest.map(|term| term.values[0].abs() * study.sample_rate_hz);
        if shifts >= least && rest.fold(0.0, f64::max) < LEFT {
            break;
        }
        for term in fit.terms.iter().filter(|term| late(term)) {
            delays.force[term.bound.axis].delay_s += term.values[0];
        }
        let in_time = |(n, motion): (usize, &&Motion)| {
            let record = delays.record(&study.records[motion.record], study.sample_rate_hz);
            let motion = motion::motion(study, motion.record, &record, &prepared.filters)?;
            Ok(match &stretches {
                None => vec![motion],
                Some(stretches) => stretches.cut(n, &motion),
            })
        };
        let motions: Vec<Vec<Motion>> = training
            .iter()
            .enumerate()
            .map(in_time)
            .collect::<Result<_>>()?;
        let motions: Vec<&Motion> = motions.iter().flatten().collect();
        (fit, more) = fit_to(&motions)?;
    }
    fit.warnings.extend(said);
    for term in fit.terms.iter_mut().filter(|term| late(term)) {
        let shifted = delays.force[term.bound.axis].delay_s;
        term.values[0] += shifted;
        for end in term.intervals.iter_mut().flatten().flatten() {
            *end += shifted;
        }
    }
    Ok((fit, more))
}

/// The study's terms; or proposed ones, and the sentence that says so.
pub(crate) fn base_terms(study: &Study) -> Result<(Vec<AxisEffect>, Option<String>)> {
    let axes: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let mut terms = study.base_terms.clone();
    let mut proposed = None;
    if terms.is_empty() {
        let default = match study.quasi_static {
            true => QUASI_STATIC_TERMS,
            false => DEFAULT_TERMS,
        };
        for axis in &axes {
            terms.extend(default.map(|effect| format!("{effect}@{axis}")));
        }
        let quoted: Vec<String> = terms.iter().map(|t| format!("\"{t}\"")).collect();
        proposed = Some(format!(
            "study.toml names no physical effects, so these were taken: write them there, or better ones, as [base] terms = [{}]",
            quoted.join(", ")
        ));
    }
    let bound = AxisEffect::parse_all(&terms, &axes).map_err(|e| Error {
        sentence: format!("{}, [base] terms: {e}", study.path.display()),
        ..e
    })?;
    for term in &bound {
        term.check_in(study, &axes)?;
    }
    Ok((bound, proposed))
}

/// Parameters of the effects that act on an axis.
fn parameters_on(fit: &EffectsFit, axis: usize) -> usize {
    let acting = fit.terms.iter().filter(|t| t.bound.acts_on(axis));
    acting.map(|t| t.values.len()).sum()
}

/// Found terms as the model file keeps them.
pub(crate) fn effect_terms(axes: &[Axis], terms: &[FittedEffect]) -> Vec<ModelEffect> {
    let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
    let kinds: Vec<AxisKind> = axes.iter().map(|a| a.kind.into()).collect();
    let terms = terms.iter();
    terms
        .map(|term| ModelEffect::new(&term.bound, &names, &kinds, &term.values, &term.intervals))
        .collect()
}

impl FitResult {
    /// What a fit of effects alone found, over these ranges of the states; `force_rms` gives the
    /// RMS of an axis's force over the training rows, for its inertia.
    pub(super) fn of_effects(
        axes: &[Axis],
        fit: EffectsFit,
        inputs: Vec<InputRange>,
        force_rms: impl Fn(usize, f64) -> f64,
    ) -> Self {
        let fits = axes.iter().enumerate().map(|(index, axis)| {
            let parameters = parameters_on(&fit, index);
            AxisFit {
                axis: axis.name.clone(),
                terms: parameters,
                ridge: 0.0,
                effective_parameters: parameters as f64,
                training_force_rms: force_rms(index, fit.inertia[index].value),
                cross_validation_nmse_percent: None,
            }
        });
        Self {
            fits: fits.collect(),
            base: Base::None(NoBase { inputs }),
            state_input: None,
            effects: effect_terms(axes, &fit.terms),
            inertia: fit.inertia,
            fit: "variable projection".into(),
            warnings: fit.warnings,
        }
    }
}
