//! Learning a model from sums of records, without the records.

use super::physical::{effect_terms, parameters_on};
use super::{FitResult, Identified, Prepared};
use crate::fit::errors::Evaluated;
use crate::fit::polynomial::PolynomialOptions;
use crate::fit::sums::Part;
use crate::model::file::{AxisFit, Base, NoBase};
use crate::study::{Role, Study};
use crate::text::error::Result;

/// A polynomial of the summed records; `study`, when given, is what its errors are measured on.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when an inertia is not stated, the sums determine nothing, or the study is another one.
pub fn polynomial(
    part: &Part,
    options: &PolynomialOptions,
    study: Option<&Study>,
) -> Result<Identified> {
    let fit = part.polynomial(options)?;
    let axes = part.plan().axes.iter().zip(&fit.axes).enumerate();
    let fits = axes.map(|(index, (axis, found))| AxisFit {
        axis: axis.name.clone(),
        terms: found.terms,
        ridge: found.lambda.unwrap_or(0.0),
        effective_parameters: found.effective_parameters,
        training_force_rms: part.force_rms(index, fit.inertia[index].value),
        cross_validation_nmse_percent: Some(found.cross_validation_nmse),
    });
    let fit_result = FitResult {
        fits: fits.collect(),
        base: Base::Polynomial(fit.polynomial),
        effects: Vec::new(),
        inertia: fit.inertia,
        fit: options.method.name().into(),
        warnings: fit.warnings,
    };
    finish(part, fit_result, study)
}

/// The effects of the summed study with the strengths that the sums give; `study`, when given, is what its errors are measured on.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when an effect's shape has to be searched for, the sums determine nothing, or the study is
/// another one.
pub fn physical(part: &Part, study: Option<&Study>) -> Result<Identified> {
    let fit = part.physical()?;
    let axes = &part.plan().axes;
    let fits = axes.iter().enumerate().map(|(index, axis)| AxisFit {
        axis: axis.name.clone(),
        terms: parameters_on(&fit, index),
        ridge: 0.0,
        effective_parameters: parameters_on(&fit, index) as f64,
        training_force_rms: part.force_rms(index, fit.inertia[index].value),
        cross_validation_nmse_percent: None,
    });
    let fit_result = FitResult {
        fits: fits.collect(),
        base: Base::None(NoBase {
            inputs: part.ranges(),
        }),
        effects: effect_terms(axes, &fit.terms),
        inertia: fit.inertia,
        fit: "variable projection".into(),
        warnings: fit.warnings,
    };
    finish(part, fit_result, study)
}

/// The model with the summed records in its history, and its errors on a study's records when there is one.
fn finish(part: &Part, fit_result: FitResult, study: Option<&Study>) -> Result<Identified> {
    let plan = part.plan();
    let inertia = fit_result.inertia.clone();
    let mut model = fit_result.model(&plan.study, &plan.axes, plan.filters.clone());
    model.records = part.records().to_vec();
    if let Some(study) = study {
        model.check_fits(study)?;
        let prepared = Prepared::with_filters(study, plan.filters.clone())?;
        let evaluated = Evaluated::as_logged(study, &model, &prepared.motions)?;
        let [verification, validation] =
            [Role::Train, Role::Validate].map(|role| evaluated.pooled(role));
        model.verification = verification;
        model.validation = validation;
        let judged = study.sources.iter().filter(|s| s.role == Role::Validate);
        model.records.extend(judged.cloned());
    }
    let what = format!(
        "identified: {}, {} fit to the sums of {} records, {} rows",
        model.base.name(),
        model.fit,
        part.records().len(),
        part.rows()
    );
    Identified::new(model, inertia, what)
}
