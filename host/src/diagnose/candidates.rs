//! Which effect of the library explains what a physical model leaves over.
//!
//! Every effect that the model does not have is projected on the complement of the model (its columns and, for the
//! shapes of its laws, their tangents), because what the model's own values could take up is not missing. The effect's own
//! shapes are scanned over their starting values, the promising ones refined, and the best few held against blocks of
//! the records that they were not fitted to.

use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::product;
use crate::fit::effects::unknowns::{ShapeUnknown, is_physical, shapes};
use crate::fit::normal_equations::{self, Cholesky};
use crate::model::effects::Bound;
use faer::Mat;
use jointwatch_shared::effect::{Acts, EFFECTS};
use rayon::prelude::*;
use std::sync::Arc;

/// Starting values of one effect's shapes that are tried at most; more are thinned out.
const MAX_STARTS: usize = 40;
/// Effects that are refined and cross-validated.
pub(crate) const REFINED: usize = 8;
/// Steps of a refinement.
const REFINING_STEPS: usize = 8;
/// A refinement ends with a step that gains less than this part: what is chosen is fitted anew with the whole model.
const LITTLE: f64 = 3e-4;
/// Effects with a larger tag are added by name and never proposed: this search has no price for flexibility, and would name them for the
/// simpler laws that they contain.
pub(crate) const LAST_PROPOSED: u8 = 24;
/// A column of which less than this part is left beside the model's own is no news.
const MIN_NEW: f64 = 1e-7;

/// An effect on an axis, with the shapes at which it explains most.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) bound: Bound,
    /// All parameters, SI: shapes as found, linear ones as least squares gives them beside the model.
    pub(crate) values: Vec<f64>,
    /// What its law makes of the records, one column per linear parameter, and the factor of each.
    columns: Arc<Vec<Vec<f64>>>,
    factors: Vec<f64>,
    /// Σ (weighted residual)² that it takes away.
    pub(crate) gain: f64,
    /// What it adds to the force once the model's share in it is taken out, weighted: residual before minus after.
    pub(crate) explained: Vec<f64>,
}

/// A solved model, ready for candidates to be projected beside.
pub(crate) struct Beside<'a> {
    records: &'a Records<'a>,
    terms: &'a [Bound],
    solution: &'a Solution,
    /// Weighted columns and tangents of the model, each of length 1.
    pub(crate) own: Mat<f64>,
    /// Weighted residual.
    pub(crate) residual: Mat<f64>,
    factor: Cholesky,
}

/// What least squares says about some columns beside the model.
struct Projected {
    /// One factor per column.
    factors: Vec<f64>,
    gain: f64,
}

impl<'a> Beside<'a> {
    /// `within` are columns beside the model's own of which as much as is there may be: what instruments do wrong within
    /// their tolerances. Nothing when the columns depend on each other so that they cannot be projected out.
    pub(crate) fn new(
        records: &'a Records<'a>,
        terms: &'a [Bound],
        solution: &'a Solution,
        within: Vec<Vec<f64>>,
    ) -> Option<Self> {
        let problem = solution.problem(records, terms);
        let slopes = problem.slopes(&solution.solved);
        let all: Vec<&[f64]> = solution
            .solved
            .columns
            .iter()
            .chain(&slopes)
            .chain(&within)
            .map(Vec::as_slice)
            .filter(|column| column.iter().any(|v| *v != 0.0))
            .collect();
        let mut own = problem.weighted(&all);
        for c in 0..own.ncols() {
            let length = own.col(c).norm_l2();
            own.col_mut(c).iter_mut().for_each(|v| *v /= length);
        }
        let mut gram = product(&own, &own);
        for c in 0..gram.ncols() {
            // Columns that nearly repeat each other are kept apart by a trace of a ridge.
            gram[(c, c)] += 1e-10;
        }
        Some(Self {
            records,
            terms,
            solution,
            residual: problem.weighted(&[&solution.solved.residual]),
            own,
            factor: Cholesky::new(gram)?,
        })
    }

    fn is_physical(&self, candidate: &Candidate) -> bool {
        is_physical(&candidate.bound, &candidate.values, self.records)
    }

