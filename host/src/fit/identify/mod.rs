//! From a study to a model: derivatives, restoring force, fit, and the errors on every record.

pub mod from_sums;
mod network;
mod physical;
mod polynomial;
mod state_input;

pub use network::{Training, network};
pub use physical::physical;
pub(crate) use physical::{base_terms, effect_terms, fit_alone, fit_in_time};
pub(crate) use polynomial::equations;
pub use polynomial::polynomial;

use crate::fit::coverage;
use crate::fit::errors::Evaluated;
use crate::fit::inertia::Inertia;
use crate::fit::network::{NetworkOptions, TrainingObserver};
use crate::fit::polynomial::PolynomialOptions;
use crate::model::corrections::missing_inertia;
use crate::model::effects::input_of;
use crate::model::file::{AxisFit, Base, FORMAT, HistoryEntry, ModelFile};
use crate::model::{FollowedInput, InputRange, ModelAxis, ModelEffect};
use crate::signal::motion::{self, Filters, Motion};
use crate::signal::standstill;
use crate::study::quasi_static::is_without_meaning;
use crate::study::series::extent;
use crate::study::{Axis, Role, Study};
use crate::text::date;
use crate::text::error::{Error, Result};
use jointwatch_shared::base::followed::Follows;
use std::collections::BTreeSet;

/// A model, and what identification had to say about it.
pub struct Identified {
    /// The identified model with its history and warnings.
    pub model: ModelFile,
    /// How a network's training went; none for other kinds of model.
    pub training: Option<Training>,
    inertia: Vec<Inertia>,
}

impl Identified {
    /// A model as the first entry of its history says it came about.
    fn new(mut model: ModelFile, inertia: Vec<Inertia>, what: String) -> Result<Self> {
        model.history.push(HistoryEntry {
            what,
            date: date::today()?,
            change: None,
            validation: model.validation.clone(),
        });
        Ok(Self {
            model,
            training: None,
            inertia,
        })
    }

    /// Standard error of an identified inertia, kg or kg·m²; none for one that the study gave.
    pub fn inertia_error(&self, axis: &str) -> Option<f64> {
        let at = self.model.axes.iter().position(|a| a.name == axis);
        at.and_then(|at| self.inertia.get(at))
            .and_then(|inertia| inertia.standard_error)
    }
}

impl Identified {
    /// The same with its numbers refined: standard errors no longer belong to them.
    pub(crate) fn replaced(self, model: ModelFile) -> Self {
        Self {
            model,
            inertia: Vec::new(),
            ..self
        }
    }
}

/// The kinds of model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The paper's polynomial, every exponent 0 to 3, by ridge regression.
    Polynomial,
    /// The paper's network of forty tanh neurons, the best of five trainings.
    Network,
    /// The sum of physical effects that the study's `[base]` lists.
    Physical,
}

/// Learns a model of a study with the usual options.
///
/// [`polynomial`], [`network`] and [`physical`] take options and tell more.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study has no training record, its records cannot be
/// fitted, or a physical model is wanted and the study lists no `[base]`.
pub fn identify(study: &Study, kind: Kind) -> Result<ModelFile> {
    let identified = match kind {
        Kind::Polynomial => polynomial(study, &PolynomialOptions::default(), &|_| ()),
        Kind::Network => network(
            study,
            &NetworkOptions::default(),
            &TrainingObserver::silent(),
        ),
        Kind::Physical => physical(study),
    };
    Ok(identified?.model)
}

/// A study's records after differentiation, ready for any kind of fit.
#[derive(Clone)]
pub struct Prepared {
    /// Band and filter taps of the study.
    pub filters: Filters,
    /// Every record, in the study's order.
    pub motions: Vec<Motion>,
}

/// What a fit found, before the errors on the records are known.
pub struct FitResult {
    /// What the force is made of.
    pub base: Base,
    /// The input of the study that is the base's last state.
    pub state_input: Option<String>,
    /// Physical effects that add to it.
    pub effects: Vec<ModelEffect>,
    /// Per axis, stated or identified.
    pub inertia: Vec<Inertia>,
    /// How it was fitted, in a word.
    pub fit: String,
    /// Per axis, how the coefficients came about.
    pub fits: Vec<AxisFit>,
    /// Why the model may not generalise, one sentence each.
    pub warnings: Vec<String>,
}

fn check_training(study: &Study) -> Result<()> {
    if study.records.iter().any(|r| r.role == Role::Train) {
        return Ok(());
    }
    Err(Error::data(format!(
        "{}: no [[record]] has role = \"train\"; give that role to the records to learn from",
        study.path.display()
    )))
}

impl Prepared {
    /// Designs the filters for a study and applies them to all of its records.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when the study has no training record or a record is
    /// shorter than the filters.
    pub fn new(study: &Study) -> Result<Self> {
        check_training(study)?;
        let filters = Filters::design(study)?;
        Self::with_filters(study, filters)
    }

    /// The same with filters that are there already.
    ///
    /// # Errors
    /// As [`Prepared::new`].
    pub fn with_filters(study: &Study, filters: Filters) -> Result<Self> {
        check_training(study)?;
        let motions = motion::motions(study, &filters)?;
        Ok(Self { filters, motions })
    }

