//! The best values of a sum of terms: from which starts the search for their shapes begins, and
//! which of its ends is kept.

use super::columns::Records;
use super::projection::{Problem, Solved, Stopped};
use super::starts;
use super::unknowns::{self, MAX_FORCE, ShapeUnknown, is_physical};
use crate::fit::least_squares::levenberg_marquardt::SMALL_GAIN;
use crate::model::effects::AxisEffect;
use crate::study::Axis;
use crate::study::series::{mean, peak, rms};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::terms::EffectValues;
use rayon::prelude::*;
use std::ops::Range;

/// Thinned rows that are wanted for each parameter.
const ROWS_PER_PARAMETER: usize = 5;
/// A gain below which starts are told apart: how low the search from one of them leads in the end
/// hardly changes any more.
const APART: f64 = 1e-3;
/// A force that varies by less than this part of its size never changes: logs have nine digits at
/// most.
const UNCHANGING: f64 = 1e-7;
/// Values that cannot be have to leave less by this factor, as power, than values that can.
const UNPHYSICAL: f64 = 1.1;

/// Where the search for the shapes of terms may start beside what a scan of their own starting
/// values finds: one value per unknown, in the order of the terms' unknowns; nothing where nothing
/// is known.
pub(crate) type AnotherStart<'a> = &'a dyn Fn(&Records<'_>) -> Result<Option<Vec<f64>>>;

/// A sum of terms at its best, before it is put into words.
pub(crate) struct Solution {
    pub(crate) shapes: Vec<ShapeUnknown>,
    /// One over the standard deviation of each axis's residual.
    pub(crate) weights: Vec<f64>,
    /// The terms at the best shapes.
    pub(crate) solved: Solved,
    /// Why the search stopped.
    pub(crate) stopped: Stopped,
}

impl Solution {
    /// The terms that were solved for with their values, and the inertia of every axis, kg or
    /// kg·m².
    pub(crate) fn in_si(
        &self,
        terms: &[AxisEffect],
        axes: &[Axis],
    ) -> (Vec<EffectValues>, Vec<f64>) {
        let values = terms.iter().zip(&self.solved.values);
        let in_si = values.map(|(bound, values)| EffectValues {
            input: bound.input,
            entry: bound.entry,
            axis: bound.axis as u8,
            values: values.clone(),
        });
        let inertia = axes.iter().zip(&self.solved.inertia);
        let inertia = inertia.map(|(axis, found)| found.or(axis.inertia).unwrap_or(0.0));
        (in_si.collect(), inertia.collect())
    }

    /// The problem that this solves.
    pub(crate) fn problem<'a>(
        &'a self,
        records: &'a Records<'a>,
        terms: &'a [AxisEffect],
    ) -> Problem<'a> {
        Problem {
            records,
            terms,
            shapes: &self.shapes,
            weights: self.weights.clone(),
        }
    }
}

/// Fits terms to records. `from` has starting values of every shape, in the order of the terms'
/// unknowns; without it every effect's own starts are scanned.
///
/// # Errors
/// One sentence: too few rows for the parameters, a force that never changes.
pub(crate) fn solve(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[AxisEffect],
    from: Option<Vec<f64>>,
) -> Result<Solution> {
    let shapes = checked_shapes(records, axes, terms)?;
    let from = match from {
        Some(start) => vec![start],
        None => scanned(records, axes, terms, &shapes)?,
    };
    solve_from(records, axes, terms, shapes, from)
}

/// The same from a scan and from one more start: the one from which the search leaves least is
/// kept.
pub(crate) fn solve_also_from(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[AxisEffect],
    another: AnotherStart<'_>,
) -> Result<Solution> {
    let shapes = checked_shapes(records, axes, terms)?;
    let mut from = scanned(records, axes, terms, &shapes)?;
    from.extend(another(records)?);
    solve_from(records, axes, terms, shapes, from)
}

/// Terms at these values of their shapes, without a search.
///
/// # Errors
/// As [`Problem::solve`].
pub(crate) fn solved_at(
    records: &Records<'_>,
    terms: &[AxisEffect],
    at: &[f64],
) -> Result<Solution> {
    let shapes = unknowns::shapes(terms, &records.references);
    let mut problem = Problem {
        records,
        terms,
        shapes: &shapes,
        weights: vec![1.0; records.accelerations.len()],
    };
    let first = problem.solve(at, None)?;
    problem.weights = residual_weights(records, &first.residual);
    let solved = problem.solve(at, Some(&first))?;
    Ok(Solution {
        weights: problem.weights,
        shapes,
        solved,
        stopped: Stopped::Direct,
    })
}

