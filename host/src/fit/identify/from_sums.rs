//! Learning a model from sums of records, without the records.

use super::{FitResult, Identified, Prepared, take_errors};
use crate::fit::polynomial::PolynomialOptions;
use crate::fit::sums::Part;
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};

/// A polynomial of the summed records; `study`, when given, is what its errors are measured on.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when an inertia is not stated, the records have no time, the
/// sums determine nothing, or the study is another one.
pub fn polynomial(
    part: &Part,
    options: &PolynomialOptions,
    study: Option<&Study>,
) -> Result<Identified> {
    if part.plan().filters.quasi_static {
        return Err(Error::data(
            "a polynomial follows velocities, and these sums are of records without time (time = \"none\"); use --model physical",
        ));
    }
    let fit = part.polynomial(options)?;
    let axes = &part.plan().axes;
    let fit_result = FitResult::of_polynomial(axes, fit, options.method, |axis, inertia| {
        part.force_rms(axis, inertia)
    });
    finish(part, fit_result, study)
}

/// The effects of the summed study with the strengths that the sums give; `study`, when given, is
/// what its errors are measured on.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when an effect's shape has to be searched for, the sums
/// determine nothing, or the study is another one.
pub fn physical(part: &Part, study: Option<&Study>) -> Result<Identified> {
    let fit = part.physical()?;
    let axes = &part.plan().axes;
    let fit_result = FitResult::of_effects(axes, fit, part.ranges(), |axis, inertia| {
        part.force_rms(axis, inertia)
    });
    finish(part, fit_result, study)
}

/// The model with the summed records in its history, and its errors on a study's records when there
/// is one.
fn finish(part: &Part, fit_result: FitResult, study: Option<&Study>) -> Result<Identified> {
    let plan = part.plan();
    let inertia = fit_result.inertia.clone();
    let mut model = fit_result.model(&plan.study, &plan.axes, plan.filters.clone());
    model.records = part.records().to_vec();
    if let Some(study) = study {
        model.check_fits(study)?;
        let prepared = Prepared::with_filters(study, plan.filters.clone())?;
        take_errors(&mut model, study, &prepared.motions)?;
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
