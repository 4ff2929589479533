//! Where the search for the shapes starts: a scan over every law's own starting values, axis by
//! axis.
//!
//! A strong stop would otherwise capture a clearance, and a search that starts in the wrong valley
//! stays there.

use super::columns::Records;
use super::projection::product;
use super::unknowns::ShapeUnknown;
use crate::model::effects::AxisEffect;
use faer::Mat;
use jointwatch_shared::effect::Acts;
use rayon::prelude::*;

/// Combinations that are scanned in full; with more, one term is scanned at a time.
const MAX_COMBINATIONS: usize = 3000;
/// Starts that are kept per axis.
const KEPT: usize = 3;
/// Rounds of scanning one term at a time.
const ROUNDS: usize = 3;

/// One way to set the shapes of a term, and its columns' places in the Gram matrix.
struct Choice {
    /// (unknown, value in SI).
    shapes: Vec<(usize, f64)>,
    columns: std::ops::Range<usize>,
}

/// The scan of one axis: every column once, in one Gram matrix.
struct Scan {
    /// Products of all columns, the measured force last.
    products: Mat<f64>,
    /// Columns that no shape changes.
    fixed: Vec<usize>,
    /// Per term with shapes, its choices.
    choices: Vec<Vec<Choice>>,
}

/// Sets of shapes to start from, the most promising first; each has one value per unknown.
pub(crate) fn starts(
    records: &Records<'_>,
    terms: &[AxisEffect],
    shapes: &[ShapeUnknown],
    axes: usize,
) -> Vec<Vec<f64>> {
    let default: Vec<f64> = shapes.iter().map(middle).collect();
    if shapes.is_empty() {
        return vec![default];
    }
    let found: Vec<Vec<Vec<(usize, f64)>>> = (0..axes)
        .map(|axis| Scan::new(records, terms, shapes, axis).best())
        .collect();
    // The best of both axes, then each axis's others beside the best of the other one.
    let most = found.iter().map(Vec::len).max().unwrap_or(1);
    let mut all: Vec<Vec<f64>> = Vec::new();
    for (axis, rank) in (0..most).flat_map(|rank| (0..axes).map(move |axis| (axis, rank))) {
        let mut start = default.clone();
        for (other, found) in found.iter().enumerate() {
            let rank = if other == axis { rank } else { 0 };
            let Some(chosen) = found.get(rank).or(found.first()) else {
                continue;
            };
            for &(unknown, value) in chosen {
                start[unknown] = value;
            }
        }
        if !all.contains(&start) {
            all.push(start);
        }
    }
    all
}

/// The starting value in the middle of a shape's.
pub(super) fn middle(unknown: &ShapeUnknown) -> f64 {
    let starts = unknown.shape.starts;
    unknown.reference * starts.get(starts.len() / 2).copied().unwrap_or(0.5)
}

impl Scan {
    fn new(
        records: &Records<'_>,
        terms: &[AxisEffect],
        shapes: &[ShapeUnknown],
        axis: usize,
    ) -> Self {
        let rows = records.rows_per_axis();
        let part = axis * rows..(axis + 1) * rows;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let (mut fixed, mut choices) = (Vec::new(), Vec::new());
        for (term, bound) in terms.iter().enumerate() {
            // A law on both axes shares its shapes with the terms that own them, and comes in with
            // the search.
            if bound.axis != axis || bound.entry.acts == Acts::BothAxes {
                continue;
            }
            let owned: Vec<(usize, usize)> = shapes
                .iter()
                .enumerate()
                .filter_map(|(u, unknown)| {
                    let place = unknown.places.iter().find(|place| place.0 == term);
                    place.map(|place| (u, place.1))
                })
                .collect();
            let all = combinations(shapes, &owned);
            let made = all.par_iter().map(|chosen| {
                let mut values = vec![0.0; bound.entry.parameters().len()];
                for (&(_, index), &(_, value)) in owned.iter().zip(chosen) {
                    values[index] = value;
                }
                let made = records.columns(bound, &values).into_iter();
                made.map(|column| column[part.clone()].to_vec()).collect()
            });
            let made: Vec<Vec<Vec<f64>>> = made.collect();
            let mut of_term = Vec::new();
            for (chosen, made) in all.into_iter().zip(made) {
                let start = columns.len();
                columns.extend(made);
                of_term.push(Choice {
                    shapes: chosen,
                    columns: start..columns.len(),
                });
            }
            if owned.is_empty() {
                fixed.extend(of_term.into_iter().flat_map(|choice| choice.columns));
            } else {
                choices.push(of_term);
            }
        }
        if let Some(Some(inertial)) = records.accelerations.get(axis) {
            fixed.push(columns.len());
            columns.push(inertial[part.clone()].to_vec());
        }
        columns.push(records.measured[part].to_vec());
        let design = Mat::from_fn(rows, columns.len(), |row, c| columns[c][row]);
        Self {
            products: product(&design, &design),
            fixed,
            choices,
        }
    }

