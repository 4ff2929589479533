//! Fitting the paper's polynomial (Eqs. 10 and 11) to training records.

pub(in crate::fit) mod legendre;
pub(in crate::fit) mod ridge;
mod select;

use super::coverage::training_warnings;
use super::cross_validation::{FOLDS, FoldedMoments, Folds, guard_rows, squared_error};
use super::inertia::{Inertia, inertias};
use super::least_squares::normal_equations;
use crate::model::{InputRange, Polynomial, exponents};
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::study::series::extent;
use crate::text::error::{Error, Result};
use crate::text::table::short;

/// How the coefficients are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// With a penalty on the function's size and roughness over the whole input box;
    /// cross-validation picks its strength.
    #[default]
    Ridge,
    /// Plain least squares, as in the paper.
    LeastSquares,
    /// Few terms, chosen by orthogonal forward selection; cross-validation picks their number.
    Select,
}

impl Method {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ridge => "ridge",
            Self::LeastSquares => "least-squares",
            Self::Select => "select",
        }
    }
}

/// Orders, method and ridge of a polynomial fit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PolynomialOptions {
    /// Highest exponent of each input, 0 to 3; `None` is 3 for all, as in the paper.
    pub orders: Option<Vec<u8>>,
    /// How the terms are selected and regularised.
    pub method: Method,
    /// The input of the study that is the third state of a polynomial of one axis.
    /// `identify::polynomial` takes the study's only one where this is `None`, and none for
    /// `none`.
    pub input: Option<String>,
}

/// What the fit of one axis tells about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisFit {
    /// Strength λ of the penalty (no unit); `None` unless [`Method::Ridge`].
    pub lambda: Option<f64>,
    /// Parameters that the data, not the penalty, determine.
    pub effective_parameters: f64,
    /// Terms in the model.
    pub terms: usize,
    /// NMSE over held-out blocks, percent.
    pub cross_validation_nmse: f64,
}

/// A fitted polynomial and what is to be known about it.
#[derive(Clone, Debug, PartialEq)]
pub struct PolynomialFit {
    /// The polynomial of every axis, with the normalisation of its inputs.
    pub polynomial: Polynomial,
    /// Per axis, stated or identified.
    pub inertia: Vec<Inertia>,
    /// What was found per axis, in the study's order.
    pub axes: Vec<AxisFit>,
    /// Directions among the terms that the records determine; the number of terms when all are.
    pub rank: usize,
    /// Condition number of the terms over the training rows, each scaled to length 1.
    pub condition: f64,
    /// Rows that were fitted to.
    pub rows: usize,
    /// Why the model may not generalise, one sentence each.
    pub warnings: Vec<String>,
}

/// The middle and half the width of what each input went through over all records together.
///
/// The paper normalises to zero mean and ±1. The middle of the range rather than the mean puts the
/// largest values of both signs at exactly ±1, as the device's numbers need it; for motion about a
/// rest position the two agree. An input that never moves keeps a half range of 1.
///
/// `input` names the input of the study that is an input of the model, the last.
pub fn input_ranges(motions: &[&Motion], input: Option<&str>) -> Vec<InputRange> {
    let states: Vec<Vec<&[f64]>> = motions.iter().map(|m| m.base_states(input)).collect();
    let inputs = states.first().map_or(0, Vec::len);
    (0..inputs)
        .map(|at| {
            let values = states.iter().filter_map(|s| s.get(at)).copied().flatten();
            range(extent(values.copied()))
        })
        .collect()
}

/// The range of an input that went from one of the `ends` to the other.
pub(super) fn range(ends: [f64; 2]) -> InputRange {
    let range = InputRange::of(ends);
    match range.half_range > 0.0 {
        true => range,
        false => InputRange {
            half_range: 1.0,
            ..range
        },
    }
}

impl PolynomialOptions {
    /// The highest exponent of each input of these axes.
    fn orders_for(&self, axes: &[Axis]) -> Result<Vec<u8>> {
        let states = 2 * axes.len() + usize::from(self.input.is_some());
        let orders = self.orders.clone().unwrap_or_else(|| vec![3; states]);
        if orders.len() != states || orders.iter().any(|order| *order > 3) {
            let input = self.input.as_ref();
            let and_input = input.map_or(String::new(), |name| format!(", and the input {name:?}"));
            return Err(Error::usage(format!(
                "--order has {} numbers where this study needs {states} from 0 to 3, one per state (displacement and velocity of each axis\
                 {and_input}); give e.g. --order {}",
                orders.len(),
                vec!["3"; states].join(",")
            )));
        }
        Ok(orders)
    }
}

