//! The network of the comparison, and what its training costs.

use super::ratios::{Errors, NetworkRun};
use super::spread::Spread;
use crate::fit::errors::Sums;
use crate::fit::identify;
use crate::fit::network::{NetworkFit, NetworkOptions, TrainingObserver};
use crate::model::file::{Base, ModelFile};
use crate::report::histories;
use crate::signal::motion;
use crate::study::{Role, Study};
use crate::text::error::{Error, Result};
use std::sync::atomic::AtomicBool;

/// The paper's error ratio: a training is timed up to where it has brought the polynomial's error
/// down by this.
const SIXTEENTH: f64 = super::ratios::PAPERS_ERROR_RATIO;

/// A trained network: the model that was kept, and all of its trainings.
pub(super) struct Trained {
    pub(super) model: ModelFile,
    fit: NetworkFit,
}

/// Trains the network of a study, as `jointwatch identify --model network` does.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study cannot be trained on.
pub(super) fn train(study: &Study, restarts: usize) -> Result<Trained> {
    let options = NetworkOptions {
        restarts,
        ..NetworkOptions::default()
    };
    let watch = TrainingObserver {
        progress: &|_| (),
        stop: &AtomicBool::new(false),
    };
    let identified = identify::network(study, &options, &watch)?;
    let training = identified
        .training
        .ok_or_else(|| Error::failed("the network was identified without a training"))?;
    Ok(Trained {
        model: identified.model,
        fit: training.fit,
    })
}

impl Trained {
    /// Errors and costs for the tables; `plain` is the validation NMSE of the plain polynomial per
    /// axis, percent, in the common band.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the study has no validation record.
    pub(super) fn run(&self, study: &Study, plain: &[f64]) -> Result<NetworkRun> {
        let costs = self.fit.restarts.iter().map(|restart| restart.cpu_s);
        let one = Spread::of(costs.clone()).ok_or_else(|| {
            Error::failed("the network was trained no times: ask for a restart at least")
        })?;
        Ok(NetworkRun {
            validation_nmse_percent: Errors::of(&self.model, study)?,
            cpu_s: one.median,
            cpu_s_all: costs.sum(),
            cpu_s_to_sixteenth: self.cpu_s_to_sixteenth(study, plain)?,
        })
    }

    /// Validation errors of every training in the order of their seeds, and which of them was kept.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a record cannot be compared.
    pub(super) fn each(&self, study: &Study) -> Result<(Vec<Errors>, usize)> {
        let errors = self.fit.restarts.iter().map(|restart| {
            let mut model = self.model.clone();
            model.base = Base::Network(restart.network.clone());
            Errors::of(&model, study)
        });
        Ok((errors.collect::<Result<_>>()?, self.fit.best))
    }

    /// When the training that was kept first had a sixteenth of the plain polynomial's validation
    /// error on every axis.
    fn cpu_s_to_sixteenth(&self, study: &Study, plain: &[f64]) -> Result<Option<f64>> {
        let motions = motion::motions(study, &self.model.filters)?;
        let Some(validation) = motions
            .iter()
            .find(|m| study.records[m.record].role == Role::Validate)
        else {
            return Ok(None);
        };
        let mut model = self.model.clone();
        for point in &self.fit.restarts[self.fit.best].trace {
            model.base = Base::Network(point.network.clone());
            let histories = histories(&model, validation)?;
            let low_enough = histories.iter().zip(plain).all(|(history, plain)| {
                let forces = history.measured.iter().zip(&history.predicted);
                let error: Vec<f64> = forces.map(|(r, p)| r - p).collect();
                Sums::of(&error, &history.measured).nmse_percent() * SIXTEENTH <= *plain
            });
            if low_enough {
                return Ok(Some(point.cpu_s));
            }
        }
        Ok(None)
    }
}
