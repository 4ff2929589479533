//! Fitting effects beside a polynomial or a network, everything together.
//!
//! The base is linear in its factors (a network with its hidden layer kept), so it is eliminated
//! exactly: the effects are fitted to what the base cannot follow ([`projection`]), by the same
//! search for shapes as effects alone, and the base then follows what they leave. The penalty on
//! the base is the one that `identify` puts on it; its strength is chosen anew, because a base with
//! an effect beside it has less to bend for. The effects go free.

mod blocks;
mod functions;
mod nuisance;

use super::effects::columns::Records;
use super::effects::slopes::{At, SHAPES_MOVE};
use super::effects::unknowns::{self, ShapeUnknown};
use super::effects::{
    AnotherStart, EffectsFit, Solution, assemble, check_inertias, solve, solve_also_from,
};
use super::inertia::inertias;
use super::polynomial::check_records;
use super::polynomial::ridge;
use crate::model::effects::AxisEffect;
use crate::model::file::{AxisError, Base, ModelFile};
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::study::series::mean;
use crate::text::error::{Error, Result};
use blocks::{Folds, held_out};
use faer::Mat;
use functions::Functions;
use nuisance::{NuisanceProjection, mean_gram};

/// How often the effects and the strength of the penalty are found anew.
const ROUNDS: usize = 2;
/// The strengths that are tried lie this far about the one before, as powers of ten.
const REACH: f64 = 2.1;
/// An effect of which less than this part of the power is left beside the base is none beside it.
const MIN_NEW: f64 = 1e-4;

/// Columns and tangents with the bounds of their factors.
fn with_bounds(columns: Vec<Vec<f64>>, slopes: Vec<Vec<f64>>) -> Vec<(Vec<f64>, [f64; 2])> {
    let free = |column| (column, [f64::NEG_INFINITY, f64::INFINITY]);
    let near = |slope| (slope, [-SHAPES_MOVE, SHAPES_MOVE]);
    let columns = columns.into_iter().map(free);
    columns.chain(slopes.into_iter().map(near)).collect()
}

/// A base with effects beside it, as fitted.
pub(crate) struct WithBase {
    /// The effects with their values beside the base.
    pub(crate) effects: EffectsFit,
    /// The base, its factors found anew.
    pub(crate) base: Base,
    /// Per axis, the strength of the penalty.
    pub(crate) ridge: Vec<f64>,
    /// Per axis, the base's factors that the records determine.
    pub(crate) effective_parameters: Vec<f64>,
}

/// A base along the training records.
pub(crate) struct OnRecords<'a> {
    axes: Vec<Axis>,
    motions: &'a [&'a Motion],
    low_pass: &'a [f64],
    /// As in the model.
    state_input: Option<&'a str>,
    records: Records<'a>,
    functions: Functions,
    gram: Mat<f64>,
    folds: Folds,
}

