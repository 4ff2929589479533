//! The steps of a staircase of errors, from what found or added effects.

use super::Step;
use crate::diagnose::add::Change;
use crate::diagnose::apply::Applied;
use crate::diagnose::{Diagnosis, Found, PerAxis};
use crate::study::Role;

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

/// Before and after on the records that the model has not seen (on all, where it has seen all),
/// several records as the root of their mean square.
pub fn added(changes: &[Change], label: &str) -> (Vec<Step>, PerAxis) {
    let awake = || changes.iter().filter(|c| !c.at_rest);
    let held_out = awake().any(|c| c.role == Role::Validate);
    let judged = || awake().filter(move |c| !held_out || c.role == Role::Validate);
    let over_records = |figure: fn(&Change) -> f64| -> PerAxis {
        judged()
            .map(|change| {
                let mine = judged().filter(|c| c.axis == change.axis);
                let squares: Vec<f64> = mine.map(|c| figure(c).powi(2)).collect();
                let mean = squares.iter().sum::<f64>() / squares.len() as f64;
                (change.axis.clone(), mean.sqrt())
            })
            .collect()
    };
    let step = |label: &str, errors| Step {
        label: label.into(),
        errors,
    };
    let steps = vec![
        step("before", over_records(|c| c.before)),
        step(label, over_records(|c| c.after)),
    ];
    (steps, over_records(|c| c.noise_floor))
}
