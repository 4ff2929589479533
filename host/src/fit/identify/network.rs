//! Learning a network of tanh neurons from a study, and whether its restarts agree.

use super::state_input::StateInput;
use super::{FitResult, Identified, Prepared};
use crate::fit::errors::Evaluated;
use crate::fit::network::{NetworkFit, NetworkOptions, Restart, TrainingObserver, fit_network};
use crate::model::ModelAxis;
use crate::model::file::{AxisFit, Base, ModelFile};
use crate::signal::motion::Motion;
use crate::study::{Role, Study};
use crate::text::error::Result;

/// What is to be known about a network beside the model itself.
#[derive(Clone, Debug)]
pub struct Training {
    /// The fit with all its restarts.
    pub fit: NetworkFit,
    /// Per restart and axis: NMSE in percent on the validation records in the common band, empty
    /// without such records. For the reader only: nothing is chosen by it.
    pub validation_nmse_percent: Vec<Vec<f64>>,
    /// Per axis: how far the restarts' predictions lie apart on validation records, or on training
    /// records when there are no others; see [`NetworkFit::disagreement`].
    pub disagreement: Vec<f64>,
}

/// Learns a network from the training records of a study; [`Identified::training`] says how it
/// went.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study has no training record or its records cannot
/// be trained on; [`crate::text::error::Kind::Usage`] for options out of range.
pub fn network(
    study: &Study,
    options: &NetworkOptions,
    watch: &TrainingObserver<'_>,
) -> Result<Identified> {
    study.check_has_time("a network follows velocities", "use --model physical")?;
    let prepared = Prepared::new(study)?;
    let training = prepared.training(study);
    let band = &prepared.filters.band;
    let chosen = StateInput::of(study, options.input.as_deref(), &training)?;
    let options = &NetworkOptions {
        input: chosen.name.clone(),
        ..options.clone()
    };
    let input = options.input.as_deref();
    let fit = fit_network(&study.axes, &training, band, options, watch)?;
    let best = &fit.restarts[fit.best];
    let fits = study.axes.iter().enumerate();
    let fits = fits.map(|(index, axis)| AxisFit {
        axis: axis.name.clone(),
        terms: fit.network.parameters(),
        ridge: best.alpha / best.beta,
        effective_parameters: best.effective_parameters,
        training_force_rms: prepared.training_force_rms(study, index, fit.inertia[index].value),
        cross_validation_nmse_percent: None,
    });
    let fit_result = FitResult {
        fits: fits.collect(),
        base: Base::Network(fit.network.clone()),
        state_input: None,
        effects: Vec::new(),
        inertia: fit.inertia.clone(),
        fit: "Levenberg-Marquardt".into(),
        warnings: fit.warnings.clone(),
    };
    let validation = prepared.of_role(study, Role::Validate);
    let judged = if validation.is_empty() {
        &training
    } else {
        &validation
    };
    let disagreement = fit.disagreement(judged, input)?;
    let mut identified = prepared.finish(study, chosen.told(fit_result))?;
    let held: Vec<Motion> = validation.into_iter().cloned().collect();
    let of_restart = |restart: &Restart| {
        let model = ModelFile {
            base: Base::Network(restart.network.clone()),
            ..identified.model.clone()
        };
        let evaluated = Evaluated::corrected(study, &model, held.as_slice())?;
        let errors = evaluated.pooled(Role::Validate).into_iter();
        Ok(errors.map(|error| error.nmse_percent).collect())
    };
    let validation_nmse_percent = match held.is_empty() {
        true => Vec::new(),
        false => fit.restarts.iter().map(of_restart).collect::<Result<_>>()?,
    };
    identified.training = Some(Training {
        fit,
        validation_nmse_percent,
        disagreement,
    });
    Ok(identified)
}

impl Training {
    /// One sentence on whether the restarts agree, for the axes of the model.
    pub fn agreement(&self, axes: &[ModelAxis]) -> String {
        let restarts = self.fit.restarts.len();
        if restarts < 2 {
            return "Agreement of restarts: one restart alone says nothing about it.".into();
        }
        let judged = if self.validation_nmse_percent.is_empty() {
            "training"
        } else {
            "validation"
        };
        let clauses = axes.iter().zip(&self.disagreement).enumerate();
        let clauses: Vec<String> = clauses
            .map(|(index, (axis, apart))| {
                let errors = self.validation_nmse_percent.iter().map(|e| e[index]);
                let (low, high) = errors.fold((f64::INFINITY, 0.0_f64), |(low, high), e| {
                    (low.min(e), high.max(e))
                });
                let spread = if low.is_finite() {
                    format!(", NMSE {low:.3} to {high:.3} %")
                } else {
                    String::new()
                };
                format!(
                    "{} within {:.2} % of RMS force{spread}",
                    axis.name,
                    100.0 * apart
                )
            })
            .collect();
        format!(
            "Agreement of {restarts} restarts on {judged} records, standard deviation of their predictions: {}.",
            clauses.join("; ")
        )
    }
}