    /// Every effect that could be added to the model, one entry per effect and axis, the most promising first; the first
    /// [`REFINED`] of them are refined.
    pub(crate) fn search(&self, axes: usize) -> Vec<Candidate> {
        let mut bounds = Vec::new();
        for entry in EFFECTS.iter().filter(|e| e.tag <= LAST_PROPOSED) {
            let places = match entry.acts {
                Acts::OwnAxis => 0..axes,
                Acts::BothAxes => 0..axes.min(2) / 2,
            };
            bounds.extend(places.map(|axis| Bound { entry, axis }));
        }
        bounds.retain(|bound| {
            let rival = self.terms.iter().any(|term| bound.rules_out(term));
            !rival && !self.terms.contains(bound) && self.can_act(bound)
        });
        let mut found: Vec<Candidate> = bounds
            .par_iter()
            .filter_map(|bound| self.scan(bound))
            .collect();
        found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        found.truncate(REFINED);
        self.refined(found, REFINING_STEPS)
    }

    /// One effect with the values at which it explains most.
    pub(super) fn found(&self, bound: &Bound) -> Option<Candidate> {
        Some(self.refine(&self.scan(bound)?, REFINING_STEPS))
    }

    /// Candidates that were found on other rows of the same records, refined on these, the most promising first.
    pub(crate) fn refined(&self, candidates: Vec<Candidate>, steps: usize) -> Vec<Candidate> {
        let again = candidates.into_par_iter().filter_map(|candidate| {
            let start = if candidate.bound.entry.is_per_record() {
                // Longer records resolve the frequency of a line further.
                self.scan(&candidate.bound)?
            } else {
                self.tried(&candidate.bound, candidate.values)?
            };
            let mut refined = self.refine(&start, steps);
            refined.explained = self.explained(&refined);
            Some(refined)
        });
        let mut all: Vec<Candidate> = again.collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        all
    }

    /// Where inertia is not stated, a wrong one and a wrong force scale are already part of the fit; where there is none, there is
    /// no inertia to be wrong.
    fn can_act(&self, bound: &Bound) -> bool {
        let of_inertia = matches!(bound.entry.about.name, "inertia_error" | "force_gain");
        !of_inertia || self.records.inertias[bound.axis].is_some_and(|inertia| inertia > 0.0)
    }

    /// The shapes of a candidate; those that are tied to a shape of the model are not its own to choose.
    fn unknowns(&self, bound: &Bound) -> Vec<ShapeUnknown> {
        let mut unknowns = shapes(std::slice::from_ref(bound), &self.records.references);
        unknowns.retain(|unknown| {
            let (_, index) = unknown.places[0];
            self.tied(bound, index).is_none()
        });
        unknowns
    }

    /// The value of the model's shape that a parameter of a candidate is tied to.
    fn tied(&self, bound: &Bound, index: usize) -> Option<f64> {
        let mut with = self.terms.to_vec();
        with.push(*bound);
        let all = shapes(&with, &self.records.references);
        let owner = all
            .iter()
            .find(|unknown| unknown.places.contains(&(self.terms.len(), index)))?
            .places[0];
        (owner.0 < self.terms.len()).then(|| self.solution.solved.values[owner.0][owner.1])
    }

    /// A candidate's parameters with given values of its own shapes, linear ones 0.
    fn values(&self, bound: &Bound, unknowns: &[ShapeUnknown], chosen: &[f64]) -> Vec<f64> {
        let listed = bound.entry.parameters().iter().enumerate();
        listed
            .map(|(index, parameter)| {
                if parameter.is_linear() {
                    return 0.0;
                }
                let own = unknowns.iter().position(|u| u.places[0].1 == index);
                own.map(|own| chosen[own])
                    .or_else(|| self.tied(bound, index))
                    .unwrap_or(1.0)
            })
            .collect()
    }

