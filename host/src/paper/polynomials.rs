//! The three polynomial fits that the network is measured against, and what each costs.

use super::cost::cpu_seconds;
use crate::fit::identify::{self, Prepared};
use crate::fit::inertia::inertias;
use crate::fit::least_squares::normal_equations;
use crate::fit::moments::{Moments, Summation};
use crate::fit::polynomial::{Method, PolynomialOptions, fit_polynomial, input_ranges};
use crate::model::exponents;
use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::Result;
use faer::Mat;
use serde::Serialize;

/// A way to fit the polynomial: a denominator of the paper's two ratios.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Denominator {
    /// Least squares on all terms, as in the paper.
    Plain,
    /// The tool's default: all terms, with a penalty whose weight comes from cross-validation.
    Ridge,
    /// A few terms of total degree up to 6 by orthogonal forward selection.
    Selected,
}

impl Denominator {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Ridge, Self::Selected];

    /// Its name in tables.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Plain => "plain least squares",
            Self::Ridge => "ridge",
            Self::Selected => "selected terms",
        }
    }

    fn method(self) -> Method {
        match self {
            Self::Plain => Method::LeastSquares,
            Self::Ridge => Method::Ridge,
            Self::Selected => Method::Select,
        }
    }

    fn options(self) -> PolynomialOptions {
        PolynomialOptions {
            method: self.method(),
            ..PolynomialOptions::default()
        }
    }

    /// Learns it from a study, as `jointwatch identify` does.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the study cannot be fitted.
    pub(super) fn identify(self, study: &Study) -> Result<ModelFile> {
        Ok(identify::polynomial(study, &self.options(), &|_| ())?.model)
    }

    /// CPU seconds from the motions of the training records to coefficients.
    ///
    /// For plain least squares that is the solution of the normal equations and nothing else, as
    /// the paper's identification was. The cross-validation of the other two belongs to them:
    /// without it they have no coefficients.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the records cannot be fitted.
    pub(super) fn cpu_seconds(self, study: &Study, prepared: &Prepared) -> Result<f64> {
        let training = prepared.training(study);
        let band = &prepared.filters.band;
        match self {
            Self::Plain => cpu_seconds(|| normal_solution(study, &training, band)),
            Self::Ridge | Self::Selected => cpu_seconds(|| {
                fit_polynomial(&study.axes, &training, band, &self.options(), &|_| ())
            }),
        }
    }
}

/// Coefficients of all terms by the normal equations, straight from the rows.
fn normal_solution(study: &Study, training: &[&Motion], band: &[f64]) -> Result<Mat<f64>> {
    let axes = study.axes.len();
    let ranges = input_ranges(training, None);
    let inertia = inertias(&study.axes, training, (&ranges, None), band)?;
    let mut moments = Moments::new(ranges.len(), axes);
    let mut summation = Summation::new(&ranges, axes);
    for motion in training {
        let axes = study.axes.iter().zip(&inertia).enumerate();
        let forces: Vec<Vec<f64>> = axes
            .map(|(i, (axis, inertia))| {
                motion.restoring_force(i, inertia.value, axis.restoring_force)
            })
            .collect();
        let states: Vec<&[f64]> = motion.states.iter().map(Vec::as_slice).collect();
        let forces: Vec<&[f64]> = forces.iter().map(Vec::as_slice).collect();
        summation.add(&mut moments, &states, &forces);
    }
    let terms = exponents(&vec![3; 2 * axes]);
    let solution = normal_equations::solve(&moments.gram(&terms), &moments.cross(&terms))?;
    Ok(solution.coefficients)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::file::Base;
    use crate::simulate::{SimulationOptions, simulate};

    #[test]
    fn what_is_timed_as_plain_least_squares_is_the_plain_fit() {
        let options = SimulationOptions {
            duration_s: 2.0,
            ..Default::default()
        };
        let study = simulate(&options).unwrap().study;
        let prepared = Prepared::new(&study).unwrap();
        let band = &prepared.filters.band;
        let timed = normal_solution(&study, &prepared.training(&study), band).unwrap();
        let model = Denominator::Plain.identify(&study).unwrap();
        let Base::Polynomial(polynomial) = &model.base else {
            panic!("a polynomial fit gives a polynomial");
        };
        // The fit adds its sums up fold by fold, so the two differ by rounding.
        for (axis, coefficients) in polynomial.coefficients.iter().enumerate() {
            let largest = crate::study::series::peak(coefficients);
            let differences = coefficients.iter().enumerate();
            let differences: Vec<f64> = differences
                .map(|(term, expected)| timed[(term, axis)] - expected)
                .collect();
            let worst = crate::study::series::peak(&differences) / largest;
            println!("axis {axis}: coefficients differ by {worst:.1e} of the largest");
            assert!(worst < 1e-6);
        }
    }
}
