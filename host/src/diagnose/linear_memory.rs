//! Whether a force that is linear in the past displacement is left that no effect of the library has.
//!
//! The library's linear forces with memory are few: a Maxwell element, a late or wrongly scaled force channel. Any other one, a
//! feedback with a delay or a chain of several elements, looks much like one of them and is named for it, since what
//! they leave of it is small. No linear law can leave anything that the displacements of the last moments explain together. Two
//! things are asked, therefore: whether they explain much of what is left; and, where a law with memory was found, whether they explain more
//! than a right one would leave, beside what it explains itself, however small that is.

use super::held_out::Worth;
use super::judge::WRONG_BY;
use super::patterns::LeftOver;
use crate::fit::effects::Solution;
use crate::fit::effects::columns::Records;
use crate::model::effects::Bound;

/// Displacements of so many moments are tried together,
const MOMENTS: usize = 14;
/// so far apart, s: neighbours still differ in a band of 120 Hz, and the oldest is a few hundredths of a second old.
const APART_S: f64 = 0.002;
/// They have to explain this part of what is left over.
const MIN_PART: f64 = 0.45;
/// The library's laws with memory, which others are taken for,
const WITH_MEMORY: [&str; 2] = ["maxwell", "time_delay"];
/// and RMS beside RMS what past displacements add at most to what was found when one of them is right;
const OF_EXPLAINED: f64 = 0.03;
/// it counts from this part of the force on
const MIN_BESIDE: f64 = 0.001;
/// and with so many standard errors.
const SURE: f64 = 3.5;

/// What past displacements explain of what a solved model leaves over on an axis, on blocks that were not fitted to, if it says
/// something. `explained` is
/// what the effects that were `found` explain, RMS beside the RMS force of the axis.
pub(super) fn worth(
    left: &LeftOver<'_>,
    axis: usize,
    found: &[Bound],
    explained: f64,
) -> Option<Worth> {
    let moments = (1..=MOMENTS).map(|moment| left.records.delayed(axis, moment as f64 * APART_S));
    let (worth, gain) = left.explained_by(axis, &moments.collect::<Vec<_>>())?;
    let of_delay = of_a_delay(left.records, left.terms, left.solution, axis);
    let least = WRONG_BY.max(of_delay);
    let much = worth.share >= least && worth.part >= MIN_PART && gain.is_sure();
    let taken_for = |f: &Bound| f.axis == axis && WITH_MEMORY.contains(&f.entry.about.name);
    let least_beside = MIN_BESIDE.max(OF_EXPLAINED * explained).max(of_delay);
    let beside =
        found.iter().any(taken_for) && worth.share >= least_beside && gain.sum > SURE * gain.error;
    (much || beside).then_some(worth)
}

/// What the law of a late force channel leaves over, RMS beside the RMS force of the axis: it is the first term of the delayed
/// force's series, `F(t − τ) = F − τ·Ḟ + τ²·F̈/2 − …`. Twice the second one, so that the later ones have room.
fn of_a_delay(records: &Records<'_>, terms: &[Bound], solution: &Solution, axis: usize) -> f64 {
    let late = |term: &Bound| term.entry.about.name == "time_delay" && term.axis == axis;
    let Some(at) = terms.iter().position(late) else {
        return 0.0;
    };
    let rows = records.rows_per_axis();
    let columns = records.columns(&terms[at], &solution.solved.values[at]);
    let rate = columns
        .iter()
        .flat_map(|c| &c[axis * rows..(axis + 1) * rows]);
    let rate: Vec<f64> = rate.copied().collect();
    let steps = rate.windows(2).map(|pair| pair[1] - pair[0]);
    let power: f64 = steps.map(|step| step * step).sum();
    let second = records.thinned_rate_hz * (power / rows.max(1) as f64).sqrt();
    let delay = solution.solved.values[at].first().copied().unwrap_or(0.0);
    delay * delay * second / records.references.force[axis]
}