/// The shape unknowns of terms that the records can be asked about.
fn checked_shapes(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[AxisEffect],
) -> Result<Vec<ShapeUnknown>> {
    let shapes = unknowns::shapes(terms, &records.references);
    check_rows(records, terms, &shapes)?;
    check_forces(records, axes)?;
    Ok(shapes)
}

/// Where a scan of every effect's own starting values says that a search should start.
fn scanned(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[AxisEffect],
    shapes: &[ShapeUnknown],
) -> Result<Vec<Vec<f64>>> {
    if terms.iter().any(|t| t.entry.is_line()) {
        let line = |residual: &[f64], bound: &AxisEffect, unknown: &ShapeUnknown| {
            records.line_in(residual, bound.axis, &unknown.shape)
        };
        let is_line = |bound: &AxisEffect| bound.entry.is_line();
        return Ok(vec![last(records, axes, (terms, shapes), is_line, line)?]);
    }
    let mut starts = starts::starts(records, terms, shapes, axes.len());
    if terms.iter().any(|t| t.entry.pitch().is_some()) {
        let wave = |residual: &[f64], bound: &AxisEffect, unknown: &ShapeUnknown| {
            let is_pitch = bound.entry.pitch() == Some(unknown.places[0].1);
            let pitches = is_pitch.then(|| records.pitches_in(residual, bound, unknown));
            let strongest = pitches.and_then(|pitches| pitches.first().copied());
            strongest.unwrap_or_else(|| starts::middle(unknown))
        };
        let is_wave = |bound: &AxisEffect| bound.entry.pitch().is_some();
        starts.push(last(records, axes, (terms, shapes), is_wave, wave)?);
    }
    Ok(starts)
}

/// The best that is found from any of these starts, or that one of them is.
///
/// What leaves least by values that cannot be does so with what another effect leaves over, and
/// goes astray on other records: what leaves nearly as little by values that can is better. The
/// axes are weighed by their forces first, then by what is left of each.
fn solve_from(
    records: &Records<'_>,
    axes: &[Axis],
    terms: &[AxisEffect],
    shapes: Vec<ShapeUnknown>,
    from: Vec<Vec<f64>>,
) -> Result<Solution> {
    let problem = |weights: Vec<f64>| Problem {
        records,
        terms,
        shapes: &shapes,
        weights,
    };
    let judged = |solved: &Solved| {
        let mut listed = terms.iter().zip(&solved.values);
        let physical = listed.all(|(term, values)| is_physical(term, values, records));
        match physical && !cancels(records, terms, solved) {
            true => solved.cost,
            false => UNPHYSICAL * solved.cost,
        }
    };
    let forces = records.references.force.iter().take(axes.len());
    let by_force = problem(forces.map(|force| 1.0 / force).collect());
    let ends: Result<Vec<[Solved; 2]>> = from
        .par_iter()
        .map(|start| {
            let end = by_force.search(start, APART)?.0;
            Ok([end, by_force.solve(start, None)?])
        })
        .collect();
    let ends = ends?.into_iter().flatten();
    let Some(lowest) = ends.min_by(|a, b| judged(a).total_cmp(&judged(b))) else {
        return Err(Error::failed("the search for the effects found no start"));
    };
    let by_residual = problem(residual_weights(records, &lowest.residual));
    let at = by_residual.shapes_of(&lowest);
    let (end, mut stopped) = by_residual.search(&at, SMALL_GAIN)?;
    let mut solved = by_residual.settle(end)?;
    // The search may run away from there, towards forces that cancel.
    if cancels(records, terms, &solved) {
        let stayed = by_residual.solve(&at, None)?;
        if judged(&stayed) < judged(&solved) {
            (solved, stopped) = (stayed, Stopped::Direct);
        }
    }
    Ok(Solution {
        weights: residual_weights(records, &solved.residual),
        shapes,
        solved,
        stopped,
    })
}

