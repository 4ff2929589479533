//! What a hypothesis is worth: its error on blocks that it was not learnt from, and the price of
//! what it chooses.

use super::bench::{Bench, LEARNT};
use super::hypothesis::{Column, Hypothesis, Part, is_replaced};
use crate::diagnose::criteria;
use crate::fit::least_squares::bounded;
use crate::study::series::mean;
use faer::Mat;

/// Error power that counts as none, beside that of the force.
pub(crate) const NO_POWER: f64 = 1e-7;

/// What a hypothesis is worth.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    /// Log error power of every judged block, fold after fold, beside that of the force.
    pub(crate) log_errors: Vec<f64>,
    /// RMS error over RMS force on blocks in turn.
    pub(crate) error: f64,
    /// What was chosen: strengths and shapes.
    pub(crate) numbers: usize,
    /// Mean log error with the price of the numbers: less is better.
    pub(crate) rank: f64,
}

impl Score {
    /// Whether it leaves a third of the error of another one.
    pub(crate) fn is_clearly_better(&self, than: &Self) -> bool {
        let pairs = than.log_errors.iter().zip(&self.log_errors);
        let gained: f64 = pairs.map(|(other, own)| other - own).sum();
        gained > criteria::CLEARLY * self.log_errors.len() as f64
    }
}

/// What least squares makes of a design on all blocks but some.
pub(crate) struct Judged {
    /// Products of the columns in every block.
    products: Vec<Mat<f64>>,
    /// Factors from all rows,
    pub(crate) all: Vec<f64>,
    /// and those with which each fold is judged.
    pub(crate) folds: Vec<Vec<f64>>,
}

impl Bench<'_> {
    /// Factors of a design's columns, from all rows and as each fold judges with them.
    pub(crate) fn judged(&self, columns: &[Column]) -> Judged {
        let blocks = self.blocks.rows.iter();
        let products: Vec<Mat<f64>> = blocks
            .map(|rows| self.products(columns, &[], rows.clone()))
            .collect();
        let size = columns.len() + 1;
        let mut whole = Mat::<f64>::zeros(size, size);
        products.iter().for_each(|p| whole += p);
        let bounds: Vec<[f64; 2]> = columns.iter().map(|c| c.bounds).collect();
        let folds = self.blocks.folds.iter().map(|fold| {
            let mut learnt = whole.clone();
            fold.iter().for_each(|&block| learnt -= &products[block]);
            // What the other blocks hardly hold is not learnt from them.
            let bounds = bounds.iter().enumerate().map(|(c, &own)| {
                if learnt[(c, c)] < LEARNT * whole[(c, c)] {
                    [0.0; 2]
                } else {
                    own
                }
            });
            bounded::factors(&learnt, &bounds.collect::<Vec<_>>())
        });
        Judged {
            folds: folds.collect(),
            all: bounded::factors(&whole, &bounds),
            products,
        }
    }

    /// The score of a hypothesis on blocks that were not learnt from.
    pub(crate) fn score(&self, hypothesis: &Hypothesis, parts: &[Part], judged: &Judged) -> Score {
        let (products, folds) = (&judged.products, &judged.folds);
        let (mut log_errors, mut squares) = (Vec::new(), 0.0);
        for (at, (fold, factors)) in self.blocks.folds.iter().zip(folds).enumerate() {
            for &block in fold {
                let square = bounded::left(&products[block], factors);
                let rows = self.blocks.rows[block].len() as f64;
                log_errors.push((square / rows / self.power + NO_POWER).ln());
                squares += if at < self.blocks.turns { square } else { 0.0 };
            }
        }
        let acting = parts.iter().enumerate();
        let acting = acting.filter(|(at, _)| !is_replaced(parts, hypothesis.base, *at));
        let strengths = acting.flat_map(|(_, part)| &part.columns);
        let strengths = strengths.filter(|c| c.data.iter().any(|v| *v != 0.0));
        let (of_base, others) = self.unknowns(hypothesis);
        let numbers = strengths.count() + of_base.len() + others.len();
        self.score_of(log_errors, squares, numbers)
    }

    /// A score from what is left of every judged block.
    pub(crate) fn score_of(&self, log_errors: Vec<f64>, squares: f64, numbers: usize) -> Score {
        Score {
            rank: mean(&log_errors) + criteria::PRICE * numbers as f64,
            error: (squares / self.measured.len().max(1) as f64 / self.power).sqrt(),
            log_errors,
            numbers,
        }
    }
}
