//! The paper's two headline ratios over several seeds: how much lower the network's error is, how
//! much longer it trains.

use super::polynomials::Denominator;
use super::spread::Spread;
use crate::assess::compare;
use crate::model::file::ModelFile;
use crate::signal::motion;
use crate::study::{Role, Study};
use crate::text::error::Result;
use serde::Serialize;

/// The paper's Section 6.1: the network's percentage error on validation was about 16 times lower …
pub const PAPERS_ERROR_RATIO: f64 = 16.0;
/// … and its training took about 180 times longer.
pub const PAPERS_TIME_RATIO: f64 = 180.0;

/// NMSE of a model on the validation record, percent, per axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Without a low-pass, as in the paper.
    pub whole: Vec<f64>,
    /// Measured and predicted force low-passed alike, as `jointwatch compare` has it.
    pub common: Vec<f64>,
}

impl Errors {
    /// Of a model on the validation records of a study.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a record cannot be compared.
    pub(super) fn of(model: &ModelFile, study: &Study) -> Result<Self> {
        let mut motions = motion::motions(study, &model.filters)?;
        motions.retain(|motion| study.records[motion.record].role == Role::Validate);
        let compared = compare::compare_motions(study, model, &motions)?;
        let records = || compared.records.iter();
        let figures = |axis| records().filter_map(move |record| record.axes.get(axis));
        let per_axis = |what: fn(&compare::AxisFigures) -> f64| {
            let axes = model.axes.iter();
            axes.flat_map(|axis| figures(&axis.name).map(what))
                .collect()
        };
        Ok(Self {
            whole: per_axis(|f| f.nmse_percent_wide_band),
            common: per_axis(|f| f.nmse_percent),
        })
    }

    /// Per axis, in one of the bands.
    pub fn within(&self, band: Band) -> &[f64] {
        match band {
            Band::Whole => &self.whole,
            Band::Common => &self.common,
        }
    }
}

/// In which band an error is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Band {
    /// All frequencies up to half the sample rate.
    Whole,
    /// Up to the study's common band.
    Common,
}

/// One polynomial fit of one seed's study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PolynomialRun {
    /// How it was fitted.
    pub fit: Denominator,
    /// On the validation record.
    pub validation_nmse_percent: Errors,
    /// CPU seconds of the fit, one thread.
    pub cpu_s: f64,
}

/// The network of one seed's study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkRun {
    /// On the validation record, of the training that was kept.
    pub validation_nmse_percent: Errors,
    /// CPU seconds of one training, the median of all restarts.
    pub cpu_s: f64,
    /// CPU seconds of all restarts together.
    pub cpu_s_all: f64,
    /// CPU seconds after which the training that was kept had a validation error a sixteenth of
    /// the plain polynomial's on every axis, in the common band; none when it never had.
    pub cpu_s_to_sixteenth: Option<f64>,
}

/// What one seed gave.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedRun {
    /// Seed of drives and noise.
    pub seed: u64,
    /// In the order of [`Denominator::ALL`].
    pub polynomials: Vec<PolynomialRun>,
    /// Training and errors of the network.
    pub network: NetworkRun,
}

impl SeedRun {
    fn polynomial(&self, fit: Denominator) -> Option<&PolynomialRun> {
        self.polynomials.iter().find(|run| run.fit == fit)
    }
}

/// Validation NMSE of the polynomial over that of the network on one axis; `None` without seeds.
pub fn error_ratio(runs: &[SeedRun], fit: Denominator, axis: usize, band: Band) -> Option<Spread> {
    Spread::of(runs.iter().filter_map(|run| {
        let error = |errors: &Errors| errors.within(band).get(axis).copied();
        let polynomial = error(&run.polynomial(fit)?.validation_nmse_percent)?;
        Some(polynomial / error(&run.network.validation_nmse_percent)?)
    }))
}

/// The same ratio of RMS errors, the square root of that of NMSE run by run; `None` without seeds.
pub fn rms_error_ratio(
    runs: &[SeedRun],
    fit: Denominator,
    axis: usize,
    band: Band,
) -> Option<Spread> {
    Spread::of(runs.iter().filter_map(|run| {
        let one = error_ratio(std::slice::from_ref(run), fit, axis, band)?;
        Some(one.median.sqrt())
    }))
}

/// Which part of the training is held against the polynomial's fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// A single training, from one start.
    One,
    /// The trainings from all starts together.
    All,
    /// One training, up to an error of a sixteenth of the plain polynomial's.
    ToSixteenth,
}

/// Training time of the network over that of the polynomial, CPU seconds on both sides; `None` when
/// no seed has such a time.
pub fn time_ratio(runs: &[SeedRun], fit: Denominator, share: Share) -> Option<Spread> {
    Spread::of(runs.iter().filter_map(|run| {
        let network = match share {
            Share::One => run.network.cpu_s,
            Share::All => run.network.cpu_s_all,
            Share::ToSixteenth => run.network.cpu_s_to_sixteenth?,
        };
        Some(network / run.polynomial(fit)?.cpu_s)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seed: u64, plain: f64, network: f64, reached: Option<f64>) -> SeedRun {
        let polynomial = |fit, nmse: f64, cpu_s| PolynomialRun {
            fit,
            validation_nmse_percent: Errors {
                whole: vec![nmse, 2.0 * nmse],
                common: vec![10.0 * nmse, 10.0 * nmse],
            },
            cpu_s,
        };
        SeedRun {
            seed,
            polynomials: vec![
                polynomial(Denominator::Plain, plain, 0.01),
                polynomial(Denominator::Ridge, 0.5 * plain, 0.1),
            ],
            network: NetworkRun {
                validation_nmse_percent: Errors {
                    whole: vec![network, network],
                    common: vec![network, network],
                },
                cpu_s: 1.0,
                cpu_s_all: 5.0,
                cpu_s_to_sixteenth: reached,
            },
        }
    }

    #[test]
    fn ratios_are_taken_seed_by_seed_before_their_median() {
        let runs = [
            run(1, 8.0, 0.1, Some(0.2)),
            run(2, 4.0, 0.2, None),
            run(3, 3.0, 0.1, Some(0.4)),
        ];
        let x = error_ratio(&runs, Denominator::Plain, 0, Band::Whole).unwrap();
        // The medians of both errors would give 40, the ratios' median is 30.
        assert!((x.median - 30.0).abs() < 1e-9 && (x.least - 20.0).abs() < 1e-9);
        let rms = rms_error_ratio(&runs, Denominator::Plain, 0, Band::Whole).unwrap();
        assert!(
            (rms.median - 30_f64.sqrt()).abs() < 1e-9 && (rms.most - 80_f64.sqrt()).abs() < 1e-9
        );
        let common = error_ratio(&runs, Denominator::Plain, 0, Band::Common).unwrap();
        assert!((common.median - 300.0).abs() < 1e-9);
        let phi = error_ratio(&runs, Denominator::Ridge, 1, Band::Whole).unwrap();
        assert!((phi.median - 30.0).abs() < 1e-9 && (phi.most - 80.0).abs() < 1e-9);
        assert_eq!(
            error_ratio(&runs, Denominator::Selected, 0, Band::Whole),
            None
        );

        let ratio = |fit, share| time_ratio(&runs, fit, share).unwrap().median;
        assert!((ratio(Denominator::Plain, Share::One) - 100.0).abs() < 1e-9);
        assert!((ratio(Denominator::Ridge, Share::All) - 50.0).abs() < 1e-9);
        assert!((ratio(Denominator::Plain, Share::ToSixteenth) - 30.0).abs() < 1e-9);
    }
}
