//! What a command knows when it is asked for a report.

use crate::diagnose::add::Added;
use crate::diagnose::apply::Applied;
use crate::diagnose::{Diagnosis, PerAxis, Verdict};
use crate::model::file::{JudgedOn, ModelFile};
use crate::report::staircase::Step;
use crate::report::steps;
use crate::simulate::respond::Response;
use crate::study::{Role, Study};

/// What a command knows when it is asked for a report.
pub struct Asked<'a> {
    /// The answer in one sentence, where the command has one of its own.
    pub answer: Option<String>,
    /// The command as it was typed; whoever asks for the page says it.
    pub command: String,
    /// The study as it was logged.
    pub study: &'a Study,
    /// The model that the page is about.
    pub model: &'a ModelFile,
    /// The model as it was before something was added to it.
    pub before: Option<&'a ModelFile>,
    /// Errors step by step; empty when there was one step only.
    pub steps: Vec<Step>,
    /// Noise floors per axis, relative as the errors; computed when left out.
    pub floors: Option<PerAxis>,
    /// What the errors are measured on.
    pub judged_on: String,
    /// What is missing, when that was asked; of the model before.
    pub diagnosis: Option<&'a Diagnosis>,
    /// What is said of the model once everything was added.
    pub verdict_after: Option<Verdict>,
    /// What the search had to say beside its answer, in sentences without their full stops.
    pub remarks: Vec<String>,
    /// How the rig moves with the model in place of its joint.
    pub response: Option<&'a Response>,
}

impl<'a> Asked<'a> {
    /// A model on its study.
    pub fn of_model(study: &'a Study, model: &'a ModelFile) -> Self {
        let validates = study.records.iter().any(|r| r.role == Role::Validate);
        Self {
            answer: None,
            command: String::new(),
            study,
            model,
            before: None,
            steps: Vec::new(),
            floors: None,
            judged_on: match validates {
                true => JudgedOn::Validation.words().into(),
                false => "training records (the study has no others)".into(),
            },
            diagnosis: None,
            verdict_after: None,
            remarks: Vec::new(),
            response: None,
        }
    }

    /// The model that was diagnosed, with the candidates.
    pub fn of_diagnosis(study: &'a Study, model: &'a ModelFile, diagnosis: &'a Diagnosis) -> Self {
        Self {
            steps: steps::found(diagnosis),
            floors: Some(diagnosis.noise_floor.clone()),
            judged_on: diagnosis.judged_on.words().into(),
            diagnosis: Some(diagnosis),
            remarks: diagnosis.notes.clone(),
            ..Self::of_model(study, model)
        }
    }

    /// A model with everything that was missing, beside the one `before`.
    pub fn of_applied(study: &'a Study, before: &'a ModelFile, applied: &'a Applied) -> Self {
        let steps = steps::applied(applied);
        let mut remarks = applied.first.notes.clone();
        remarks.extend(applied.not_kept());
        remarks.extend(applied.unsure());
        remarks.push(applied.staircase.ended.clone());
        Self {
            before: (steps.len() > 1).then_some(before),
            steps,
            floors: Some(applied.staircase.noise_floor.clone()),
            judged_on: applied.staircase.judged_on.words().into(),
            diagnosis: Some(&applied.first),
            verdict_after: Some(applied.last.verdict),
            remarks,
            ..Self::of_model(study, &applied.model)
        }
    }

    /// The wider model, beside the one `before`, with the effects that were added.
    pub fn of_added(
        study: &'a Study,
        before: &'a ModelFile,
        (added, effects): (&'a Added, &[String]),
    ) -> Self {
        let (steps, floors) = steps::added(added, &effects.join(", "));
        Self {
            before: Some(before),
            steps,
            floors: Some(floors),
            judged_on: added.errors.judged_on.words().into(),
            ..Self::of_model(study, &added.model)
        }
    }

    /// A model with the motion that it gives the rig.
    pub fn of_response(study: &'a Study, model: &'a ModelFile, response: &'a Response) -> Self {
        Self {
            response: Some(response),
            ..Self::of_model(study, model)
        }
    }
}
