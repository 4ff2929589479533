//! What instruments do wrong within their data sheets: a zero that is a little off, a gain or an inertia wrong by a few thousandths.
//!
//! It shows in the residual of every rig and is no missing effect. Where it is small enough it is taken for granted, so that
//! neither it nor an effect that looks like it is named; where it is larger it is left for the search to find.

use super::candidates::Beside;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::model::effects::Bound;
use crate::study::Axis;
use jointwatch_shared::effect::Entry;

/// Gains, zeros and inertias are trusted to this: three standard deviations of what calibrations within 0.15 % of a force channel, an
/// accelerometer and an inertia make together. A zero's is a share of the RMS applied force.
const TRUSTED: f64 = 0.006;

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
