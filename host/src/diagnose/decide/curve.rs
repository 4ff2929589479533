//! A curve without a law: the force as a polynomial of the displacement, of the velocity, or of
//! both. Several laws in whose place such a curve predicts as well are pieces of it.

use crate::diagnose::criteria;
use crate::diagnose::search::bench::{Bench, rows_of};
use crate::diagnose::search::hypothesis::Column;
use crate::diagnose::search::rank::ScoredHypothesis;
use crate::diagnose::search::score::Score;
use crate::model::effects::AxisEffect;
use crate::study::series::mean;
use std::sync::Arc;

/// What a curve may be a function of, with how many polynomials are tried, those of the lowest
/// orders first; of both states whole orders.
const CURVES: [(&str, &[usize]); 3] = [
    ("the displacement", &[4, 6, 9, 13, 19, 28]),
    ("the velocity", &[4, 6, 9, 13, 19, 28]),
    ("displacement and velocity", &[10, 15, 21, 28]),
];
/// A curve takes the place of so many laws at least: in the place of one it would win from every
/// law with a rounded corner.
const PIECES: usize = 2;

/// A curve that does for several laws.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// What it is a function of, in words.
    pub(crate) of: &'static str,
    /// The laws in whose place it stands.
    pub(crate) pieces: Vec<AxisEffect>,
}

impl Curve {
    /// The curve that predicts at least as well as the most laws of a set in whose place it stands.
    ///
    /// Its own numbers cost nothing: the laws were picked from a library, which is not priced
    /// either, and blocks that it was not fitted to judge both.
    pub(crate) fn in_place_of(bench: &Bench<'_>, decided: &ScoredHypothesis) -> Option<Self> {
        let added = decided.hypothesis.added();
        if added.len() < PIECES {
            return None;
        }
        let known = in_turn(bench, &decided.score);
        let curves = [0, 1, 2].map(|which| columns(bench, which));
        let mut found: Vec<(usize, f64, Self)> = Vec::new();
        for chosen in 0..1_usize << added.len() {
            let is_in = |place: &usize| chosen >> place & 1 == 1;
            let pieces: Vec<AxisEffect> =
                (0..added.len()).filter(is_in).map(|at| added[at]).collect();
            if pieces.len() < PIECES {
                continue;
            }
            for ((of, counts), columns) in CURVES.into_iter().zip(&curves) {
                let rank = rank(bench, decided, &pieces, (counts, columns));
                if rank <= known {
                    let pieces = pieces.clone();
                    found.push((pieces.len(), rank, Self { of, pieces }));
                }
            }
        }
        let best = found
            .into_iter()
            .max_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        best.map(|(.., curve)| curve)
    }
}

/// The rank of a set with the best curve, of so many polynomials, in the place of some of its laws.
fn rank(
    bench: &Bench<'_>,
    decided: &ScoredHypothesis,
    pieces: &[AxisEffect],
    (counts, polynomials): (&[usize], &[Column]),
) -> f64 {
    let mut narrower = decided.hypothesis.clone();
    for piece in pieces {
        narrower = narrower.without(piece);
    }
    let parts = bench.parts(&narrower, &decided.parts);
    let design = bench.design(&narrower, &parts);
    let ranks = counts.iter().map(|&count| {
        let design = [&design, &polynomials[..count]].concat();
        let score = bench.score(&narrower, &parts, &bench.judged(&design));
        in_turn(bench, &score)
    });
    ranks.fold(f64::INFINITY, f64::min)
}

/// Mean log error on the blocks in turn with the price of the laws' numbers. A function without a
/// law says nothing where it has seen nothing, so folds that extrapolate do not count.
fn in_turn(bench: &Bench<'_>, score: &Score) -> f64 {
    let folds = bench.blocks.folds[..bench.blocks.turns].iter();
    let errors = &score.log_errors[..folds.map(Vec::len).sum()];
    mean(errors) + criteria::PRICE * score.numbers as f64
}

/// Products of Chebyshev's polynomials of the states as columns of the axis, those of the lowest
/// order first.
fn columns(bench: &Bench<'_>, which: usize) -> Vec<Column> {
    let (records, axis) = (bench.records, bench.axis);
    let references = &records.references;
    let most = [references.displacement[axis], references.velocity[axis]];
    let count = CURVES[which].1.last().copied().unwrap_or(0);
    let orders: Vec<[usize; 2]> = match which {
        0 => (0..count).map(|order| [order, 0]).collect(),
        1 => (0..count).map(|order| [0, order]).collect(),
        _ => (0..count)
            .flat_map(|sum| (0..=sum).map(move |order| [sum - order, order]))
            .take(count)
            .collect(),
    };
    let polynomial = |order: usize, part: f64| (order as f64 * part.clamp(-1.0, 1.0).acos()).cos();
    let column = |[of_x, of_v]: &[usize; 2]| {
        let whole = records.of_motion(axis, None, |sample| {
            polynomial(*of_x, sample.displacement / most[0])
                * polynomial(*of_v, sample.velocity / most[1])
        });
        Column {
            data: Arc::new(whole[rows_of(records, axis)].to_vec()),
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
        }
    };
    orders.iter().map(column).collect()
}