/// Whether the training records fit the axes, are long enough for any fit and hold only finite
/// numbers.
///
/// # Errors
/// One sentence that names the record and the row.
pub(crate) fn check_records(axes: &[Axis], motions: &[&Motion]) -> Result<()> {
    if !matches!(axes.len(), 1 | 2) {
        return Err(Error::data(format!(
            "a joint has one or two axes, not {}",
            axes.len()
        )));
    }
    if motions.is_empty() {
        return Err(Error::data(
            "the study has no training record: give at least one [[record]] the role \"train\"",
        ));
    }
    for motion in motions {
        let rows = motion.acceleration.first().map_or(0, Vec::len);
        let mut series = motion
            .states
            .iter()
            .chain(&motion.acceleration)
            .chain(&motion.force);
        if motion.states.len() != 2 * axes.len()
            || motion.acceleration.len() != axes.len()
            || motion.force.len() != axes.len()
            || series.any(|s| s.len() != rows)
        {
            return Err(Error::data(format!(
                "record {} does not hold the same series for each of the study's axes",
                motion.record + 1
            )));
        }
        if rows < 4 * FOLDS {
            return Err(Error::data(format!(
                "record {} has {rows} usable rows, too few to fit: record longer",
                motion.record + 1
            )));
        }
        let mut series = motion
            .states
            .iter()
            .chain(&motion.acceleration)
            .chain(&motion.force);
        if let Some(row) = series.find_map(|s| s.iter().position(|v| !v.is_finite())) {
            return Err(Error::data(format!(
                "record {} holds a number that is not finite at row {}",
                motion.record + 1,
                motion.first_row + row
            )));
        }
    }
    Ok(())
}

/// Fits the polynomial restoring force of every axis to the training records `motions`.
///
/// `low_pass` are the taps of the study's symmetric low-pass; it is needed only where an inertia is
/// to be identified, and sets the guard between the blocks of the cross-validation. `progress` is
/// told the share done, 0 to 1.
///
/// # Errors
/// One sentence: orders that do not fit the axes, no training record, records that do not fit the
/// axes or are too short, an identified inertia that is not positive, data that determine nothing.
pub fn fit_polynomial(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    options: &PolynomialOptions,
    progress: &dyn Fn(f64),
) -> Result<PolynomialFit> {
    check_records(axes, motions)?;
    options.orders_for(axes)?;
    let input = options.input.as_deref();
    let ranges = input_ranges(motions, input);
    let inertia = inertias(axes, motions, (&ranges, input), low_pass)?;
    progress(0.2);
    let guard = guard_rows(motions[0].sample_rate_hz, low_pass);
    let mut folded = FoldedMoments::new(&ranges, axes.len(), guard);
    for motion in motions {
        let motion = motion.moving();
        let forces: Vec<Vec<f64>> = axes
            .iter()
            .zip(&inertia)
            .enumerate()
            .map(|(i, (axis, inertia))| {
                motion.restoring_force(i, inertia.value, axis.restoring_force)
            })
            .collect();
        let forces: Vec<&[f64]> = forces.iter().map(Vec::as_slice).collect();
        folded.add_record(&motion.base_states(input), &forces);
    }
    progress(0.4);
    let warnings = |terms| training_warnings(axes, motions, terms);
    let fit = fit_folds(axes, folded.folds(), options, (ranges, inertia), &warnings)?;
    progress(1.0);
    Ok(fit)
}

