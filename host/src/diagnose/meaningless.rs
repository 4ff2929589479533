//! Values of a fit that mean nothing by themselves: those that an effect cannot have, and those of
//! effects that cancel, as one does whose force is several times what is measured.

use crate::fit::effects::columns::Records;
use crate::fit::effects::unknowns::{MAX_FORCE, is_physical};
use crate::model::corrections::of_the_joint;
use crate::model::effects::{AxisEffect, ModelEffect};
use crate::model::file::ModelFile;
use crate::study::Study;
use crate::study::series::rms;
use crate::text::error::Result;
use jointwatch_shared::effect::Entry;

/// The first effect of a model with a value that it cannot have, and did not have in the model
/// before.
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

/// The first of the added effects, `coulomb@x`, of which the records tell no strength.
pub(super) fn undetermined(model: &ModelFile, added: &[String]) -> Option<String> {
    let mut parameters = model.effects.iter().flat_map(|e| &e.parameters);
    if parameters.all(|p| p.interval.is_none()) {
        // A fit that knows no intervals says nothing of this.
        return None;
    }
    // What has a strength in every record is told by how those differ; the interval is of their
    // size.
    let one_for_all =
        |e: &&ModelEffect| Entry::named(&e.effect).is_some_and(|e| !e.is_per_record());
    let effects = model.effects.iter().filter(one_for_all);
    let effects = effects.filter(|e| e.is_undetermined());
    effects
        .map(ModelEffect::name)
        .find(|name| added.contains(name))
}

/// The effect of a model whose force is largest, where that is several times the measured force and
/// every force of the model before.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify;
    use crate::signal::motion::{Motion, motions};
    use crate::study::MemoryLog;

    #[test]
    fn a_strength_is_not_told_where_every_interval_holds_0() {
        let text = "sample_rate_hz = 500.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                    inertia = 0\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[base]\nterms = [\"stiffness@x\", \"position_friction@x\"]\n";
        let x =
            |row: i32| 1e-3 * (0.1 * f64::from(row)).sin() + 4e-4 * (0.37 * f64::from(row)).sin();
        let all = || (0..4000).map(x);
        let log = MemoryLog {
            name: "a".into(),
            columns: vec![
                ("x".into(), all().collect()),
                // Noise of half a newton stands where the friction would.
                (
                    "F".into(),
                    all()
                        .zip((0_u64..).map(|n| n.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40))
                        .map(|(x, n)| 2e4 * x + n as f64 / f64::from(1 << 24) - 0.5)
                        .collect(),
                ),
            ],
        };
        let study = Study::of_memory("memory", text, &[log]).unwrap();
        let mut model = identify::physical(&study).unwrap().model;
        let added = ["stiffness@x", "position_friction@x"].map(String::from);
        assert_eq!(
            undetermined(&model, &added).as_deref(),
            Some("position_friction@x")
        );
        assert_eq!(undetermined(&model, &added[..1]), None);
        let parameters = model.effects.iter_mut().flat_map(|e| &mut e.parameters);
        parameters.for_each(|p| p.interval = None);
        assert_eq!(
            undetermined(&model, &added),
            None,
            "a fit without intervals"
        );
    }

    #[test]
    fn a_strength_by_place_is_below_nothing_nowhere() {
        let text = "sample_rate_hz = 500.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                    inertia = 0\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[base]\nterms = [\"bouc_wen_by_place@x\"]\n";
        // From −1 to 3 mm, gripped harder above.
        let x = |row: i32| 1e-3 * (1.0 + 2.0 * (0.05 * f64::from(row)).sin());
        let force = |row: i32| {
            let velocity = (0.05 * f64::from(row)).cos();
            (4.0 + 1000.0 * x(row)) * (20.0 * velocity).tanh()
        };
        let log = MemoryLog {
            name: "a".into(),
            columns: vec![
                ("x".into(), (0..4000).map(x).collect()),
                ("F".into(), (0..4000).map(force).collect()),
            ],
        };
        let study = Study::of_memory("memory", text, &[log]).unwrap();
        let mut model = identify::physical(&study).unwrap().model;
        let motions = motions(&study, &model.filters).unwrap();
        let motions: Vec<&Motion> = motions.iter().collect();
        let band = model.filters.band.clone();
        let records = Records::new(&study.axes, &motions, &band);
        assert_eq!(all_unphysical(&records, &model).unwrap(), [""; 0]);
        let slope = |model: &mut ModelFile, value| {
            let mut parameters = model.effects[0].parameters.iter_mut();
            let slope = parameters.find(|p| p.name == "friction_slope");
            slope.unwrap().value = value;
        };
        // 4 N less 2 N/mm · 3 mm.
        slope(&mut model, -2000.0);
        assert_eq!(
            all_unphysical(&records, &model).unwrap(),
            ["bouc_wen_by_place@x"]
        );
        slope(&mut model, -1000.0);
        assert_eq!(all_unphysical(&records, &model).unwrap(), [""; 0]);
    }

    #[test]
    fn an_inertia_is_at_least_half_of_what_is_stated() {
        let text = "sample_rate_hz = 500.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x\"\nforce = \"F\"\n\
                    inertia = 2\n[[record]]\nfile = \"a\"\nrole = \"train\"\n[base]\nterms = [\"stiffness@x\"]\n";
        let wave = |size: f64| (0..4000).map(move |row| size * (0.05 * f64::from(row)).sin());
        let log = MemoryLog {
            name: "a".into(),
            columns: vec![
                ("x".into(), wave(1e-3).collect()),
                ("F".into(), wave(5.0).collect()),
            ],
        };
        let study = Study::of_memory("memory", text, &[log]).unwrap();
        let model = identify::physical(&study).unwrap().model;
        let motions = motions(&study, &model.filters).unwrap();
        let motions: Vec<&Motion> = motions.iter().collect();
        let records = Records::new(&study.axes, &motions, &model.filters.band);
        let error = AxisEffect::parse("inertia_error@x", &["x"]).unwrap();
        // A rotor may have been left out, but nobody weighs twice of what is there.
        for (kg, can_be) in [(-1.1, false), (-0.9, true), (3.0, true)] {
            assert_eq!(is_physical(&error, &[kg], &records), can_be, "{kg} kg");
        }
    }
}
