//! How the forces of laws change with the shapes that are searched for.

use super::columns::Records;
use super::laws::{share_a_run, unchanged};
use super::unknowns::ShapeUnknown;
use crate::model::effects::AxisEffect;
use crate::model::scalar::HostScalar;
use crate::model::time_history::{TimeHistory, law_parameters};
use jointwatch_shared::effect::about::{Parameter, Role};
use jointwatch_shared::effect::{Parameters, SLOPES};
use jointwatch_shared::scalar::dual::Dual;
use rayon::prelude::*;

/// Within this part of a shape's value its tangent stands for it.
pub(crate) const SHAPES_MOVE: f64 = 0.3;

/// A term of a sum, as its force is now.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub(crate) bound: &'a AxisEffect,
    /// Its parameters, SI; those that the force is proportional to are taken from the factors.
    pub(crate) values: &'a [f64],
    /// The factors of its columns.
    pub(crate) factors: &'a [f64],
}

/// One run of a law along the records.
struct Run<'a> {
    /// The terms that it serves.
    sharing: Vec<At<'a>>,
    /// By which unknowns, and which parameters they are of the law.
    by: Vec<(usize, usize)>,
}

impl<'a> Records<'a> {
    /// How the force of a sum of terms changes with the logarithm of each unknown, at fixed
    /// factors: one column per unknown.
    ///
    /// All shapes of a term come from one run of its law along the records ([`SLOPES`] at most),
    /// since powers and exponentials cost far more than their derivatives.
    pub(crate) fn slopes(&self, terms: &[At<'_>], unknowns: &[&ShapeUnknown]) -> Vec<Vec<f64>> {
        let places_of = |term: usize| -> Vec<(usize, usize)> {
            let all = unknowns.iter().enumerate();
            let places = all.flat_map(|(at, unknown)| unknown.places.iter().map(move |p| (at, *p)));
            let own = places.filter(|(_, place)| place.0 == term);
            own.map(|(at, place)| (at, place.1))
                .filter(|(_, index)| !terms[term].bound.entry.parameters()[*index].is_given())
                .collect()
        };
        let mut runs: Vec<Run<'_>> = Vec::new();
        for sharing in sharing(terms) {
            let places = places_of(sharing[0]);
            let terms: Vec<At<'_>> = sharing.into_iter().map(|term| terms[term]).collect();
            runs.extend(places.chunks(SLOPES).map(|by| Run {
                sharing: terms.clone(),
                by: by.to_vec(),
            }));
        }
        let slopes = |run: &Run<'_>| {
            let by: Vec<usize> = run.by.iter().map(|(_, index)| *index).collect();
            match by.len() {
                1 => self.run::<1>(&run.sharing, &by),
                _ => self.run::<SLOPES>(&run.sharing, &by),
            }
        };
        let found: Vec<Vec<Vec<f64>>> = runs.par_iter().map(slopes).collect();
        let mut sums = vec![self.nothing(); unknowns.len()];
        for (run, columns) in runs.iter().zip(found) {
            for ((unknown, _), column) in run.by.iter().zip(columns) {
                add(&mut sums[*unknown], &column);
            }
        }
        sums
    }

    /// How the force of terms that share a run of their law changes with the logarithms of some of
    /// its shapes, N at most.
    fn run<const N: usize>(&self, sharing: &[At<'_>], by: &[usize]) -> Vec<Vec<f64>>
    where
        Dual<N>: HostScalar,
    {
        let (bound, entry) = (sharing[0].bound, sharing[0].bound.entry);
        let taken = law_parameters(entry, sharing[0].values);
        let mut parameters: Parameters<Dual<N>> = taken.map(Dual::constant);
        for (slot, &index) in by.iter().enumerate() {
            let role = entry.parameters()[index].role;
            let reciprocal = matches!(role, Role::Shape(shape) if shape.reciprocal);
            // d v/d ln v = v, and d (1/v)/d ln v = −1/v.
            let value = taken[index];
            parameters[index].slopes[slot] = if reciprocal { -value } else { value };
        }
        let mut own_size = entry.parameters().iter();
        let Some(size) = own_size.position(Parameter::is_per_record) else {
            return self.slopes_of_sum(sharing, &parameters).into();
        };
        let mut sums = [(); N].map(|()| self.nothing());
        let of_records = sharing[0].factors.chunks_exact(entry.phases_per_record());
        for (record, factors) in of_records.enumerate() {
            let quarter = factors.get(1).copied().unwrap_or(0.0);
            parameters[size] = Dual::constant(factors[0].hypot(quarter));
            let place = (
                Some(record),
                quarter.atan2(factors[0]) / std::f64::consts::TAU,
            );
            let inputs = [bound.input];
            let columns = self.column((bound, &parameters), place, &inputs, unchanged, |f| {
                f.slopes
            });
            for (sum, part) in sums.iter_mut().zip(columns.iter().flatten()) {
                add(sum, part);
            }
        }
        sums.into()
    }

    /// The slopes of the force of terms that share a run of their law, whose strengths are sums of
    /// what each has at a row.
    fn slopes_of_sum<const N: usize>(
        &self,
        sharing: &[At<'_>],
        parameters: &Parameters<Dual<N>>,
    ) -> [Vec<f64>; N]
    where
        Dual<N>: HostScalar,
    {
        let bound = sharing[0].bound;
        let listed = bound.entry.parameters().iter().enumerate();
        let linear = listed.filter(|(_, p)| p.is_linear());
        let linear: Vec<usize> = linear.map(|(index, _)| index).collect();
        let change = |history: &TimeHistory<'a>| {
            let inputs = sharing.iter().map(|term| history.input(term.bound.input));
            let inputs: Vec<_> = inputs.zip(sharing).collect();
            let linear = &linear;
            move |row: usize, parameters: &mut Parameters<Dual<N>>| {
                for (place, &index) in linear.iter().enumerate() {
                    let parts = inputs.iter();
                    let strength = parts.map(|(input, term)| input.at(row) * term.factors[place]);
                    parameters[index] = Dual::constant(strength.sum());
                }
            }
        };
        let columns = self.column((bound, parameters), (None, 0.0), &[None], change, |f| {
            f.slopes
        });
        let [sum] = columns
            .try_into()
            .unwrap_or_else(|_| [[(); N].map(|()| self.nothing())]);
        sum
    }
}

/// The terms, those together that share a run of their law.
fn sharing(terms: &[At<'_>]) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    for (at, term) in terms.iter().enumerate() {
        let first = |known: &Vec<usize>| (terms[known[0]].bound, terms[known[0]].values);
        let same = |known: &&mut Vec<usize>| share_a_run(first(known), (term.bound, term.values));
        match all.iter_mut().find(same) {
            Some(known) => known.push(at),
            None => all.push(vec![at]),
        }
    }
    all
}

fn add(sum: &mut [f64], part: &[f64]) {
    sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
}
