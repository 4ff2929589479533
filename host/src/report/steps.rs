//! The steps of a staircase of errors, from what found or added effects.

use super::Step;
use crate::diagnose::add::Added;
use crate::diagnose::apply::Applied;
use crate::diagnose::{Diagnosis, Found, PerAxis};
use crate::model::file::{AxisError, per_axis};

/// Before, and after each addition.
pub fn applied(all: &Applied) -> Vec<Step> {
    let steps = all.staircase.steps.iter().map(|step| Step {
        label: step.label().unwrap_or_else(|| "before".into()),
        errors: step.relative_error.clone(),
    });
    steps.collect()
}

/// Before, and after everything that was found.
pub fn found(diagnosis: &Diagnosis) -> Vec<Step> {
    let mut steps = vec![Step {
        label: "before".into(),
        errors: diagnosis.relative_error_before.clone(),
    }];
    let found = diagnosis.found.iter();
    let found: Vec<String> = found.map(Found::name).collect();
    if !found.is_empty() {
        steps.push(Step {
            label: found.join(", "),
            errors: diagnosis.relative_error_after.clone(),
        });
    }
    steps
}

/// Before and after an addition, and the noise floor of each axis, on the rows that `add` judges
/// by.
pub fn added(added: &Added, label: &str) -> (Vec<Step>, PerAxis) {
    let step = |label: &str, errors: &[AxisError]| Step {
        label: label.into(),
        errors: per_axis(errors),
    };
    let steps = vec![
        step("before", &added.errors.before),
        step(label, &added.errors.after),
    ];
    let floors = added.errors.after.iter().zip(&added.noise_floor);
    (steps, floors.map(|(e, f)| (e.axis.clone(), *f)).collect())
}
