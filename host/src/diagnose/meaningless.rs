//! Values of a fit that mean nothing by themselves: those that an effect cannot have, and those of effects that cancel, as one does whose
//! force is several times what is measured.

use super::search::bench::MAX_FORCE;
use crate::fit::effects::columns::Records;
use crate::fit::effects::unknowns::is_physical;
use crate::model::corrections::of_the_joint;
use crate::model::effects::{AxisEffect, ModelEffect};
use crate::model::file::ModelFile;
use crate::signal::statistics::rms;
use crate::study::Study;
use crate::text::error::Result;

/// The first effect of a model with a value that it cannot have, and did not have in the model before.
pub(super) fn unphysical(
    records: &Records<'_>,
    before: &ModelFile,
    after: &ModelFile,
) -> Result<Option<String>> {
    let mut found = all_unphysical(records, after)?;
    // The model before is asked only where there is something that it could excuse.
    if !found.is_empty() {
        let known = all_unphysical(records, before)?;
        found.retain(|name| !known.contains(name));
    }
    Ok(found.into_iter().next())
}

/// The effects of a model that have a value which they cannot have.
fn all_unphysical(records: &Records<'_>, model: &ModelFile) -> Result<Vec<String>> {
    let named = model.effects.iter().map(ModelEffect::name);
    let pairs = named.zip(model.effects_in_si()?);
    let at_fault = pairs.filter(|(_, effect)| {
        let bound = AxisEffect::from(effect);
        !is_physical(&bound, &effect.values, records)
    });
    Ok(at_fault.map(|(name, _)| name).collect())
}

/// The effect of a model whose force is largest, where that is several times the measured force and every force of the model before.
pub(super) fn cancelled(
    study: &Study,
    records: &Records<'_>,
    before: &ModelFile,
    after: &ModelFile,
) -> Result<Option<(String, f64)>> {
    let names: Vec<&str> = study.axes.iter().map(|a| a.name.as_str()).collect();
    let rows = records.rows_per_axis().max(1);
    // Per effect and axis.
    let sizes = |model: &ModelFile| -> Result<Vec<(String, Vec<f64>)>> {
        let joint = of_the_joint(&model.effects_in_si()?).into_iter();
        let sizes = joint.map(|term| {
            let bound = AxisEffect::from(&term);
            let force = records.force(&bound, &term.values);
            let axes = force.chunks_exact(rows).map(rms);
            (bound.name(&names), axes.collect())
        });
        Ok(sizes.collect())
    };
    // Near a resonance a spring is as large as the inertia force, and the applied force small.
    let inertia_force = |axis: usize| {
        let column = records.accelerations[axis].as_ref();
        column.map_or(0.0, |column| {
            after.axes[axis].inertia * rms(&column[axis * rows..][..rows])
        })
    };
    let known = |axis: usize| records.references.force[axis].max(inertia_force(axis));
    let mut known: Vec<f64> = (0..study.axes.len()).map(known).collect();
    let times = |known: &[f64], sizes: &[f64]| -> f64 {
        let pairs = sizes.iter().zip(known);
        pairs.map(|(size, known)| size / known).fold(0.0, f64::max)
    };
    let mut large = sizes(after)?;
    large.retain(|(_, sizes)| times(&known, sizes) > MAX_FORCE);
    // The forces of the model before are asked for only where they could excuse one.
    if !large.is_empty() {
        for (_, sizes) in sizes(before)? {
            known.iter_mut().zip(sizes).for_each(|(k, s)| *k = k.max(s));
        }
    }
    let mut large = large
        .into_iter()
        .map(|(name, sizes)| (name, times(&known, &sizes)));
    Ok(large.find(|(_, times)| *times > MAX_FORCE))
}
