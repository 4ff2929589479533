//! Where the fit of a model with named effects may start: at what the search for exactly these effects finds.

use super::candidates::Beside;
use super::missing::shapes_of;
use crate::fit::effects::columns::Records;
use crate::fit::effects::solved_at;
use crate::model::effects::Bound;
use crate::text::error::Result;

/// Starting values of every shape of the `known` terms, which have these `values`, and of the `added` ones, in the order of
/// their unknowns: each is searched for beside the model with those before it. Nothing where one explains nothing.
///
/// # Errors
/// As the fit of the terms.
pub(crate) fn start(
    records: &Records<'_>,
    known: &[Bound],
    values: &[Vec<f64>],
    added: &[Bound],
) -> Result<Option<Vec<f64>>> {
    let mut terms = known.to_vec();
    let mut values = values.to_vec();
    for bound in added {
        let solution = solved_at(records, &terms, &shapes_of(records, &terms, &values))?;
        let beside = Beside::new(records, &terms, &solution, Vec::new());
        let Some(candidate) = beside.and_then(|beside| beside.found(bound)) else {
            return Ok(None);
        };
        values.clone_from(&solution.solved.values);
        values.push(candidate.values);
        terms.push(*bound);
    }
    Ok(Some(shapes_of(records, &terms, &values)))
}
