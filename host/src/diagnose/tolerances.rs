//! What instruments do wrong within their data sheets: a zero that is a little off, a gain or an inertia wrong by a few thousandths.
//!
//! It shows in the residual of every rig and is no missing effect. Where it is small enough it is taken for granted, so that
//! neither it nor an effect that looks like it is named; where it is larger it is left for the search to find.

use super::candidates::Beside;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::product;
use crate::fit::normal_equations;
use crate::model::effects::Bound;
use crate::study::Axis;
use faer::Mat;
use jointwatch_shared::effect::Entry;

/// Gains, zeros and inertias are trusted to this: three standard deviations of what calibrations within 0.15 % of a force channel, an
/// accelerometer and an inertia make together. A zero's is a share of the RMS applied force.
const TRUSTED: f64 = 0.0078;

/// The effects of instruments that the records of a model show no more of than may be.
pub(super) fn within(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[Bound],
    solution: &Solution,
) -> Vec<Bound> {
    let Some(beside) = Beside::new(records, terms, solution, Vec::new()) else {
        return Vec::new();
    };
    let mut within = Vec::new();
    for (axis, stated) in axes.iter().map(|a| a.inertia).enumerate() {
        let listed = |name: &str| Entry::named(name).map(|entry| Bound { entry, axis });
        let mut suspects: Vec<(Bound, f64)> = Vec::new();
        if let Some(zero) = listed("preload") {
            suspects.push((zero, TRUSTED * records.applied_rms(axis)));
        }
        if let (Some(inertia), Some(stated)) = (listed("inertia_error"), stated)
            && stated > 0.0
        {
            suspects.push((inertia, TRUSTED * stated));
        }
        suspects.retain(|(bound, _)| {
            let rival = terms.iter().any(|term| bound.rules_out(term));
            !rival && !terms.contains(bound)
        });
        let bounds: Vec<Bound> = suspects.iter().map(|(bound, _)| *bound).collect();
        let Some(factors) = beside.factors(&columns(records, &bounds)) else {
            continue;
        };
        let small = suspects.iter().zip(factors);
        let small = small.filter(|((_, most), factor)| factor.abs() <= *most);
        within.extend(small.map(|((bound, _), _)| *bound));
    }
    within
}

/// Their columns.
pub(super) fn columns(records: &Records<'_>, within: &[Bound]) -> Vec<Vec<f64>> {
    let columns = within.iter().flat_map(|bound| {
        let values = vec![0.0; bound.entry.parameters().len()];
        records.columns(bound, &values)
    });
    columns.collect()
}

/// Takes as much of them out of a residual as is there, axis by axis.
pub(super) fn take_out(records: &Records<'_>, within: &[Bound], residual: &mut [f64]) {
    let rows = records.rows_per_axis();
    for (axis, part) in residual.chunks_exact_mut(rows.max(1)).enumerate() {
        let mine: Vec<Bound> = within.iter().filter(|b| b.axis == axis).copied().collect();
        let own = columns(records, &mine);
        let column = |c: usize| &own[c][axis * rows..(axis + 1) * rows];
        let design = Mat::from_fn(rows, own.len(), |r, c| column(c)[r]);
        let right = Mat::from_fn(rows, 1, |r, _| part[r]);
        let solved = normal_equations::solve(&product(&design, &design), &product(&design, &right));
        if let Ok(solved) = solved {
            for c in 0..own.len() {
                let factor = solved.coefficients[(c, 0)];
                let pairs = part.iter_mut().zip(column(c));
                pairs.for_each(|(r, v)| *r -= factor * v);
            }
        }
    }
}