impl<'a> OnRecords<'a> {
    /// The base of a model along motions of the study's `axes`; an inertia that the study does not
    /// state is the one that `identify` finds.
    ///
    /// # Errors
    /// Records that do not fit the axes, are too short, or whose inertia cannot be.
    pub(crate) fn new(
        axes: &[Axis],
        motions: &'a [&'a Motion],
        model: &'a ModelFile,
    ) -> Result<Self> {
        check_records(axes, motions)?;
        let low_pass = &model.filters.band;
        let state_input = model.state_input.as_deref();
        let mut axes = axes.to_vec();
        if !matches!(model.base, Base::None(_)) {
            let known = (model.base.inputs(), state_input);
            let found = inertias(&axes, motions, known, low_pass)?;
            for (axis, found) in axes.iter_mut().zip(found) {
                axis.inertia = Some(found.value);
            }
        }
        let mut records = Records::new(&axes, motions, low_pass);
        records.beside_constant = !matches!(model.base, Base::None(_));
        let functions = Functions::new(model, motions, &records)?;
        let smear =
            (low_pass.len() as f64 * records.thinned_rate_hz / motions[0].sample_rate_hz).ceil();
        Ok(Self {
            gram: mean_gram(&functions),
            folds: Folds::new(&records.rows, records.thinned_rate_hz, smear as usize),
            axes,
            motions,
            low_pass,
            state_input,
            records,
            functions,
        })
    }

    /// The measured force of each axis.
    pub(crate) fn measured(&self) -> std::slice::ChunksExact<'_, f64> {
        let rows = self.records.rows_per_axis().max(1);
        self.records.measured.chunks_exact(rows)
    }

    fn projections(&self, ridge: &[f64]) -> Result<Vec<NuisanceProjection>> {
        let axes = ridge.iter().enumerate();
        axes.map(|(axis, &lambda)| {
            NuisanceProjection::new(&self.functions, &self.gram, axis, lambda)
        })
        .collect()
    }

    /// Per axis, the part of a term's force (its power about the mean) that the base can follow at
    /// these strengths of the penalty; nothing on an axis on which the term does not act.
    ///
    /// # Errors
    /// Records that leave the base undetermined.
    pub(crate) fn followed(
        &self,
        terms: &[(AxisEffect, Vec<f64>)],
        ridge: &[f64],
    ) -> Result<Vec<Vec<Option<f64>>>> {
        let projections = self.projections(ridge)?;
        let rows = self.records.rows_per_axis().max(1);
        let part = |(bound, values): &(AxisEffect, Vec<f64>)| {
            let force = self.records.force(bound, values);
            let axes = force.chunks_exact(rows).zip(&projections);
            axes.map(|(force, projection)| {
                let mean = mean(force);
                let whole: f64 = force.iter().map(|f| (f - mean) * (f - mean)).sum();
                let followed = projection.follow(&projection.factors(force));
                let left = force.iter().zip(&followed);
                let left: f64 = left.map(|(f, g)| (f - g) * (f - g)).sum();
                (whole > 0.0).then(|| (1.0 - left / whole).clamp(0.0, 1.0))
            })
            .collect()
        };
        Ok(terms.iter().map(part).collect())
    }

    /// Columns of the terms' linear parameters and tangents of their shapes, of both axes, with the
    /// bounds of their factors.
    fn columns(&self, terms: &[AxisEffect], fit: &Solution) -> Vec<(Vec<f64>, [f64; 2])> {
        let mut columns = Vec::new();
        for (bound, values) in terms.iter().zip(&fit.solved.values) {
            columns.extend(self.records.columns(bound, values));
        }
        columns.extend(self.records.accelerations.iter().flatten().cloned());
        with_bounds(
            columns,
            fit.problem(&self.records, terms).slopes(&fit.solved),
        )
    }

    /// Σ error² on the held-out stretches of each fold of an axis, for every λ.
    fn held_out(
        &self,
        axis: usize,
        columns: &[(Vec<f64>, [f64; 2])],
        lambdas: &[f64],
    ) -> Vec<Vec<f64>> {
        let rows = self.records.rows_per_axis();
        let part = axis * rows..(axis + 1) * rows;
        let own = columns
            .iter()
            .map(|(c, bounds)| (&c[part.clone()], *bounds));
        let own: Vec<(&[f64], [f64; 2])> = own.collect();
        let force = &self.records.measured[part];
        held_out(&self.folds, &self.functions, axis, &own, force, lambdas)
    }

    /// Errors per axis on stretches that were held out in turn, for effects with these values.
    pub(crate) fn held_out_errors(
        &self,
        terms: &[(AxisEffect, Vec<f64>)],
        ridge: &[f64],
    ) -> Vec<AxisError> {
        let squares = self.held_out_squares(terms, ridge);
        let axes = self.axes.iter().zip(self.measured()).zip(squares);
        let error = |((axis, force), squares): ((&Axis, &[f64]), Vec<f64>)| {
            let error: f64 = squares.iter().sum();
            let mean = mean(force);
            let about_mean: f64 = force.iter().map(|f| (f - mean) * (f - mean)).sum();
            let square: f64 = force.iter().map(|f| f * f).sum();
            AxisError {
                axis: axis.name.clone(),
                nmse_percent: 100.0 * error / about_mean.max(f64::MIN_POSITIVE),
                relative_error: (error / square.max(f64::MIN_POSITIVE)).sqrt(),
            }
        };
        axes.map(error).collect()
    }

    /// Σ error² per axis and fold on stretches that were held out in turn, for effects with these
    /// values.
    pub(crate) fn held_out_squares(
        &self,
        terms: &[(AxisEffect, Vec<f64>)],
        ridge: &[f64],
    ) -> Vec<Vec<f64>> {
        let bounds: Vec<AxisEffect> = terms.iter().map(|(bound, _)| *bound).collect();
        let mut columns: Vec<Vec<f64>> = self
            .records
            .accelerations
            .iter()
            .flatten()
            .cloned()
            .collect();
        let linear = |(bound, values): &(AxisEffect, Vec<f64>)| -> Vec<f64> {
            let parameters = bound.entry.parameters().iter().zip(values);
            let linear = parameters.filter(|(p, _)| p.is_linear());
            linear.map(|(_, value)| *value).collect()
        };
        let factors: Vec<Vec<f64>> = terms.iter().map(linear).collect();
        for ((bound, values), factors) in terms.iter().zip(&factors) {
            let own = self.records.columns(bound, values);
            // What was held at its bound stays there; a zero of every record has a column for each.
            let each = own.len() == factors.len();
            let held = |place: usize| each && factors[place] == 0.0;
            let own = own.into_iter().enumerate();
            columns.extend(
                own.filter(|(place, _)| !held(*place))
                    .map(|(_, column)| column),
            );
        }
        let at = terms.iter().zip(&factors);
        let at = at.map(|((bound, values), factors)| At {
            bound,
            values,
            factors,
        });
        let unknowns = unknowns::shapes(&bounds, &self.records.references);
        let unknowns: Vec<&ShapeUnknown> = unknowns.iter().collect();
        let slopes = self.records.slopes(&at.collect::<Vec<_>>(), &unknowns);
        let columns = with_bounds(columns, slopes);
        let axes = ridge.chunks_exact(1).enumerate();
        axes.map(|(axis, ridge)| self.held_out(axis, &columns, ridge).remove(0))
            .collect()
    }

    /// Per axis the strength at which held-out stretches are followed best, about the one before.
    fn choose(&self, columns: &[(Vec<f64>, [f64; 2])], before: &[f64]) -> Vec<f64> {
        if !self.functions.held_back {
            return before.to_vec();
        }
        let best = |(axis, &before): (usize, &f64)| {
            let near = |l: &f64| before <= 0.0 || (l / before).log10().abs() < REACH;
            let lambdas: Vec<f64> = ridge::candidates().filter(near).collect();
            let folds = self.held_out(axis, columns, &lambdas);
            let errors = folds.iter().map(|fold| fold.iter().sum::<f64>());
            let pairs = errors.zip(&lambdas);
            let best = pairs.min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(a.1)));
            best.map_or(before, |(_, lambda)| *lambda)
        };
        before.iter().enumerate().map(best).collect()
    }

    /// Fits terms and base together, from one more start than a scan of the terms' own values
    /// finds. `axes` are the study's, `ridge` the strengths to begin with.
    ///
    /// # Errors
    /// As a fit of effects; an effect that the base can do itself.
    pub(crate) fn fit(
        &self,
        axes: &[Axis],
        terms: &[AxisEffect],
        ridge: &[f64],
        another: AnotherStart<'_>,
    ) -> Result<WithBase> {
        check_inertias(axes, terms)?;
        let mut ridge = ridge.to_vec();
        let mut from = None;
        for round in 1.. {
            let projections = self.projections(&ridge)?;
            let rows = self.records.rows_per_axis().max(1);
            let take_out = |column: &mut [f64]| {
                let parts = column.chunks_exact_mut(rows).zip(&projections);
                parts.for_each(|(part, projection)| projection.take_out(part));
            };
            let mut records = Records::new(&self.axes, self.motions, self.low_pass);
            records.beside_constant = self.records.beside_constant;
            let records = records.orthogonal_to(&take_out);
            let fit = match from.take() {
                None => solve_also_from(&records, &self.axes, terms, another)?,
                known => solve(&records, &self.axes, terms, known)?,
            };
            let problem = fit.problem(&records, terms);
            self.check_news(axes, terms, &fit)?;
            if round < ROUNDS {
                let columns = self.columns(terms, &fit);
                let chosen = self.choose(&columns, &ridge);
                if chosen != ridge {
                    from = Some(problem.shapes_of(&fit.solved));
                    ridge = chosen;
                    continue;
                }
            }
            let mut effects = assemble(&self.axes, &problem, fit.solved.clone(), fit.stopped)?;
            let low_pass = self.low_pass;
            let inputs = super::polynomial::input_ranges(self.motions, self.state_input);
            let known = (inputs.as_slice(), self.state_input);
            effects.inertia = inertias(axes, self.motions, known, low_pass)?;
            return Ok(WithBase {
                base: self.base_of_remainder(terms, &fit, &projections),
                effective_parameters: projections.iter().map(|a| a.effective).collect(),
                effects,
                ridge,
            });
        }
        Err(Error::failed("the fit beside the base never began"))
    }

    /// Refuses effects that the base can do itself.
    fn check_news(&self, axes: &[Axis], terms: &[AxisEffect], fit: &Solution) -> Result<()> {
        let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
        let power = |column: &[f64]| column.iter().map(|v| v * v).sum::<f64>();
        let mut left = fit.solved.columns.iter();
        for (bound, values) in terms.iter().zip(&fit.solved.values) {
            for whole in self.records.columns(bound, values) {
                let left = left.next().map_or(0.0, |column| power(column));
                if left < MIN_NEW * power(&whole) {
                    return Err(Error::data(format!(
                        "the model's base does all that {} can do, so the two could not be told apart: leave it out, or add it to a \
                         physical model",
                        bound.name(&names)
                    )));
                }
            }
        }
        Ok(())
    }

    /// The base that follows what the effects leave.
    fn base_of_remainder(
        &self,
        terms: &[AxisEffect],
        fit: &Solution,
        projections: &[NuisanceProjection],
    ) -> Base {
        let mut left = self.records.measured.clone();
        // Not by their forces: what is another in every record has none beyond it.
        let mut factors = fit.solved.factors.iter();
        for (bound, values) in terms.iter().zip(&fit.solved.values) {
            for (column, factor) in self.records.columns(bound, values).iter().zip(&mut factors) {
                left.iter_mut()
                    .zip(column)
                    .for_each(|(l, c)| *l -= factor * c);
            }
        }
        let axes = left.chunks_exact(self.records.rows_per_axis().max(1));
        let factors: Vec<Vec<f64>> = axes
            .zip(projections)
            .map(|(left, projection)| projection.factors(left))
            .collect();
        self.functions.base(&factors)
    }
}
