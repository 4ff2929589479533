//! From a study to a model: derivatives, restoring force, fit, and the errors on every record.

use crate::compare;
use crate::error::{Error, Result};
use crate::fit::coverage;
use crate::fit::polynomial::{self, PolynomialFit, PolynomialOptions};
use crate::model::{ModelAxis, Polynomial, exponents};
use crate::model_file::{AxisFit, Base, FORMAT, HistoryEntry, ModelFile};
use crate::motion::{self, Filters, Motion};
use crate::study::{Convention, Role, Study};

/// A model, and what identification had to say about it.
pub struct Identified {
    /// The model.
    pub model: ModelFile,
    fit: PolynomialFit,
}

impl Identified {
    /// Standard error of an identified inertia, kg or kg·m²; none for one that the study gave.
    pub fn inertia_error(&self, axis: &str) -> Option<f64> {
        let at = self.model.axes.iter().position(|a| a.name == axis);
        at.and_then(|at| self.fit.inertia.get(at))
            .and_then(|inertia| inertia.standard_error)
    }

    /// The model as one equation per axis, for those with few enough terms to read.
    pub fn equations(&self) -> Vec<String> {
        let Base::Polynomial(polynomial) = &self.model.base;
        let axes = self.model.axes.iter().enumerate();
        axes.filter_map(|(index, axis)| equation(polynomial, index, &self.model.axes, axis))
            .collect()
    }
}

/// Learns a polynomial from the training records of a study.
///
/// # Errors
/// [`crate::error::Kind::Data`] when the study has no training record or its records cannot be fitted.
pub fn polynomial(
    study: &Study,
    options: &PolynomialOptions,
    progress: &dyn Fn(f64),
) -> Result<Identified> {
    let filters = Filters::design(study)?;
    let motions = motion::motions(study, &filters)?;
    let training: Vec<&Motion> = motions
        .iter()
        .filter(|m| study.records[m.record].role == Role::Train)
        .collect();
    if training.is_empty() {
        return Err(Error::data(format!(
            "{}: no record has role = \"train\", so there is nothing to learn from; give at least one",
            study.path.display()
        )));
    }
    let fit = polynomial::fit_polynomial(&study.axes, &training, &filters.band, options, progress)?;

    let validation: Vec<&Motion> = motions
        .iter()
        .filter(|m| study.records[m.record].role == Role::Validate)
        .collect();
    let mut warnings = fit.warnings.clone();
    warnings.extend(coverage::validation_warnings(
        &study.axes,
        &training,
        &validation,
    ));

    let axes = study
        .axes
        .iter()
        .zip(&fit.inertia)
        .map(|(axis, inertia)| ModelAxis {
            name: axis.name.clone(),
            kind: axis.kind,
            inertia: inertia.value,
            inertia_identified: inertia.identified,
            restoring_force: axis.restoring_force,
        });
    let fits = study
        .axes
        .iter()
        .enumerate()
        .zip(&fit.axes)
        .map(|((index, axis), found)| AxisFit {
            axis: axis.name.clone(),
            terms: found.terms,
            ridge: found.lambda.unwrap_or(0.0),
            effective_parameters: found.effective_parameters,
            training_force_rms: training_force_rms(
                &training,
                index,
                fit.inertia[index].value,
                axis.restoring_force,
            ),
            cross_validation_nmse_percent: found.cross_validation_nmse,
        });
    let mut model = ModelFile {
        format: FORMAT.into(),
        study: study.name.clone(),
        axes: axes.collect(),
        base: Base::Polynomial(fit.polynomial.clone()),
        fit: options.method.name().into(),
        fits: fits.collect(),
        warnings,
        verification: Vec::new(),
        validation: Vec::new(),
        history: Vec::new(),
        filters,
    };
    let comparison = compare::compare_motions(study, &model, &motions)?;
    model.verification = comparison.verification;
    model.validation = comparison.validation;
    model.history.push(HistoryEntry {
        what: format!("identified: polynomial, {} fit", model.fit),
        validation: model.validation.clone(),
    });
    Ok(Identified { model, fit })
}

/// RMS of the restoring force of one axis over all training rows, N or N·m.
fn training_force_rms(
    training: &[&Motion],
    axis: usize,
    inertia: f64,
    convention: Convention,
) -> f64 {
    let (mut sum, mut rows) = (0.0, 0);
    for motion in training {
        let force = motion.restoring_force(axis, inertia, convention);
        sum += force.iter().map(|r| r * r).sum::<f64>();
        rows += force.len();
    }
    (sum / rows as f64).sqrt()
}

/// A polynomial with more terms than this is not printed as an equation.
const READABLE_TERMS: usize = 12;

/// `r_x [N] = 1.2 − 3.4·u − …` with every input's meaning, or nothing when it would not be readable.
fn equation(
    polynomial: &Polynomial,
    index: usize,
    axes: &[ModelAxis],
    axis: &ModelAxis,
) -> Option<String> {
    let coefficients = polynomial.coefficients.get(index)?;
    if coefficients.iter().filter(|c| **c != 0.0).count() > READABLE_TERMS {
        return None;
    }
    let symbols: Vec<String> = axes
        .iter()
        .flat_map(|a| [format!("u_{}", a.name), format!("v_{}", a.name)])
        .collect();
    let mut text = format!("\n  r_{} [{}] =", axis.name, axis.kind.force_unit());
    let terms = exponents(&polynomial.orders);
    let mut written = false;
    for (at, &value) in coefficients.iter().enumerate() {
        if value == 0.0 {
            continue;
        }
        let sign = if value < 0.0 { "−" } else { "+" };
        let lead = if written || value < 0.0 {
            format!(" {sign} ")
        } else {
            " ".into()
        };
        text.push_str(&format!("{lead}{:.6}", value.abs()));
        for (symbol, exponent) in symbols.iter().zip(terms[at]) {
            match exponent {
                0 => {}
                1 => text.push_str(&format!("·{symbol}")),
                _ => text.push_str(&format!(
                    "·{symbol}{}",
                    ["⁰", "¹", "²", "³"][exponent as usize]
                )),
            }
        }
        written = true;
    }
    if !written {
        text.push_str(" 0");
    }
    text.push_str("\n  with");
    for (state, (symbol, range)) in symbols.iter().zip(&polynomial.inputs).enumerate() {
        let used = terms
            .iter()
            .zip(coefficients)
            .any(|(exponents, &c)| c != 0.0 && exponents[state] > 0);
        if !used {
            continue;
        }
        let owner = &axes[state / 2];
        let (name, unit) = if state % 2 == 0 {
            (owner.name.clone(), owner.kind.displacement_unit())
        } else {
            (
                format!("velocity of {}", owner.name),
                owner.kind.velocity_unit(),
            )
        };
        let sign = if range.center < 0.0 { "+" } else { "−" };
        text.push_str(&format!(
            "\n    {symbol} = ({name} {sign} {:.4e} {unit}) / {:.4e} {unit}",
            range.center.abs(),
            range.half_range
        ));
    }
    Some(text)
}
