//! Least squares for what the force is proportional to, given the shapes of the laws; and the
//! search for the shapes.
//!
//! Variable projection: for any values of the shapes the linear parameters follow exactly from the
//! normal equations, so only the shapes are searched for, by Levenberg–Marquardt on their
//! logarithms. The derivative of the remaining residual is that of the force at fixed linear
//! parameters, projected off the columns (Kaufman, BIT 15 (1975) 49–57).

use super::columns::Records;
use super::slopes::At;
use super::unknowns::{self, ShapeUnknown};
use crate::fit::least_squares::bounded;
use crate::fit::least_squares::levenberg_marquardt::{self, SumOfSquares};
use crate::fit::least_squares::normal_equations;
use crate::model::effects::AxisEffect;
use crate::text::error::Result;
use crate::text::work;
use faer::{Mat, Par};

pub use crate::fit::least_squares::levenberg_marquardt::Stopped;

/// The terms at one choice of shapes, with the linear parameters that fit best.
#[derive(Clone)]
pub(crate) struct Solved {
    /// Every term's parameters, SI.
    pub(crate) values: Vec<Vec<f64>>,
    /// Inertia per axis, where it is not stated.
    pub(crate) inertia: Vec<Option<f64>>,
    /// The columns of every linear unknown, terms first, then inertias; not weighted.
    pub(crate) columns: Vec<Vec<f64>>,
    /// Measured minus fitted, not weighted.
    pub(crate) residual: Vec<f64>,
    /// The factor of every column.
    pub(crate) factors: Vec<f64>,
    /// Whether a factor would be outside what is physical, and is held at the bound.
    pub(crate) held: Vec<bool>,
    /// Σ (residual·weight)² over the rows of all axes.
    pub(crate) cost: f64,
    /// Linear unknowns that the records determine.
    pub(crate) rank: usize,
}

/// Steps after which a search gives up.
const MAX_STEPS: usize = 40;
/// A step of the logarithms below this is no change.
const SMALL_STEP: f64 = 1e-7;
/// Gauss–Newton steps after a search.
const MAX_SETTLING: usize = 12;
/// A step is shrinking that is smaller than the one before by this factor.
const SHRINKING: f64 = 0.7;
/// The most that they may change a shape, as a part of it.
const MAX_MOVED: f64 = 0.02;

/// A sum of terms to be fitted to records.
pub(crate) struct Problem<'a> {
    pub(crate) records: &'a Records<'a>,
    pub(crate) terms: &'a [AxisEffect],
    pub(crate) shapes: &'a [ShapeUnknown],
    /// One over the standard deviation of each axis's residual: what makes newtons and
    /// newton-metres comparable.
    pub(crate) weights: Vec<f64>,
}