/// Whether the force of a term is several times the measured one and that of the inertia, so that
/// others cancel it.
fn cancels(records: &Records<'_>, terms: &[AxisEffect], solved: &Solved) -> bool {
    let rows = records.rows_per_axis().max(1);
    let inertias = terms.iter().map(|term| records.count(term)).sum();
    let of_inertia = (inertias..solved.factors.len()).map(|at| at..at + 1);
    let mut at = 0;
    let of_terms = terms.iter().map(|term| {
        let own = at..at + records.count(term);
        at = own.end;
        own
    });
    let size = |columns: Range<usize>, axis: usize| {
        let mut force = vec![0.0; rows];
        for column in columns {
            let own = &solved.columns[column][axis * rows..(axis + 1) * rows];
            let pairs = force.iter_mut().zip(own);
            pairs.for_each(|(force, c)| *force += solved.factors[column] * c);
        }
        rms(&force)
    };
    let (of_terms, of_inertia): (Vec<_>, Vec<_>) = (of_terms.collect(), of_inertia.collect());
    (0..records.accelerations.len()).any(|axis| {
        let known = of_inertia.iter().map(|columns| size(columns.clone(), axis));
        let known = known.fold(records.references.force[axis], f64::max);
        let mut sizes = of_terms.iter().map(|columns| size(columns.clone(), axis));
        sizes.any(|size| size > MAX_FORCE * known)
    })
}

/// Starting values of every shape of terms of which some are found `last`: lines and short waves
/// show only in what the other terms leave of the force. `value` is where a shape of theirs starts,
/// by that residual.
fn last(
    records: &Records<'_>,
    axes: &[Axis],
    (terms, shapes): (&[AxisEffect], &[ShapeUnknown]),
    last: impl Fn(&AxisEffect) -> bool,
    value: impl Fn(&[f64], &AxisEffect, &ShapeUnknown) -> f64,
) -> Result<Vec<f64>> {
    let others = (0..terms.len()).filter(|&term| !last(&terms[term]));
    let others: Vec<usize> = others.collect();
    let bounds: Vec<AxisEffect> = others.iter().map(|&term| terms[term]).collect();
    let (values, residual) = if bounds.is_empty() {
        (Vec::new(), records.measured.clone())
    } else {
        let solved = solve(records, axes, &bounds, None)?.solved;
        (solved.values, solved.residual)
    };
    let start = |unknown: &ShapeUnknown| {
        let (term, index) = unknown.places[0];
        match others.iter().position(|&other| other == term) {
            Some(place) => values[place][index],
            None => value(&residual, &terms[term], unknown),
        }
    };
    Ok(shapes.iter().map(start).collect())
}

/// One over the standard deviation of each axis's residual.
fn residual_weights(records: &Records<'_>, residual: &[f64]) -> Vec<f64> {
    let rows = records.rows_per_axis().max(1);
    residual
        .chunks_exact(rows)
        .enumerate()
        .map(|(axis, part)| {
            // An axis that is explained to the last digit must not drown the other one.
            1.0 / rms(part).max(1e-9 * records.references.force[axis])
        })
        .collect()
}

fn check_rows(records: &Records<'_>, terms: &[AxisEffect], shapes: &[ShapeUnknown]) -> Result<()> {
    let linear: usize = terms.iter().map(|t| records.count(t)).sum();
    let inertias = records.accelerations.iter().flatten().count();
    let unknown = linear + shapes.len() + inertias;
    let rows = records.rows_per_axis();
    if records.measured.len() < ROWS_PER_PARAMETER * unknown {
        return Err(Error::data(format!(
            "{rows} independent rows (what is left behind the low-pass) are too few for {unknown} parameters: record longer, or \
             name fewer effects in [base] terms"
        )));
    }
    Ok(())
}

/// Whether the records are long enough for terms of one axis and so many numbers besides.
pub(crate) fn are_enough(records: &Records<'_>, terms: &[AxisEffect], besides: usize) -> bool {
    let linear: usize = terms.iter().map(|t| records.count(t)).sum();
    let unknown = linear + unknowns::shapes(terms, &records.references).len() + besides + 1;
    records.rows_per_axis() >= ROWS_PER_PARAMETER * unknown
}

fn check_forces(records: &Records<'_>, axes: &[Axis]) -> Result<()> {
    let rows = records.rows_per_axis();
    for (axis, force) in axes.iter().zip(records.measured.chunks_exact(rows)) {
        let mean = mean(force);
        let largest = peak(force);
        if force
            .iter()
            .all(|f| (f - mean).abs() <= UNCHANGING * largest)
        {
            return Err(Error::data(format!(
                "the force of axis {} never changes: check its column in study.toml",
                axis.name
            )));
        }
    }
    Ok(())
}