/// Fits the polynomial to moments of rows that were normalised by `ranges`; `training_warnings` are
/// told the number of terms.
///
/// # Errors
/// One sentence: orders that do not fit the axes, data that determine nothing.
pub(super) fn fit_folds(
    axes: &[Axis],
    folds: &Folds,
    options: &PolynomialOptions,
    (ranges, inertia): (Vec<InputRange>, Vec<Inertia>),
    training_warnings: &dyn Fn(usize) -> Vec<String>,
) -> Result<PolynomialFit> {
    let orders = options.orders_for(axes)?;
    let terms = exponents(&orders);
    let total = folds.total();
    let plain = normal_equations::solve(&total.gram(&terms), &total.cross(&terms))?;
    let (coefficients, fits) = coefficients(folds, &orders, &plain, options.method, axes.len())?;
    let mut warnings = training_warnings(terms.len());
    warnings.extend(doubts(axes, &inertia, &plain, terms.len()));
    let polynomial = Polynomial {
        orders,
        inputs: ranges,
        coefficients,
    };
    polynomial.check()?;
    Ok(PolynomialFit {
        polynomial,
        inertia,
        axes: fits,
        rank: plain.rank,
        condition: plain.condition,
        rows: total.rows(),
        warnings,
    })
}

/// The coefficients of every axis by the chosen method, and how each came about; `plain` is the
/// least-squares solution.
fn coefficients(
    folded: &Folds,
    orders: &[u8],
    plain: &normal_equations::Solution,
    method: Method,
    axes: usize,
) -> Result<(Vec<Vec<f64>>, Vec<AxisFit>)> {
    let terms = exponents(orders);
    Ok(match method {
        Method::LeastSquares => {
            let errors = plain_cross_validation(folded, &terms, axes)?;
            errors
                .into_iter()
                .enumerate()
                .map(|(axis, error)| {
                    let column = plain.coefficients.col(axis);
                    let fit = AxisFit {
                        lambda: None,
                        effective_parameters: plain.rank as f64,
                        terms: terms.len(),
                        cross_validation_nmse: error,
                    };
                    (column.iter().copied().collect(), fit)
                })
                .unzip()
        }
        Method::Ridge => ridge::fit(folded, orders, axes)?
            .into_iter()
            .map(|fit| {
                let about = AxisFit {
                    lambda: Some(fit.lambda),
                    effective_parameters: fit.effective_parameters,
                    terms: terms.len(),
                    cross_validation_nmse: fit.cross_validation_nmse,
                };
                (fit.coefficients, about)
            })
            .unzip(),
        Method::Select => {
            let mut fits = Vec::new();
            for axis in 0..axes {
                let fit = select::fit(folded, orders, axis)?;
                let about = AxisFit {
                    lambda: None,
                    effective_parameters: fit.terms as f64,
                    terms: fit.terms,
                    cross_validation_nmse: fit.cross_validation_nmse,
                };
                fits.push((fit.coefficients, about));
            }
            fits.into_iter().unzip()
        }
    })
}

/// What to be wary of in a fit.
fn doubts(
    axes: &[Axis],
    inertia: &[Inertia],
    plain: &normal_equations::Solution,
    terms: usize,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if plain.rank < terms {
        warnings.push(format!(
            "the training records determine only {} of {} terms (condition number {:.1e} over those): the rest is set by convention, not by data",
            plain.rank,
            terms,
            plain.condition
        ));
    }
    for (axis, inertia) in axes.iter().zip(inertia) {
        if let Some(error) = inertia.standard_error.filter(|e| *e > 0.05 * inertia.value) {
            warnings.push(format!(
                "the inertia of axis {} is found only to ± {} of {}: state it in study.toml if it is known",
                axis.name, short(error), short(inertia.value)
            ));
        }
    }
    warnings
}

/// NMSE of plain least squares over held-out blocks, percent, per output.
fn plain_cross_validation(folded: &Folds, terms: &[[u8; 4]], outputs: usize) -> Result<Vec<f64>> {
    let mut errors = vec![0.0; outputs];
    for fold in 0..FOLDS {
        let (training, held) = (folded.training(fold), folded.held_out(fold));
        let b =
            normal_equations::solve(&training.gram(terms), &training.cross(terms))?.coefficients;
        let (gram, cross) = (held.gram(terms), held.cross(terms));
        for (y, error) in errors.iter_mut().enumerate() {
            let (b, cross) = (b.subcols(y, 1), cross.subcols(y, 1));
            *error += squared_error(held.square(y), gram.as_ref(), cross, b);
        }
    }
    let total = folded.total();
    Ok(errors
        .into_iter()
        .enumerate()
        .map(|(y, error)| 100.0 * error / total.spread(y).max(f64::MIN_POSITIVE))
        .collect())
}

#[cfg(test)]
mod tests;