impl Problem<'_> {
    /// Every term's parameters with the shapes put in and the linear ones 0.
    fn values(&self, shapes: &[f64]) -> Vec<Vec<f64>> {
        let mut values: Vec<Vec<f64>> = self
            .terms
            .iter()
            .map(|t| vec![0.0; t.entry.parameters().len()])
            .collect();
        for (unknown, &shape) in self.shapes.iter().zip(shapes) {
            for &(term, index) in &unknown.places {
                values[term][index] = shape;
            }
        }
        values
    }

    /// A matrix of weighted columns.
    pub(crate) fn weighted(&self, columns: &[&[f64]]) -> Mat<f64> {
        let rows = self.records.rows_per_axis();
        let mut matrix = Mat::zeros(self.weights.len() * rows, columns.len());
        for (c, column) in columns.iter().enumerate() {
            for (axis, weight) in self.weights.iter().enumerate() {
                let part = axis * rows..(axis + 1) * rows;
                let target = matrix.col_mut(c).subrows_mut(axis * rows, rows);
                for (place, value) in target.iter_mut().zip(&column[part]) {
                    *place = weight * value;
                }
            }
        }
        matrix
    }

    /// The columns of every term at these values; those of terms whose shapes are those of `before`
    /// are taken from it.
    fn columns(&self, values: &[Vec<f64>], before: Option<&Solved>) -> Vec<Vec<f64>> {
        let is_kept = |term: usize, before: &Solved| {
            let parameters = self.terms[term].entry.parameters().iter();
            let mut pairs = parameters.zip(values[term].iter().zip(&before.values[term]));
            pairs.all(|(p, (new, old))| p.is_linear() || new == old)
        };
        let kept = |term: usize| before.filter(|before| is_kept(term, before));
        let terms = self.terms.iter().zip(values).enumerate();
        let moved = terms.filter(|(term, _)| kept(*term).is_none());
        let moved: Vec<(&AxisEffect, &[f64])> = moved
            .map(|(_, (bound, values))| (bound, values.as_slice()))
            .collect();
        let mut moved = self.records.columns_of_all(&moved).into_iter();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for (term, bound) in self.terms.iter().enumerate() {
            let start = columns.len();
            match kept(term) {
                Some(before) => {
                    let own = start..start + self.records.count(bound);
                    columns.extend_from_slice(&before.columns[own]);
                }
                None => columns.extend(moved.next().unwrap_or_default()),
            }
        }
        columns
    }

    /// The best linear parameters for these shapes; `before` has columns that may serve again.
    pub(crate) fn solve(&self, shapes: &[f64], before: Option<&Solved>) -> Result<Solved> {
        work::step();
        let mut values = self.values(shapes);
        let mut columns = self.columns(&values, before);
        columns.extend(self.records.accelerations.iter().flatten().cloned());

        let all: Vec<&[f64]> = columns
            .iter()
            .chain([&self.records.measured])
            .map(Vec::as_slice)
            .collect();
        let design = self.weighted(&all);
        let products = product(&design, &design);
        let unknowns = columns.len();
        let gram = products.submatrix(0, 0, unknowns, unknowns).to_owned();
        let cross = products.submatrix(0, unknowns, unknowns, 1).to_owned();
        let solution = normal_equations::solve(&gram, &cross)?;
        let mut factors: Vec<f64> = (0..unknowns)
            .map(|c| solution.coefficients[(c, 0)])
            .collect();
        let bounds = self.bounds();
        let outside = |factors: &[f64]| {
            let mut pairs = factors.iter().zip(&bounds);
            pairs.any(|(f, [least, most])| f < least || f > most)
        };
        if outside(&factors) {
            factors = bounded::factors(&products, &bounds);
        }
        let held = factors.iter().zip(&bounds);
        let held = held.map(|(f, [least, most])| f <= least || f >= most);
        let held = held.collect();

        let mut residual = self.records.measured.clone();
        for (c, column) in columns.iter().enumerate() {
            let factor = factors[c];
            for (r, value) in residual.iter_mut().zip(column) {
                *r -= factor * value;
            }
        }
        let mut rest = factors.as_slice();
        for (bound, values) in self.terms.iter().zip(&mut values) {
            let (mine, others) = rest.split_at(self.records.count(bound));
            self.records.put(bound, mine, values);
            rest = others;
        }
        let mut found = rest.iter().copied();
        let inertia = self.records.accelerations.iter();
        let inertia = inertia
            .map(|column| column.as_ref().and_then(|_| found.next()))
            .collect();
        Ok(Solved {
            cost: cost(self.records, &residual, &self.weights),
            values,
            inertia,
            columns,
            residual,
            rank: solution.rank,
            factors,
            held,
        })
    }

    /// The least and the most of the factor of every column: what is physical, as a strength or an
    /// inertia, is not less than nothing.
    fn bounds(&self) -> Vec<[f64; 2]> {
        let inertias = self.records.accelerations.iter().flatten();
        let terms = self.terms.iter();
        let terms = terms.flat_map(|term| unknowns::column_bounds(term, self.records));
        terms
            .chain(inertias.map(|_| [0.0, f64::INFINITY]))
            .collect()
    }

    /// How the fitted force changes with the logarithm of each shape, at fixed linear parameters.
    pub(crate) fn slopes(&self, solved: &Solved) -> Vec<Vec<f64>> {
        let mut rest = solved.factors.as_slice();
        let terms = self
            .terms
            .iter()
            .zip(&solved.values)
            .map(|(bound, values)| {
                let (factors, others) = rest.split_at(self.records.count(bound));
                rest = others;
                At {
                    bound,
                    values,
                    factors,
                }
            });
        let terms: Vec<At<'_>> = terms.collect();
        self.records
            .slopes(&terms, &self.shapes.iter().collect::<Vec<_>>())
    }

    /// The current value of every shape.
    pub(crate) fn shapes_of(&self, solved: &Solved) -> Vec<f64> {
        let owners = self.shapes.iter().map(|unknown| unknown.places[0]);
        owners
            .map(|(term, index)| solved.values[term][index])
            .collect()
    }

    /// Brings the shapes to where their slopes no longer see the residual, whether or not the cost
    /// falls on the way.
    ///
    /// A law that switches at a shape (`reaches`) makes the cost a staircase on top of the valley
    /// that the derivative sees. The stairs are the rows nearest to the switch, and which of
    /// them lie beyond it is a matter of the displacement's last count: a descent that stops at
    /// such a stair puts the shape where the counts fall.
    pub(crate) fn settle(&self, found: Solved) -> Result<Solved> {
        let before = self.shapes_of(&found);
        let mut settled = found.clone();
        let (mut last, mut part) = (f64::INFINITY, 1.0);
        for _ in 0..MAX_SETTLING {
            let step = self.newton(&settled)?;
            let moved = step.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
            if moved < SMALL_STEP {
                break;
            }
            // Steps that no longer shrink go to and fro across one stair: the middle is as good as
            // either side, and so is where the next of them leads.
            match (moved < SHRINKING * last, part < 1.0) {
                (true, _) => part = 1.0,
                (false, false) => part = 0.5,
                (false, true) => break,
            }
            last = moved;
            let shapes = self.shapes_of(&settled);
            let tried: Vec<f64> = self
                .shapes
                .iter()
                .zip(shapes.iter().zip(&step))
                .map(|(unknown, (value, step))| unknown.clamp(value * (part * step).exp()))
                .collect();
            settled = self.solve(&tried, Some(&settled))?;
        }
        // This is for the last counts only: what leads out of the valley is not followed. The cost
        // is no judge here, since records with little noise pay for a single row on the
        // wrong side of a switch with several times their noise.
        let shapes = self.shapes_of(&settled);
        let near = shapes.iter().zip(&before);
        let near = near.fold(0.0, |most: f64, (a, b)| most.max((a / b).ln().abs())) < MAX_MOVED;
        Ok(if near { settled } else { found })
    }

    /// The Gauss–Newton step of the logarithms of the shapes.
    fn newton(&self, solved: &Solved) -> Result<Vec<f64>> {
        let (reduced, shapes) = self.reduced(solved)?;
        let matrix = reduced.subcols(0, shapes).to_owned();
        let right = reduced.subcols(shapes, 1).to_owned();
        let step = normal_equations::solve(&matrix, &right)?.coefficients;
        Ok((0..shapes).map(|i| step[(i, 0)]).collect())
    }

    /// The weighted columns of a solution, then the slopes of its shapes, then its residual.
    pub(crate) fn design(&self, solved: &Solved) -> Mat<f64> {
        let slopes = self.slopes(solved);
        // What is held takes no part in a step.
        let nothing = vec![0.0; solved.residual.len()];
        let columns = solved.columns.iter().zip(&solved.held);
        let columns = columns.map(|(column, held)| if *held { &nothing } else { column });
        let all: Vec<&[f64]> = columns
            .chain(&slopes)
            .chain([&solved.residual])
            .map(Vec::as_slice)
            .collect();
        self.weighted(&all)
    }

    /// JᵀJ and Jᵀe of the slopes with the columns projected out, beside each other, and the number
    /// of slopes.
    fn reduced(&self, solved: &Solved) -> Result<(Mat<f64>, usize)> {
        let design = self.design(solved);
        let products = product(&design, &design);
        let (linear, shapes) = (solved.columns.len(), self.shapes.len());
        let block = |r: usize, c: usize, rows: usize, cols: usize| {
            products.submatrix(r, c, rows, cols).to_owned()
        };
        let between = block(0, linear, linear, shapes + 1);
        let weights = normal_equations::solve(&block(0, 0, linear, linear), &between)?;
        let mut reduced = block(linear, linear, shapes, shapes + 1)
            - between.subcols(0, shapes).transpose() * &weights.coefficients;
        let values = self.shapes_of(solved);
        levenberg_marquardt::hold(&mut reduced, |shape, direction| {
            self.shapes[shape].is_held(values[shape], direction)
        });
        Ok((reduced, shapes))
    }

    /// Levenberg–Marquardt from the given shapes until a step gains less than `small_gain` of the
    /// cost.
    pub(crate) fn search(&self, start: &[f64], small_gain: f64) -> Result<(Solved, Stopped)> {
        let first = self.solve(start, None)?;
        if self.shapes.is_empty() {
            return Ok((first, Stopped::Direct));
        }
        levenberg_marquardt::descend(self, first, MAX_STEPS, small_gain)
    }
}

