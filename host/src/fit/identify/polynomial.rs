//! Learning the paper's polynomial from a study, and writing it as an equation.

use super::state_input::StateInput;
use super::{FitResult, Identified, Prepared};
use crate::fit::polynomial::{Method, PolynomialFit, PolynomialOptions, fit_polynomial};
use crate::model::file::{AxisFit, Base, ModelFile};
use crate::model::{ModelAxis, Polynomial, exponents};
use crate::study::{Axis, Study};
use crate::text::error::Result;
use crate::text::table::significant;

/// Learns a polynomial from the training records of a study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study has no training record or its records cannot
/// be fitted.
pub fn polynomial(
    study: &Study,
    options: &PolynomialOptions,
    progress: &dyn Fn(f64),
) -> Result<Identified> {
    study.check_has_time("a polynomial follows velocities", "use --model physical")?;
    let prepared = Prepared::new(study)?;
    let training = prepared.training(study);
    let chosen = StateInput::of(study, options.input.as_deref(), &training)?;
    let options = PolynomialOptions {
        input: chosen.name.clone(),
        ..options.clone()
    };
    let band = &prepared.filters.band;
    let fit = fit_polynomial(&study.axes, &training, band, &options, progress)?;
    let fit_result = FitResult::of_polynomial(&study.axes, fit, options.method, |axis, inertia| {
        prepared.training_force_rms(study, axis, inertia)
    });
    prepared.finish(study, chosen.told(fit_result))
}

impl Identified {
    /// The model as one equation per axis, for those with few enough terms to read.
    pub fn equations(&self) -> Vec<String> {
        equations(&self.model)
    }
}

/// The equations of a model's polynomial, an axis each, as far as they are short enough to read.
pub(crate) fn equations(model: &ModelFile) -> Vec<String> {
    let Base::Polynomial(polynomial) = &model.base else {
        return Vec::new();
    };
    let axes = model.axes.iter().enumerate();
    axes.filter_map(|(index, axis)| equation(polynomial, index, model, axis))
        .collect()
}

/// A polynomial with more terms than this is not printed as an equation.
const READABLE_TERMS: usize = 12;

/// `r_x [N] = 1.2 − 3.4·u − …` with every input's meaning, or nothing when it would not be
/// readable.
fn equation(
    polynomial: &Polynomial,
    index: usize,
    model: &ModelFile,
    axis: &ModelAxis,
) -> Option<String> {
    let coefficients = polynomial.coefficients.get(index)?;
    if coefficients.iter().filter(|c| **c != 0.0).count() > READABLE_TERMS {
        return None;
    }
    let axes = &model.axes;
    let input = model.state_input.iter().map(|name| format!("w_{name}"));
    let symbols: Vec<String> = axes
        .iter()
        .flat_map(|a| [format!("u_{}", a.name), format!("v_{}", a.name)])
        .chain(input)
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
        text.push_str(&format!("{lead}{}", significant(value.abs())));
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
        // An input has the unit that the study gives it.
        let (name, unit) = match (axes.get(state / 2), state % 2) {
            (Some(owner), 0) => (
                owner.name.clone(),
                format!(" {}", owner.kind.displacement_unit()),
            ),
            (Some(owner), _) => (
                format!("velocity of {}", owner.name),
                format!(" {}", owner.kind.velocity_unit()),
            ),
            (None, _) => (model.state_input.clone().unwrap_or_default(), String::new()),
        };
        let sign = if range.center < 0.0 { "+" } else { "−" };
        text.push_str(&format!(
            "\n    {symbol} = ({name} {sign} {:.4e}{unit}) / {:.4e}{unit}",
            range.center.abs(),
            range.half_range
        ));
    }
    Some(text)
}

impl FitResult {
    /// What the fit of a polynomial found; `force_rms` gives the RMS of an axis's force over the
    /// training rows, for its inertia.
    pub(super) fn of_polynomial(
        axes: &[Axis],
        fit: PolynomialFit,
        method: Method,
        force_rms: impl Fn(usize, f64) -> f64,
    ) -> Self {
        let fits = axes.iter().zip(&fit.axes).enumerate();
        let fits = fits.map(|(index, (axis, found))| AxisFit {
            axis: axis.name.clone(),
            terms: found.terms,
            ridge: found.lambda.unwrap_or(0.0),
            effective_parameters: found.effective_parameters,
            training_force_rms: force_rms(index, fit.inertia[index].value),
            cross_validation_nmse_percent: Some(found.cross_validation_nmse),
        });
        Self {
            fits: fits.collect(),
            base: Base::Polynomial(fit.polynomial),
            state_input: None,
            effects: Vec::new(),
            inertia: fit.inertia,
            fit: method.name().into(),
            warnings: fit.warnings,
        }
    }
}