    /// The best of an effect's starting values.
    fn scan(&self, bound: &Bound) -> Option<Candidate> {
        let unknowns = self.unknowns(bound);
        let all = if bound.entry.is_per_record() {
            let rows = self.records.rows_per_axis();
            let axis = self.residual.col(0).subrows(bound.axis * rows, rows);
            let mut residual = vec![0.0; bound.axis * rows];
            residual.extend(axis.iter());
            let line = |u: &ShapeUnknown| self.records.line_in(&residual, bound.axis, &u.shape);
            vec![unknowns.iter().map(line).collect()]
        } else {
            combinations(&unknowns)
        };
        let thin = all.len().div_ceil(MAX_STARTS);
        let tried = all.par_iter().step_by(thin).filter_map(|chosen| {
            let values = self.values(bound, &unknowns, chosen);
            self.tried(bound, values)
        });
        let tried = tried.filter(|candidate| self.is_physical(candidate));
        tried.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// An effect with given shapes, its linear parameters as least squares has them.
    fn tried(&self, bound: &Bound, mut values: Vec<f64>) -> Option<Candidate> {
        let columns = self.records.columns(bound, &values);
        let projected = self.project(&columns)?;
        self.records.put(bound, &projected.factors, &mut values);
        Some(Candidate {
            bound: *bound,
            values,
            columns: columns.into(),
            factors: projected.factors,
            gain: projected.gain,
            explained: Vec::new(),
        })
    }

    /// What is left of the residual, weighted, when everything has been taken out that the model can take up.
    pub(super) fn left(&self) -> Mat<f64> {
        let mut factors = product(&self.own, &self.residual);
        self.factor.solve(factors.as_mut());
        &self.residual - &self.own * &factors
    }

    /// Factors of columns, and what they gain.
    pub(super) fn factors(&self, columns: &[Vec<f64>]) -> Option<Vec<f64>> {
        self.project(columns).map(|projected| projected.factors)
    }

    /// Least squares of the residual on columns of which the model's own share has been taken out.
    fn project(&self, columns: &[Vec<f64>]) -> Option<Projected> {
        let problem = self.solution.problem(self.records, self.terms);
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let new = problem.weighted(&slices);
        let lengths: Vec<f64> = (0..new.ncols()).map(|c| new.col(c).norm_l2()).collect();
        let (gram, right) = self.orthogonal_to(&new);
        // Only columns that bring something of their own count.
        let kept: Vec<usize> = (0..new.ncols())
            .filter(|&c| lengths[c] > 0.0 && gram[(c, c)] > MIN_NEW * lengths[c] * lengths[c])
            .collect();
        if kept.is_empty() {
            return None;
        }
        let a = Mat::from_fn(kept.len(), kept.len(), |i, j| gram[(kept[i], kept[j])]);
        let b = Mat::from_fn(kept.len(), 1, |i, _| right[(kept[i], 0)]);
        let solved = normal_equations::solve(&a, &b).ok()?.coefficients;
        let gain = (0..kept.len()).map(|i| solved[(i, 0)] * b[(i, 0)]).sum();
        let mut factors = vec![0.0; columns.len()];
        for (i, &c) in kept.iter().enumerate() {
            factors[c] = solved[(i, 0)];
        }
        Some(Projected { factors, gain })
    }

    /// CᵀC and Cᵀe of columns C with the model's share taken out.
    fn orthogonal_to(&self, new: &Mat<f64>) -> (Mat<f64>, Mat<f64>) {
        let between = product(&self.own, new);
        let with_residual = product(&self.own, &self.residual);
        let mut solved = between.clone();
        self.factor.solve(solved.as_mut());
        (
            product(new, new) - between.transpose() * &solved,
            product(new, &self.residual) - solved.transpose() * with_residual,
        )
    }

    /// Gauss–Newton on the logarithms of a candidate's own shapes, the model's share taken out throughout.
    fn refine(&self, start: &Candidate, steps: usize) -> Candidate {
        let unknowns = self.unknowns(&start.bound);
        let mut best = start.clone();
        let mut damping = 1e-2;
        for _ in 0..steps {
            if unknowns.is_empty() {
                break;
            }
            let Some(step) = self.step(&best, &unknowns, damping) else {
                break;
            };
            let chosen: Vec<f64> = unknowns
                .iter()
                .zip(&step)
                .map(|(u, step)| {
                    let value = best.values[u.places[0].1];
                    u.clamp(value * step.clamp(-0.7, 0.7).exp())
                })
                .collect();
            let values = self.values(&best.bound, &unknowns, &chosen);
            match self.tried(&best.bound, values) {
                Some(tried) if tried.gain > best.gain && self.is_physical(&tried) => {
                    let little = tried.gain - best.gain < LITTLE * best.gain;
                    best = tried;
                    damping = f64::max(damping / 5.0, 1e-6);
                    if little {
                        break;
                    }
                }
                _ => damping *= 8.0,
            }
        }
        best
    }

    /// The step of the logarithms of a candidate's shapes.
    fn step(&self, at: &Candidate, unknowns: &[ShapeUnknown], damping: f64) -> Option<Vec<f64>> {
        let linear = at.columns.len();
        let new = self.with_slopes(at, unknowns);
        let (mut gram, right) = self.orthogonal_to(&new);
        for c in 0..gram.ncols() {
            let curvature = gram[(c, c)];
            gram[(c, c)] +=
                if c < linear { 1e-10 } else { damping } * curvature + f64::MIN_POSITIVE;
        }
        let solved = normal_equations::solve(&gram, &right).ok()?.coefficients;
        Some((linear..new.ncols()).map(|c| solved[(c, 0)]).collect())
    }

    /// Residual before minus after, weighted.
    fn explained(&self, candidate: &Candidate) -> Vec<f64> {
        let problem = self.solution.problem(self.records, self.terms);
        let mut force = vec![0.0; self.records.measured.len()];
        for (column, factor) in candidate.columns.iter().zip(&candidate.factors) {
            force
                .iter_mut()
                .zip(column)
                .for_each(|(f, c)| *f += factor * c);
        }
        let column = problem.weighted(&[&force]);
        let mut share = product(&self.own, &column);
        self.factor.solve(share.as_mut());
        let rest = &column - &self.own * &share;
        rest.col(0).iter().copied().collect()
    }

    /// A candidate's columns and the tangents of its shapes, weighted.
    fn with_slopes(&self, at: &Candidate, unknowns: &[ShapeUnknown]) -> Mat<f64> {
        let slopes = unknowns.par_iter().map(|unknown| {
            let (_, index) = unknown.places[0];
            self.records
                .slope(&at.bound, &at.values, &at.factors, index)
        });
        let slopes: Vec<Vec<f64>> = slopes.collect();
        let all = at.columns.iter().chain(&slopes);
        let all: Vec<&[f64]> = all.map(Vec::as_slice).collect();
        let problem = self.solution.problem(self.records, self.terms);
        problem.weighted(&all)
    }

    /// The columns by which a model with a candidate is wider than without: its linear ones, and the tangents of its shapes.
    pub(crate) fn columns_of(&self, candidate: &Candidate) -> Mat<f64> {
        of_unit_length(self.with_slopes(candidate, &self.unknowns(&candidate.bound)))
    }

    /// Any columns, weighted, as [`Beside::columns_of`] gives those of a candidate.
    pub(super) fn unit_columns(&self, columns: &[Vec<f64>]) -> Mat<f64> {
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let problem = self.solution.problem(self.records, self.terms);
        of_unit_length(problem.weighted(&columns))
    }
}

/// The same columns, each of length 1 unless it is 0.
fn of_unit_length(mut columns: Mat<f64>) -> Mat<f64> {
    for c in 0..columns.ncols() {
        let length = columns.col(c).norm_l2();
        if length > 0.0 {
            columns.col_mut(c).iter_mut().for_each(|v| *v /= length);
        }
    }
    columns
}

/// Every combination of starting values, SI.
fn combinations(unknowns: &[ShapeUnknown]) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new()];
    for unknown in unknowns {
        all = all
            .into_iter()
            .flat_map(|so_far| {
                unknown.shape.starts.iter().map(move |start| {
                    let mut longer = so_far.clone();
                    longer.push(start * unknown.reference);
                    longer
                })
            })
            .collect();
    }
    all
}