impl SumOfSquares for Problem<'_> {
    type Point = Solved;
    type Linearised = Mat<f64>;

    fn cost(&self, solved: &Solved) -> f64 {
        solved.cost
    }

    fn linearised(&self, solved: &Solved) -> Result<Mat<f64>> {
        Ok(self.reduced(solved)?.0)
    }

    fn normal<'a>(&self, reduced: &'a Mat<f64>) -> &'a Mat<f64> {
        reduced
    }

    fn stepped(
        &self,
        solved: &Solved,
        _reduced: &Mat<f64>,
        step: &[f64],
    ) -> Result<Option<Solved>> {
        let before = self.shapes_of(solved);
        let pairs = self.shapes.iter().zip(before.iter().zip(step));
        let tried: Vec<f64> = pairs
            .map(|(unknown, (value, step))| unknown.clamp(value * step.clamp(-1.0, 1.0).exp()))
            .collect();
        let pairs = tried.iter().zip(&before);
        let moved = pairs.map(|(new, old)| (new / old).ln().abs());
        if moved.fold(0.0, f64::max) < SMALL_STEP {
            return Ok(None);
        }
        self.solve(&tried, Some(solved)).map(Some)
    }
}

/// Σ (residual·weight)², with one weight per axis.
pub(crate) fn cost(records: &Records<'_>, residual: &[f64], weights: &[f64]) -> f64 {
    let axes = residual.chunks_exact(records.rows_per_axis().max(1));
    axes.zip(weights)
        .map(|(part, weight)| weight * weight * part.iter().map(|r| r * r).sum::<f64>())
        .sum()
}

/// Entries of a product from which on threads share it. They share its columns: of a narrow one
/// each has next to nothing to do, and they wait for each other, spinning.
const SHARED: usize = 1 << 12;

/// AᵀB.
pub(crate) fn product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let par = match a.ncols() * b.ncols() < SHARED {
        true => Par::Seq,
        false => Par::rayon(0),
    };
    let mut out = Mat::zeros(a.ncols(), b.ncols());
    faer::linalg::matmul::matmul(
        out.as_mut(),
        faer::Accum::Replace,
        a.transpose(),
        b.as_ref(),
        1.0,
        par,
    );
    out
}