    /// The most promising choices, best first, no two of them neighbours.
    fn best(&self) -> Vec<Vec<(usize, f64)>> {
        if self.choices.is_empty() {
            return vec![Vec::new()];
        }
        let count: usize = self.choices.iter().map(Vec::len).product();
        let mut scored: Vec<(f64, Vec<usize>)> = Vec::new();
        if count <= MAX_COMBINATIONS {
            for number in 0..count {
                let mut rest = number;
                let picked: Vec<usize> = self
                    .choices
                    .iter()
                    .map(|choices| {
                        let at = rest % choices.len();
                        rest /= choices.len();
                        at
                    })
                    .collect();
                scored.push((self.cost(&picked), picked));
            }
        } else {
            let mut picked: Vec<usize> = self.choices.iter().map(|c| c.len() / 2).collect();
            for _ in 0..ROUNDS {
                for term in 0..self.choices.len() {
                    let tried = (0..self.choices[term].len()).map(|at| {
                        let mut tried = picked.clone();
                        tried[term] = at;
                        (self.cost(&tried), tried)
                    });
                    let tried: Vec<_> = tried.collect();
                    if let Some(best) = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                        picked.clone_from(&best.1);
                    }
                    scored.extend(tried);
                }
            }
        }
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept: Vec<Vec<usize>> = Vec::new();
        for (_, picked) in scored {
            let near = |other: &Vec<usize>| {
                let mut pairs = other.iter().zip(&picked);
                pairs.all(|(a, b)| a.abs_diff(*b) <= 1)
            };
            if !kept.iter().any(near) {
                kept.push(picked);
            }
            if kept.len() == KEPT {
                break;
            }
        }
        let in_values = |picked: Vec<usize>| {
            let chosen = self.choices.iter().zip(picked);
            chosen
                .flat_map(|(choices, at)| choices[at].shapes.clone())
                .collect()
        };
        kept.into_iter().map(in_values).collect()
    }

    /// What least squares leaves of the measured force with these choices.
    fn cost(&self, picked: &[usize]) -> f64 {
        let mut columns = self.fixed.clone();
        for (choices, &at) in self.choices.iter().zip(picked) {
            columns.extend(choices[at].columns.clone());
        }
        let last = self.products.ncols() - 1;
        left_over(&self.products, &columns, last)
    }
}

/// Σ of the squares that least squares on some columns leaves of another one, from the products of
/// all of them.
///
/// One column after the other is projected out; one that the others already explain is passed over.
pub(crate) fn left_over(products: &Mat<f64>, columns: &[usize], target: usize) -> f64 {
    let n = columns.len();
    let at = |place: usize| if place < n { columns[place] } else { target };
    let mut work: Vec<Vec<f64>> = (0..=n)
        .map(|r| (0..=n).map(|c| products[(at(r), at(c))]).collect())
        .collect();
    for pivot in 0..n {
        let diagonal = work[pivot][pivot];
        if diagonal <= 1e-10 * products[(columns[pivot], columns[pivot])] {
            continue;
        }
        let row = work[pivot].clone();
        for below in &mut work[pivot + 1..] {
            let factor = below[pivot] / diagonal;
            for (value, above) in below[pivot + 1..].iter_mut().zip(&row[pivot + 1..]) {
                *value -= factor * above;
            }
        }
    }
    work[n][n].max(0.0)
}

/// Every combination of a term's starting values: (unknown, value in SI) for each of its unknowns.
fn combinations(shapes: &[ShapeUnknown], owned: &[(usize, usize)]) -> Vec<Vec<(usize, f64)>> {
    let mut all: Vec<Vec<(usize, f64)>> = vec![Vec::new()];
    for &(unknown, _) in owned {
        let ShapeUnknown {
            shape, reference, ..
        } = &shapes[unknown];
        all = all
            .into_iter()
            .flat_map(|so_far| {
                shape.starts.iter().map(move |start| {
                    let mut longer = so_far.clone();
                    longer.push((unknown, start * reference));
                    longer
                })
            })
            .collect();
    }
    all
}
