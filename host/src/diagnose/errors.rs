//! What a model leaves on records that it was not fitted to.

use super::search::bench::rows_of;
use super::search::blocks::Blocks;
use super::search::score::NO_POWER;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::Solved;
use crate::fit::effects::unknowns::shapes;
use crate::fit::errors::Sums;
use crate::fit::with_base::OnRecords;
use crate::model::effects::AxisEffect;
use crate::model::file::{Base, JudgedOn, ModelFile, NoBase};
use crate::signal::motion::Motion;
use crate::signal::spectrum::{Accumulator, MIN_LINES, window_for};
use crate::study::Study;
use crate::study::series::{mean, mean_square};
use crate::text::error::Result;

/// Windows that a spectrum of what is left is the mean of, where the records are long enough.
const WINDOWS: usize = 12;

/// What a model's terms leave of the force of every axis, on other records than they were solved
/// for.
fn left(records: &Records<'_>, terms: &[AxisEffect], solved: &Solved) -> Vec<f64> {
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
    residual
}

/// RMS error over RMS force per axis on other records than a model's terms were solved for.
pub(super) fn relative_errors(
    records: &Records<'_>,
    terms: &[AxisEffect],
    solved: &Solved,
) -> Vec<f64> {
    let residual = left(records, terms, solved);
    let rows = records.rows_per_axis();
    let axes = residual
        .chunks_exact(rows)
        .zip(records.measured.chunks_exact(rows));
    axes.map(|(error, force)| Sums::of(error, force).relative_error())
        .collect()
}

/// The strongest line of what a model's terms leave of the force of an axis: its frequency, Hz, and
/// its part of the power.
pub(super) fn strongest_line(
    records: &Records<'_>,
    (terms, solved): (&[AxisEffect], &Solved),
    axis: usize,
) -> Option<(f64, f64)> {
    let residual = left(records, terms, solved);
    let rows = records.rows.iter();
    let wanted = (records.rows_per_axis() / WINDOWS).max(2 * MIN_LINES);
    let segment = window_for(rows.copied(), wanted);
    let mut spectrum = Accumulator::new(records.thinned_rate_hz, segment);
    let mut own = &residual[rows_of(records, axis)];
    for rows in &records.rows {
        let (record, others) = own.split_at(*rows);
        spectrum.add(record);
        own = others;
    }
    spectrum.finish().strongest()
}

/// The constant in what a model's terms leave of the force of an axis, record by record: its value,
/// and its part of the power.
pub(super) fn constants(
    records: &Records<'_>,
    (terms, solved): (&[AxisEffect], &Solved),
    axis: usize,
) -> Vec<[f64; 2]> {
    let residual = left(records, terms, solved);
    let mut own = &residual[rows_of(records, axis)];
    let each = records.rows.iter().map(|rows| {
        let (record, others) = own.split_at(*rows);
        own = others;
        let (mean, power) = (mean(record), mean_square(record));
        [mean, mean * mean / power.max(f64::MIN_POSITIVE)]
    });
    each.collect()
}

/// Rows that a model was not learnt from: the validation records, or where there are none, blocks
/// of the training records.
pub(super) struct Unseen<'a> {
    study: &'a Study,
    /// The model without its base.
    alone: ModelFile,
    training: &'a [&'a Motion],
    validation: Option<&'a Records<'a>>,
}

impl<'a> Unseen<'a> {
    /// Those of a study whose records move like this; `validation` where there are such records.
    pub(super) fn new(
        study: &'a Study,
        model: &ModelFile,
        training: &'a [&'a Motion],
        validation: Option<&'a Records<'a>>,
    ) -> Self {
        Self {
            study,
            alone: ModelFile {
                base: Base::None(NoBase {
                    inputs: model.base.motion_ranges().to_vec(),
                }),
                state_input: None,
                ..model.clone()
            },
            training,
            validation,
        }
    }

    /// The validation records, where there are any.
    pub(super) fn validation(&self) -> Option<&Records<'a>> {
        self.validation
    }

    /// What these rows are.
    pub(super) fn judged_on(&self) -> JudgedOn {
        match self.validation {
            Some(_) => JudgedOn::Validation,
            None => JudgedOn::HeldOutBlocks,
        }
    }

    /// RMS error over RMS force per axis of terms with their values; each block is predicted with
    /// the shapes that were found and strengths from the others.
    pub(super) fn errors(&self, terms: &[AxisEffect], solution: &Solution) -> Result<Vec<f64>> {
        if let Some(records) = self.validation {
            return Ok(relative_errors(records, terms, &solution.solved));
        }
        let held_out = self.held_out()?;
        let errors = held_out.held_out_errors(&valued(terms, solution), &self.no_ridge());
        Ok(errors.iter().map(|e| e.relative_error).collect())
    }

    /// Log error power of every block per axis, as a score has it: blocks of equal force energy of
    /// the validation records, or the folds of the training records.
    pub(super) fn log_errors(
        &self,
        terms: &[AxisEffect],
        solution: &Solution,
    ) -> Result<Vec<Vec<f64>>> {
        let Some(records) = self.validation else {
            let held_out = self.held_out()?;
            let squares = held_out.held_out_squares(&valued(terms, solution), &self.no_ridge());
            let measured = held_out.measured();
            let axes = squares.iter().zip(measured);
            let logs = axes.map(|(squares, force)| {
                let each = mean_square(force) * force.len() as f64 / squares.len().max(1) as f64;
                let logs = squares.iter().map(|square| log_power(square / each));
                logs.collect()
            });
            return Ok(logs.collect());
        };
        let residual = left(records, terms, &solution.solved);
        let rows = records.rows_per_axis();
        let axes = residual.chunks_exact(rows);
        let axes = axes.zip(records.measured.chunks_exact(rows));
        let logs = axes.map(|(error, force)| {
            let blocks = Blocks::new(force, &records.rows).rows.into_iter();
            let whole = mean_square(force);
            let logs = blocks.map(|rows| log_power(mean_square(&error[rows]) / whole));
            logs.collect()
        });
        Ok(logs.collect())
    }

    /// The training records without a base beside the terms.
    fn held_out(&self) -> Result<OnRecords<'_>> {
        OnRecords::new(&self.study.axes, self.training, &self.alone)
    }

    fn no_ridge(&self) -> Vec<f64> {
        vec![0.0; self.study.axes.len()]
    }
}

/// Terms with their values.
fn valued(terms: &[AxisEffect], solution: &Solution) -> Vec<(AxisEffect, Vec<f64>)> {
    let terms = terms.iter().zip(&solution.solved.values);
    let terms = terms.map(|(term, values)| (*term, values.clone()));
    terms.collect()
}

/// Where everything is explained, nothing is left to be told apart.
fn log_power(power: f64) -> f64 {
    (power + NO_POWER).ln()
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
