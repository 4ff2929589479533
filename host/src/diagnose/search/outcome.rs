//! The model that a search makes, and what unseen rows take out of it.

use super::bench::least_share;
use crate::diagnose::decide::gains::{falls, is_raised, is_refuted, mean_and_error};
use crate::diagnose::errors::{Unseen, shapes_of};
use crate::fit::effects::columns::Records;
use crate::fit::effects::{Solution, solve};
use crate::model::effects::AxisEffect;
use crate::study::Axis;
use crate::study::series::rms;
use crate::text::error::Result;
use jointwatch_shared::effect::Subsystem;

/// A model with its values.
pub(in crate::diagnose) struct Model {
    pub(in crate::diagnose) terms: Vec<AxisEffect>,
    pub(in crate::diagnose) solution: Solution,
}

/// What was found in the training records, and what unseen rows say of it.
#[derive(Clone)]
pub(in crate::diagnose) struct Refuted {
    pub(in crate::diagnose) bound: AxisEffect,
    pub(in crate::diagnose) axis: usize,
    /// Rise of the log error power of a block: mean and standard error; nothing where it has no
    /// strength beside the others.
    pub(in crate::diagnose) rise: Option<[f64; 2]>,
}

/// Takes out of a model what unseen rows speak against; `gains` are those of the blocks that let
/// each effect in.
pub(super) fn refuted(
    (unseen_rows, axes): (&Unseen<'_>, &[Axis]),
    records: &Records<'_>,
    last: &mut Model,
    (kept, gains): (usize, &[(AxisEffect, Vec<f64>)]),
    first: (&[AxisEffect], &[Vec<f64>]),
) -> Result<Vec<Refuted>> {
    let mut refuted = Vec::new();
    if last.terms.len() <= kept {
        return Ok(refuted);
    }
    let mut with = unseen_rows.log_errors(&last.terms, &last.solution)?;
    // The least important stands last.
    let mut at = last.terms.len();
    while at > kept {
        at -= 1;
        let bound = last.terms[at];
        let (mut terms, mut values) = (last.terms.clone(), last.solution.solved.values.clone());
        terms.remove(at);
        values.remove(at);
        // What it had taken the place of comes back.
        let base = first.0.iter().zip(first.1);
        for (term, own) in base.filter(|(term, _)| bound.replaces(term)) {
            terms.push(*term);
            values.push(own.clone());
        }
        let from = shapes_of(records, &terms, &values);
        let solution = solve(records, axes, &terms, Some(from))?;
        let without = unseen_rows.log_errors(&terms, &solution)?;
        let mut own: Vec<usize> = (0..axes.len()).collect();
        own.retain(|&axis| bound.acts_on(axis));
        let of_axis = |axis: usize| falls(&without[axis], &with[axis]);
        // What acts on both may help on one of them more than it harms on the other.
        let unseen: Vec<f64> = own.iter().flat_map(|&axis| of_axis(axis)).collect();
        let seen = gains.iter().filter(|(effect, _)| *effect == bound);
        let seen: Vec<f64> = seen.flat_map(|(_, gains)| gains.clone()).collect();
        let absent = is_absent(records, &bound, &last.solution.solved.values[at]);
        let raised = own
            .iter()
            .all(|&axis| is_raised(&without[axis], &with[axis]));
        if !absent && !raised && !is_refuted(&seen, &unseen) {
            continue;
        }
        let each = own.into_iter();
        let each = each.map(|axis| (axis, mean_and_error(&of_axis(axis))));
        if let Some((axis, (mean, error))) = each.min_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
            refuted.push(Refuted {
                bound,
                axis,
                rise: (!absent).then_some([-mean, error]),
            });
            with = without;
            *last = Model { terms, solution };
        }
    }
    Ok(refuted)
}

/// Whether an effect that was found on one axis alone has next to no force where all terms are
/// solved for together.
fn is_absent(records: &Records<'_>, bound: &AxisEffect, values: &[f64]) -> bool {
    if bound.entry.is_per_record() || bound.entry.subsystem == Subsystem::Sensor {
        return false;
    }
    let force = records.force(bound, values);
    let axes = force.chunks_exact(records.rows_per_axis().max(1));
    let mut shares = axes.zip(&records.references.force).enumerate();
    shares.all(|(axis, (own, whole))| rms(own) / whole < least_share(records, axis))
}
