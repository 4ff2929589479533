//! The descent to the shapes that leave least: Gauss–Newton on their logarithms, with what the
//! columns can take up projected out.

use super::bench::Bench;
use super::hypothesis::{Column, Hypothesis, Part};
use crate::fit::effects::unknowns::ShapeUnknown;
use crate::fit::least_squares::bounded;
use crate::fit::least_squares::normal_equations;
use crate::text::work;
use faer::Mat;

/// A descent stops where a step gains less than this part of the cost.
const LITTLE: f64 = 3e-4;

impl Bench<'_> {
    /// Finds the shapes of the added members, or of all, that leave least; by so many steps at
    /// most.
    pub(crate) fn refined(&self, start: &Hypothesis, all: bool, steps: usize) -> Hypothesis {
        let (of_base, others) = self.unknowns(start);
        let (searched, fixed): (Vec<&ShapeUnknown>, Vec<&ShapeUnknown>) = if all {
            (of_base.iter().chain(&others).collect(), Vec::new())
        } else {
            (others.iter().collect(), of_base.iter().collect())
        };
        if searched.is_empty() {
            return start.clone();
        }
        let mut best = start.clone();
        let mut parts = self.parts(&best, &[]);
        let tangents = self.tangents(&best, &parts, &fixed);
        let cost = |parts: &[Part]| {
            let mut columns = self.columns(parts, start.base);
            columns.extend(tangents.iter().cloned());
            let (factors, products) = self.factors(&columns);
            (bounded::left(&products, &factors), factors, columns)
        };
        let mut at = cost(&parts);
        let mut damping = 1e-2;
        for _ in 0..steps {
            work::step();
            let Some(step) = self.step(&parts, &at.1, &at.2, &searched, damping) else {
                break;
            };
            let mut tried = best.clone();
            for (unknown, step) in searched.iter().zip(&step) {
                let (member, index) = unknown.places[0];
                let value = tried.values[member][index] * step.clamp(-0.7, 0.7).exp();
                for &(member, index) in &unknown.places {
                    tried.values[member][index] = unknown.clamp(value);
                }
            }
            let new = self.parts(&tried, &parts);
            let next = cost(&new);
            if next.0 < at.0 {
                let little = at.0 - next.0 < LITTLE * at.0;
                (best, parts, at) = (tried, new, next);
                damping = f64::max(damping / 5.0, 1e-6);
                if little {
                    break;
                }
            } else {
                damping *= 8.0;
                if damping > 1e4 {
                    break;
                }
            }
        }
        best
    }

    /// The step of the logarithms of shapes, with what the columns can take up projected out.
    fn step(
        &self,
        parts: &[Part],
        factors: &[f64],
        columns: &[Column],
        searched: &[&ShapeUnknown],
        damping: f64,
    ) -> Option<Vec<f64>> {
        let slopes = self.slopes(parts, factors, searched);
        let inside = columns.iter().zip(factors);
        let free: Vec<usize> = inside
            .enumerate()
            .filter(|(_, (c, f))| c.bounds[0] < **f && **f < c.bounds[1])
            .map(|(at, _)| at)
            .collect();
        let products = self.products(columns, &slopes, 0..self.measured.len());
        let (count, more) = (columns.len(), slopes.len());
        let last = count + more;
        // Products with the residual: those with the force less those with what the columns make of
        // it.
        let with_left = |row: usize| {
            let taken: f64 = (0..count).map(|c| factors[c] * products[(row, c)]).sum();
            products[(row, last)] - taken
        };
        // A shape that its bound keeps from going on stays there.
        let moves = |at: &usize| {
            let unknown = searched[at - count];
            let (member, index) = unknown.places[0];
            !unknown.is_held(parts[member].values[index], with_left(*at))
        };
        let moved: Vec<usize> = (count..last).filter(moves).collect();
        let pick: Vec<usize> = free.iter().chain(&moved).copied().collect();
        let matrix = Mat::from_fn(pick.len(), pick.len(), |i, j| {
            let value = products[(pick[i], pick[j])];
            let more = if i == j && i >= free.len() {
                1.0 + damping
            } else {
                1.0
            };
            if i == j {
                more * value + f64::MIN_POSITIVE
            } else {
                value
            }
        });
        let right = Mat::from_fn(pick.len(), 1, |i, _| with_left(pick[i]));
        let solved = normal_equations::solve(&matrix, &right).ok()?.coefficients;
        let mut step = vec![0.0; more];
        for (place, at) in moved.iter().enumerate() {
            step[at - count] = solved[(free.len() + place, 0)];
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }
}
