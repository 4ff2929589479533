//! Validation records that hold what a training record holds.

use crate::study::{Record, Role, Study};

/// A sentence for every validation record whose forces and displacements are those of a training
/// record.
pub(in crate::study) fn copies(study: &Study) -> Vec<String> {
    let of = |role: Role| study.records.iter().filter(move |r| r.role == role);
    let sentence = |validation: &Record| {
        let copied = of(Role::Train).find(|training| is_copy(training, validation))?;
        Some(format!(
            "{} holds the same forces and displacements as {}, so its error says nothing of motions that the model has not seen; \
             give a record of another run the role \"validate\"",
            validation.file, copied.file
        ))
    };
    of(Role::Validate).filter_map(sentence).collect()
}

/// Whether two records hold the same forces and displacements, row by row.
fn is_copy(one: &Record, other: &Record) -> bool {
    let mut axes = one.axes.iter().zip(&other.axes);
    axes.all(|(a, b)| {
        a.force == b.force
            && a.displacement_first == b.displacement_first
            && a.displacement_second == b.displacement_second
    })
}
