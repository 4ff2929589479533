//! Where the fit of a model with named effects may start: at what the search for exactly these
//! effects finds.

use super::bench::Bench;
use super::collect::Library;
use super::hypothesis::Hypothesis;
use crate::diagnose::errors::shapes_of;
use crate::fit::effects::columns::Records;
use crate::fit::effects::solved_at;
use crate::model::effects::AxisEffect;
use crate::text::error::Result;
use jointwatch_shared::base::terms::EffectValues;
use jointwatch_shared::effect::about::{Parameter, Role};

/// Steps in which the shapes of an effect settle before the whole model is fitted.
const STEPS: usize = 8;

/// Starting values of every shape of the `known` terms, which have these `values`, and of the
/// `added` ones, in the order of their unknowns: each is searched for beside the model with those
/// before it. Nothing where one explains nothing.
///
/// # Errors
/// As the fit of the terms.
pub(crate) fn start(
    records: &Records<'_>,
    known: &[AxisEffect],
    values: &[Vec<f64>],
    added: &[AxisEffect],
) -> Result<Option<Vec<f64>>> {
    let mut terms = known.to_vec();
    let mut values = values.to_vec();
    for bound in added {
        let own = terms
            .iter()
            .zip(&values)
            .filter(|(term, _)| term.acts_on(bound.axis));
        let (members, own): (Vec<AxisEffect>, Vec<Vec<f64>>) =
            own.map(|(t, v)| (*t, v.clone())).unzip();
        let base = Hypothesis {
            base: members.len(),
            members,
            values: own,
        };
        let bench = Bench::new(records, bound.axis, &base, None);
        let residual = solved_at(records, &terms, &shapes_of(records, &terms, &values))?;
        let residual = residual.solved.residual;
        let library = Library::new(&bench, &[*bound], &terms, &values, &residual);
        let design = bench.design(&base, &bench.parts(&base, &[]));
        let Some(promise) = library.scan(&bench, &base, &design).into_iter().next() else {
            return Ok(None);
        };
        let with = bench.refined(&base.with(*bound, promise.values), false, STEPS);
        let Some(found) = with.values.last() else {
            return Ok(None);
        };
        values.push(found.clone());
        terms.push(*bound);
    }
    Ok(Some(shapes_of(records, &terms, &values)))
}

/// Values for an effect from one of the model that contains it: the shapes stay where they were
/// found, and a strength of 1 is solved anew.
pub(crate) fn inherited(of_model: &[EffectValues], special: &AxisEffect) -> Option<Vec<f64>> {
    let contains = |old: &&EffectValues| {
        let wider = old.entry.replaces.contains(&special.entry.about.name);
        wider && old.input == special.input && usize::from(old.axis) == special.axis
    };
    let old = of_model.iter().find(contains)?;
    let value = |parameter: &Parameter| {
        let place = old
            .entry
            .parameters()
            .iter()
            .position(|p| p.name == parameter.name);
        match (place, &parameter.role) {
            (Some(place), _) => Some(old.values[place]),
            (None, Role::Linear { .. }) => Some(1.0),
            (None, _) => None,
        }
    };
    special.entry.parameters().iter().map(value).collect()
}
