//! What a model leaves on records that it was not fitted to.

use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::Solved;
use crate::fit::effects::unknowns::shapes;
use crate::fit::errors::Sums;
use crate::fit::with_base::OnRecords;
use crate::model::effects::AxisEffect;
use crate::model::file::{Base, JudgedOn, ModelFile, NoBase};
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::text::error::Result;

/// RMS error over RMS force per axis on other records than a model's terms were solved for.
pub(super) fn relative_errors(
    records: &Records<'_>,
    terms: &[AxisEffect],
    solved: &Solved,
) -> Vec<f64> {
    let mut residual = records.measured.clone();
    let mut take = |column: &[f64], factor: f64| {
        for (r, c) in residual.iter_mut().zip(column) {
            *r -= factor * c;
        }
    };
    for (bound, values) in terms.iter().zip(&solved.values) {
        take(&records.force(bound, values), 1.0);
    }
    for (column, inertia) in records.accelerations.iter().zip(&solved.inertia) {
        if let (Some(column), Some(inertia)) = (column, inertia) {
            take(column, *inertia);
        }
    }
    for (bound, values) in terms.iter().zip(&solved.values) {
        records.take_out(bound, values, &mut residual);
    }
    let rows = records.rows_per_axis();
    let axes = residual
        .chunks_exact(rows)
        .zip(records.measured.chunks_exact(rows));
    axes.map(|(error, force)| Sums::of(error, force).relative_error())
        .collect()
}

/// Rows that a model was not learnt from: the validation records, or where there are none, blocks of the training records.
pub(super) struct Unseen<'a> {
    pub(super) study: &'a Study,
    pub(super) model: &'a ModelFile,
    pub(super) training: &'a [&'a Motion],
    pub(super) validation: Option<&'a Records<'a>>,
}

impl Unseen<'_> {
    /// What these rows are.
    pub(super) fn judged_on(&self) -> JudgedOn {
        match self.validation {
            Some(_) => JudgedOn::Validation,
            None => JudgedOn::HeldOutBlocks,
        }
    }

    /// RMS error over RMS force per axis of terms with their values; each block is predicted with the shapes that were found and strengths
    /// from the others.
    pub(super) fn errors(&self, terms: &[AxisEffect], solution: &Solution) -> Result<Vec<f64>> {
        if let Some(records) = self.validation {
            return Ok(relative_errors(records, terms, &solution.solved));
        }
        let terms = terms.iter().zip(&solution.solved.values);
        let terms: Vec<_> = terms
            .map(|(term, values)| (*term, values.clone()))
            .collect();
        let alone = ModelFile {
            base: Base::None(NoBase {
                inputs: self.model.base.inputs().to_vec(),
            }),
            ..self.model.clone()
        };
        let axes = &self.study.axes;
        let errors = OnRecords::new(axes, self.training, &alone)?
            .held_out_errors(&terms, &vec![0.0; axes.len()])?;
        Ok(errors.iter().map(|e| e.relative_error).collect())
    }
}

/// The shape unknowns of terms, read from their parameters.
pub(super) fn shapes_of(
    records: &Records<'_>,
    terms: &[AxisEffect],
    values: &[Vec<f64>],
) -> Vec<f64> {
    let unknowns = shapes(terms, &records.references);
    let owners = unknowns.iter().map(|u| u.places[0]);
    owners.map(|(term, index)| values[term][index]).collect()
}
