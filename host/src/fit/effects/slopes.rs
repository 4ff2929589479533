//! How the forces of laws change with the shapes that are searched for.

use super::columns::Records;
use super::unknowns::ShapeUnknown;
use crate::model::effects::AxisEffect;
use crate::model::scalar::HostScalar;
use crate::model::time_history::law_parameters;
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::effect::{Parameters, SLOPES};
use jointwatch_shared::scalar::dual::Dual;
use rayon::prelude::*;

/// A term of a sum, as its force is now.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub(crate) bound: &'a AxisEffect,
    /// Its parameters, SI; those that the force is proportional to are taken from the factors.
    pub(crate) values: &'a [f64],
    /// The factors of its columns.
    pub(crate) factors: &'a [f64],
}

impl Records<'_> {
    /// How the force of a sum of terms changes with the logarithm of each unknown, at fixed factors: one column per unknown.
    ///
    /// All shapes of a term come from one run of its law along the records ([`SLOPES`] at most), since powers and exponentials cost far more
    /// than their derivatives.
    pub(crate) fn slopes(&self, terms: &[At<'_>], unknowns: &[&ShapeUnknown]) -> Vec<Vec<f64>> {
        let places_of = |term: usize| -> Vec<(usize, usize)> {
            let all = unknowns.iter().enumerate();
            let places = all.flat_map(|(at, unknown)| unknown.places.iter().map(move |p| (at, *p)));
            let own = places.filter(|(_, place)| place.0 == term);
            own.map(|(at, place)| (at, place.1))
                .filter(|(_, index)| !terms[term].bound.entry.parameters()[*index].is_given())
                .collect()
        };
        let runs: Vec<(At<'_>, Vec<(usize, usize)>)> = (0..terms.len())
            .flat_map(|term| {
                let places = places_of(term);
                let runs = places.chunks(SLOPES).map(|run| (terms[term], run.to_vec()));
                runs.collect::<Vec<_>>()
            })
            .collect();
        let found: Vec<Vec<Vec<f64>>> = runs
            .par_iter()
            .map(|(term, run)| {
                let by: Vec<usize> = run.iter().map(|(_, index)| *index).collect();
                match by.len() {
                    1 => self.run::<1>(*term, &by),
                    _ => self.run::<SLOPES>(*term, &by),
                }
            })
            .collect();
        let mut sums = vec![self.nothing(); unknowns.len()];
        for ((_, run), columns) in runs.iter().zip(found) {
            for ((unknown, _), column) in run.iter().zip(columns) {
                add(&mut sums[*unknown], &column);
            }
        }
        sums
    }

    /// The columns of a term with several linear parameters, from one run of its law ([`SLOPES`] at most): what is linear in a parameter
    /// has its slope as column.
    pub(super) fn linear_columns(&self, bound: &AxisEffect, values: &[f64]) -> Vec<Vec<f64>> {
        let taken = law_parameters(bound.entry, values);
        let listed = bound.entry.parameters().iter().enumerate();
        let linear = listed.filter(|(_, p)| p.is_linear());
        let linear: Vec<usize> = linear.map(|(index, _)| index).collect();
        let runs = linear.par_chunks(SLOPES).flat_map_iter(|run| {
            let mut parameters: Parameters<Dual<SLOPES>> = taken.map(Dual::constant);
            for &index in &linear {
                parameters[index] = Dual::constant(0.0);
            }
            for (slot, &index) in run.iter().enumerate() {
                parameters[index].slopes[slot] = 1.0;
            }
            let columns = self.column(bound, &parameters, (None, 0.0), |force| force.slopes);
            columns.into_iter().take(run.len())
        });
        runs.collect()
    }

    /// How the force of a term changes with the logarithms of some of its shapes, N at most.
    fn run<const N: usize>(&self, term: At<'_>, by: &[usize]) -> Vec<Vec<f64>>
    where
        Dual<N>: HostScalar,
    {
        let entry = term.bound.entry;
        let mut values = term.values.to_vec();
        self.put(term.bound, term.factors, &mut values);
        let taken = law_parameters(entry, &values);
        let mut parameters: Parameters<Dual<N>> = taken.map(Dual::constant);
        for (slot, &index) in by.iter().enumerate() {
            let role = entry.parameters()[index].role;
            let reciprocal = matches!(role, Role::Shape(shape) if shape.reciprocal);
            // d v/d ln v = v, and d (1/v)/d ln v = −1/v.
            let value = taken[index];
            parameters[index].slopes[slot] = if reciprocal { -value } else { value };
        }
        let along = |parameters: &Parameters<Dual<N>>, only: Option<usize>, phase: f64| {
            self.column(term.bound, parameters, (only, phase), |force| force.slopes)
        };
        let mut own_size = entry.parameters().iter();
        let Some(size) = own_size.position(Parameter::is_per_record) else {
            return along(&parameters, None, 0.0).into();
        };
        let mut sums = [(); N].map(|()| self.nothing());
        for (record, factors) in term
            .factors
            .chunks_exact(entry.phases_per_record())
            .enumerate()
        {
            let quarter = factors.get(1).copied().unwrap_or(0.0);
            parameters[size] = Dual::constant(factors[0].hypot(quarter));
            let phase = quarter.atan2(factors[0]) / std::f64::consts::TAU;
            for (sum, part) in sums.iter_mut().zip(along(&parameters, Some(record), phase)) {
                add(sum, &part);
            }
        }
        sums.into()
    }
}

fn add(sum: &mut [f64], part: &[f64]) {
    sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
}
