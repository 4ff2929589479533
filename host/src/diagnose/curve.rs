//! A curve without a law: the force as a polynomial of one state, of the displacement or of the velocity alone. Several laws in whose place
//! such a curve predicts as well are pieces of it.

use super::bench::{Bench, rows_of};
use super::criteria::CRITERIA;
use super::hypothesis::Column;
use super::rank::Looked;
use crate::model::effects::AxisEffect;
use std::sync::Arc;

/// Numbers of polynomials that are tried of one state, and of both: the most are as many as a diagnosis has blocks to see bends in.
const OF_ONE: [usize; 6] = [4, 5, 7, 9, 12, 16];
const OF_BOTH: [usize; 4] = [10, 15, 21, 28];
/// What a curve may be a function of.
const STATES: [&str; 3] = [
    "the displacement",
    "the velocity",
    "displacement and velocity",
];
/// A curve takes the place of so many laws at least: in the place of one it would win from every law with a rounded corner.
const PIECES: usize = 2;

/// A curve that does for several laws.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    /// What it is a function of, in words.
    pub(super) of: &'static str,
    /// The laws.
    pub(super) pieces: Vec<AxisEffect>,
}

impl Curve {
    /// The curve that predicts at least as well as the most laws of a set in whose place it stands, with the numbers of both priced.
    pub(super) fn in_place_of(bench: &Bench<'_>, decided: &Looked) -> Option<Self> {
        let added = decided.hypothesis.added();
        if added.len() < PIECES {
            return None;
        }
        let states = STATES.map(|of| (of, columns(bench, of)));
        let mut best: Option<(usize, f64, Self)> = None;
        for chosen in 0..1_usize << added.len() {
            let is_in = |place: &usize| chosen >> place & 1 == 1;
            let pieces: Vec<AxisEffect> =
                (0..added.len()).filter(is_in).map(|at| added[at]).collect();
            if pieces.len() < PIECES {
                continue;
            }
            for (of, columns) in &states {
                let rank = rank(bench, decided, &pieces, columns);
                let better = best
                    .as_ref()
                    .is_none_or(|(count, known, _)| (pieces.len(), -rank) > (*count, -known));
                if rank <= decided.score.rank && better {
                    let pieces = pieces.clone();
                    best = Some((pieces.len(), rank, Self { of, pieces }));
                }
            }
        }
        best.map(|(.., curve)| curve)
    }
}

/// The rank of a set with the best curve in the place of some of its laws.
fn rank(bench: &Bench<'_>, decided: &Looked, pieces: &[AxisEffect], curve: &[Column]) -> f64 {
    let mut narrower = decided.hypothesis.clone();
    for piece in pieces {
        narrower = narrower.without(piece);
    }
    let parts = bench.parts(&narrower, &decided.parts);
    let design = bench.design(&narrower, &parts);
    let tried: &[usize] = if curve.len() > OF_ONE[OF_ONE.len() - 1] {
        &OF_BOTH
    } else {
        &OF_ONE
    };
    let ranks = tried.iter().map(|&count| {
        let design = [&design, &curve[..count]].concat();
        let score = bench.score(&narrower, &parts, &bench.judged(&design));
        score.rank + CRITERIA.price * count as f64
    });
    ranks.fold(f64::INFINITY, f64::min)
}

/// Products of Chebyshev's polynomials of the states, those of the lowest order first, as columns of the axis.
fn columns(bench: &Bench<'_>, of: &str) -> Vec<Column> {
    let (records, axis) = (bench.records, bench.axis);
    let references = &records.references;
    let most = [references.displacement[axis], references.velocity[axis]];
    let one = |order: usize, part: f64| (order as f64 * part.clamp(-1.0, 1.0).acos()).cos();
    let orders: Vec<[usize; 2]> = match STATES.iter().position(|known| *known == of) {
        Some(0) => (0..OF_ONE[OF_ONE.len() - 1]).map(|n| [n, 0]).collect(),
        Some(1) => (0..OF_ONE[OF_ONE.len() - 1]).map(|n| [0, n]).collect(),
        _ => (0..)
            .flat_map(|sum| (0..=sum).map(move |n| [sum - n, n]))
            .take(OF_BOTH[OF_BOTH.len() - 1])
            .collect(),
    };
    let column = |[of_x, of_v]: &[usize; 2]| {
        let whole = records.of_motion(axis, None, |sample| {
            one(*of_x, sample.displacement / most[0]) * one(*of_v, sample.velocity / most[1])
        });
        Column {
            data: Arc::new(whole[rows_of(records, axis)].to_vec()),
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
        }
    };
    orders.iter().map(column).collect()
}