    /// The same with a model's filters.
    ///
    /// # Errors
    /// As [`Prepared::new`], and for a study that is not the model's.
    pub fn for_model(study: &Study, model: &ModelFile) -> Result<Self> {
        model.check_fits(study)?;
        Self::with_filters(study, model.filters.clone())
    }

    /// The records to learn from.
    pub fn training(&self, study: &Study) -> Vec<&Motion> {
        self.of_role(study, Role::Train)
    }

    /// The records to judge by; there may be none.
    pub fn validation(&self, study: &Study) -> Vec<&Motion> {
        self.of_role(study, Role::Validate)
    }

    fn of_role(&self, study: &Study, role: Role) -> Vec<&Motion> {
        let motions = self.motions.iter();
        motions
            .filter(|m| study.records[m.record].role == role)
            .collect()
    }

    /// RMS of the restoring force of one axis over all training rows, N or N·m, for its inertia in
    /// kg or kg·m².
    pub fn training_force_rms(&self, study: &Study, axis: usize, inertia: f64) -> f64 {
        let (mut sum, mut rows) = (0.0, 0);
        for motion in self.training(study) {
            let convention = study.axes[axis].restoring_force;
            let force = motion.restoring_force(axis, inertia, convention);
            sum += force.iter().map(|r| r * r).sum::<f64>();
            rows += force.len();
        }
        (sum / rows as f64).sqrt()
    }

    /// Makes the model file: adds the errors on every record, and warnings about what validation
    /// asks of the model.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a record cannot be compared.
    pub fn finish(&self, study: &Study, mut fit_result: FitResult) -> Result<Identified> {
        if self.filters.quasi_static {
            without_time(&mut fit_result.effects);
        }
        let validation = self.validation(study);
        let named = validation
            .iter()
            .map(|m| (study.records[m.record].file.as_str(), *m));
        fit_result.warnings.extend(coverage::validation_warnings(
            &study.axes,
            &self.training(study),
            &named.collect::<Vec<_>>(),
        ));
        let still = standstill::in_words(
            study,
            self.filters.state_band_hz,
            self.filters.half_length(),
        );
        fit_result.warnings.extend(still);
        let inertia = fit_result.inertia.clone();
        let inputs = followed(&fit_result, &self.training(study));
        let mut model = fit_result.model(&study.name, &study.axes, self.filters.clone());
        model.followed = inputs;
        model.records.clone_from(&study.sources);
        take_errors(&mut model, study, &self.motions)?;
        let what = format!("identified: {}, {} fit", model.base.name(), model.fit);
        Identified::new(model, inertia, what)
    }
}

impl FitResult {
    /// The model file of it, without records, errors and history.
    fn model(self, study: &str, axes: &[Axis], filters: Filters) -> ModelFile {
        let axes = axes.iter().zip(&self.inertia);
        let axes = axes.map(|(axis, inertia)| ModelAxis {
            name: axis.name.clone(),
            kind: axis.kind,
            inertia: inertia.value + missing_inertia(&self.effects, &axis.name),
            inertia_identified: inertia.identified,
            restoring_force: axis.restoring_force,
        });
        ModelFile {
            format: FORMAT.into(),
            study: study.into(),
            axes: axes.collect(),
            base: self.base,
            effects: self.effects,
            followed: Vec::new(),
            state_input: self.state_input,
            fit: self.fit,
            fits: self.fits,
            warnings: self.warnings,
            verification: Vec::new(),
            validation: Vec::new(),
            history: Vec::new(),
            records: Vec::new(),
            filters,
        }
    }
}

/// What a force follows beside the motion, with its range in the training records; nothing for one
/// that does not change in them.
fn followed(found: &FitResult, training: &[&Motion]) -> Vec<FollowedInput> {
    let effects = found.effects.iter();
    let names = effects.filter_map(|e| Some(Follows::parse(input_of(&e.effect)?).name));
    let names: BTreeSet<&str> = names.chain(found.state_input.as_deref()).collect();
    let range = |name: &str| {
        let series = training
            .iter()
            .filter_map(|motion| motion.input(name))
            .flatten();
        InputRange::of(extent(series.copied()))
    };
    let all = names.into_iter().map(|name| FollowedInput {
        name: name.into(),
        range: range(name),
    });
    all.filter(|input| input.range.is_sound()).collect()
}

/// Gives a model its errors on a study's records.
fn take_errors(model: &mut ModelFile, study: &Study, motions: &[Motion]) -> Result<()> {
    let evaluated = Evaluated::as_logged(study, model, motions)?;
    let [verification, validation] = [Role::Train, Role::Validate].map(|r| evaluated.pooled(r));
    model.verification = verification;
    model.validation = validation;
    Ok(())
}

/// Takes unit and interval off the parameters that say nothing where there is no time.
fn without_time(effects: &mut [ModelEffect]) {
    let parameters = effects.iter_mut().flat_map(|e| &mut e.parameters);
    for parameter in parameters.filter(|p| is_without_meaning(&p.name)) {
        parameter.unit = "–".into();
        parameter.interval = None;
    }
}
