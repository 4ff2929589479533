//! The columns of terms: laws run along the records at unit strengths, low-passed and thinned out.

use super::columns::Records;
use crate::model::effects::AxisEffect;
use crate::model::per_record::{self, PHASES};
use crate::model::scalar::HostScalar;
use crate::model::time_history::{TimeHistory, law_parameters};
use jointwatch_shared::effect::{Acts, Parameters, SLOPES};
use jointwatch_shared::scalar::dual::Dual;
use rayon::prelude::*;

/// The inputs that the forces of one run follow.
type Inputs<'a> = &'a [Option<&'static str>];

/// What a column of a term stands for: a parameter that the force is proportional to, at 1; in one
/// record alone, where its size is another one in each.
struct Unit {
    parameter: usize,
    record: Option<usize>,
    phase: f64,
}

/// Leaves a law's parameters as they are at every row.
pub(super) fn unchanged<S>(_: &TimeHistory<'_>) -> fn(usize, &mut Parameters<S>) {
    |_, _| ()
}

/// Whether two effects at these values have one run of a law: they differ by what they follow, and
/// by strengths.
pub(super) fn share_a_run(
    (one, values): (&AxisEffect, &[f64]),
    (other, others): (&AxisEffect, &[f64]),
) -> bool {
    let listed = one.entry.parameters().iter().zip(values.iter().zip(others));
    let own_size = one.entry.is_per_record();
    !own_size
        && one.is_twin(other)
        && listed
            .into_iter()
            .all(|(p, (a, b))| p.is_linear() || a == b)
}

impl<'a> Records<'a> {
    /// One column per linear parameter of a term: its share of the force when it is 1 and the other
    /// linear ones are 0. A parameter with a size of its own in every record has one per record
    /// and phase.
    ///
    /// `values` are the term's parameters in SI, of which only those that shape the law are read.
    pub(crate) fn columns(&self, bound: &AxisEffect, values: &[f64]) -> Vec<Vec<f64>> {
        self.columns_following(bound, values, &[bound.input])
            .swap_remove(0)
    }

    /// The columns of each of several terms. Those that differ only by what they follow have one
    /// run of their law.
    pub(crate) fn columns_of_all(&self, terms: &[(&AxisEffect, &[f64])]) -> Vec<Vec<Vec<f64>>> {
        let of_run = |at: usize| {
            let mut before = terms[..at].iter();
            before
                .position(|known| share_a_run(*known, terms[at]))
                .unwrap_or(at)
        };
        let runs: Vec<usize> = (0..terms.len()).map(of_run).collect();
        let columns = (0..terms.len()).into_par_iter().map(|first| {
            let sharing = (first..terms.len()).filter(|&at| runs[at] == first);
            let inputs: Vec<Option<&'static str>> = sharing.map(|at| terms[at].0.input).collect();
            match inputs.is_empty() {
                true => Vec::new(),
                false => self.columns_following(terms[first].0, terms[first].1, &inputs),
            }
        });
        let columns: Vec<Vec<Vec<Vec<f64>>>> = columns.collect();
        let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
        let of_term = runs.iter().map(|&first| columns[first].next());
        of_term.map(Option::unwrap_or_default).collect()
    }

    /// The columns of an effect for each of several inputs that its force may follow.
    fn columns_following(
        &self,
        bound: &AxisEffect,
        values: &[f64],
        inputs: Inputs<'_>,
    ) -> Vec<Vec<Vec<f64>>> {
        let units = self.units(bound);
        let runs: Vec<Vec<Vec<f64>>> = if units.len() > 1 && !bound.entry.is_per_record() {
            self.linear_columns(bound, values, inputs)
        } else {
            let units = units.par_iter();
            units
                .map(|unit| self.unit_column(bound, values, unit, inputs))
                .collect()
        };
        let mut runs: Vec<_> = runs.into_iter().map(Vec::into_iter).collect();
        let of_input = |_: &Option<_>| runs.iter_mut().filter_map(Iterator::next).collect();
        inputs.iter().map(of_input).collect()
    }

    /// What each column of a term stands for.
    fn units(&self, bound: &AxisEffect) -> Vec<Unit> {
        let mut units = Vec::new();
        let linear = bound.entry.parameters().iter().enumerate();
        for (index, parameter) in linear.filter(|(_, p)| p.is_linear()) {
            let unit = |record, phase| Unit {
                parameter: index,
                record,
                phase,
            };
            let phases = &PHASES[..parameter.phases()];
            if phases.is_empty() {
                units.push(unit(None, 0.0));
            }
            for record in self.own_size(parameter) {
                units.extend(phases.iter().map(|&phase| unit(Some(record), phase)));
            }
        }
        units
    }

    /// How many columns [`Records::columns`] makes of a term.
    pub(crate) fn count(&self, bound: &AxisEffect) -> usize {
        self.units(bound).len()
    }

    /// One column of an effect, for each input.
    fn unit_column(
        &self,
        bound: &AxisEffect,
        values: &[f64],
        unit: &Unit,
        inputs: Inputs<'_>,
    ) -> Vec<Vec<f64>> {
        let mut parameters = law_parameters(bound.entry, values);
        let listed = bound.entry.parameters().iter().zip(&mut parameters);
        for (index, (_, value)) in listed.enumerate().filter(|(_, (p, _))| p.is_linear()) {
            *value = f64::from(u8::from(index == unit.parameter));
        }
        let place = (unit.record, unit.phase);
        let law = (bound, &parameters);
        let columns = self.column(law, place, inputs, unchanged, |force: f64| [force]);
        columns.into_iter().map(|[column]| column).collect()
    }

    /// The columns of a term with several linear parameters, for each input, from one run of its
    /// law ([`SLOPES`] at most): what is linear in a parameter has its slope as column.
    fn linear_columns(
        &self,
        bound: &AxisEffect,
        values: &[f64],
        inputs: Inputs<'_>,
    ) -> Vec<Vec<Vec<f64>>> {
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
            let law = (bound, &parameters);
            let columns = self.column(law, (None, 0.0), inputs, unchanged, |force| force.slopes);
            let mut columns: Vec<_> = columns.into_iter().map(Vec::from).collect();
            (0..run.len()).map(move |slot| {
                columns
                    .iter_mut()
                    .map(|of_input| std::mem::take(&mut of_input[slot]))
                    .collect()
            })
        });
        runs.collect()
    }

    /// The force of a term with all of its parameters, SI; of one with a size of its own in every
    /// record, nothing.
    pub(crate) fn force(&self, bound: &AxisEffect, values: &[f64]) -> Vec<f64> {
        if bound.entry.is_per_record() {
            return self.nothing();
        }
        let parameters = law_parameters(bound.entry, values);
        let law = (bound, &parameters);
        let column = self.column(law, (None, 0.0), &[bound.input], unchanged, |force: f64| {
            [force]
        });
        column.into_iter().flatten().next().unwrap_or_default()
    }

    /// Takes from a residual what a term with a size of its own in every record has in it, by least
    /// squares in each.
    pub(crate) fn take_out(&self, bound: &AxisEffect, values: &[f64], residual: &mut [f64]) {
        if !bound.entry.is_per_record() {
            return;
        }
        let units = self.units(bound);
        for record in 0..self.rows.len() {
            let of_record = units.iter().filter(|unit| unit.record == Some(record));
            let columns: Vec<Vec<f64>> = of_record
                .flat_map(|unit| self.unit_column(bound, values, unit, &[bound.input]))
                .collect();
            let factors = per_record::least_squares(&columns, residual);
            for (column, factor) in columns.iter().zip(factors) {
                residual
                    .iter_mut()
                    .zip(column)
                    .for_each(|(r, c)| *r -= factor * c);
            }
        }
    }

    /// Evaluates a law on every record, or on one alone, with what `change` makes of its strengths
    /// from row to row; then for each input that its force may follow low-passes and thins out.
    /// `part` is what of its force is wanted, one column each.
    pub(super) fn column<S: HostScalar, C: FnMut(usize, &mut Parameters<S>), const N: usize>(
        &self,
        (bound, parameters): (&AxisEffect, &Parameters<S>),
        (only, phase): (Option<usize>, f64),
        inputs: Inputs<'_>,
        change: impl Fn(&TimeHistory<'a>) -> C + Sync,
        part: impl Fn(S) -> [f64; N] + Sync,
    ) -> Vec<[Vec<f64>; N]> {
        let both = bound.entry.acts == Acts::BothAxes && self.axes == 2;
        let along = |record: usize, history: &TimeHistory<'a>| {
            let mut own = [(); N].map(|()| vec![0.0; history.rows()]);
            let mut other = [(); N].map(|()| vec![0.0; if both { history.rows() } else { 0 }]);
            let (entry, axis) = (bound.entry, bound.axis);
            history.along_changing(
                entry,
                *parameters,
                change(history),
                axis,
                phase,
                |row, [f, g]| {
                    for (series, value) in own.iter_mut().zip(part(f)) {
                        series[row] = value;
                    }
                    if both {
                        for (series, value) in other.iter_mut().zip(part(g)) {
                            series[row] = value;
                        }
                    }
                },
            );
            let followed = |input: &Option<&'static str>| {
                let factor = history.input(*input);
                let thinned = |series: &Vec<f64>| self.thinned(record, &factor.times(series));
                [&own, &other].map(|series| series.each_ref().map(thinned))
            };
            inputs.iter().map(followed).collect::<Vec<_>>()
        };
        let records = self.histories.par_iter().enumerate();
        let wanted = records.map(|(record, history)| {
            only.is_none_or(|only| only == record)
                .then(|| along(record, history))
        });
        let wanted: Vec<_> = wanted.collect();
        let whole = |at: usize| {
            let mut whole = [(); N].map(|()| self.nothing());
            let mut start = 0;
            for (of_record, &rows) in wanted.iter().zip(&self.rows) {
                if let Some([own, other]) = of_record.as_ref().map(|inputs| &inputs[at]) {
                    let mut put = |axis: usize, series: &[Vec<f64>; N]| {
                        let at = axis * self.rows_per_axis() + start;
                        for (whole, series) in whole.iter_mut().zip(series) {
                            whole[at..at + rows].copy_from_slice(series);
                        }
                    };
                    put(bound.axis, own);
                    if both {
                        put(1 - bound.axis, other);
                    }
                }
                start += rows;
            }
            if let Some(projection) = self.projection {
                whole.iter_mut().for_each(|column| projection(column));
            }
            whole
        };
        (0..inputs.len()).map(whole).collect()
    }
}
