//! The candidates: every effect that could be added on an axis, with where its shapes may start and
//! what it makes of the records there.
//!
//! Each effect is evaluated once at all of its starting values. What it would explain beside a
//! hypothesis then follows from products of columns alone, strengths solved for within their
//! bounds.

use super::bench::Bench;
use super::hypothesis::{Column, Hypothesis, Part};
use crate::fit::effects::projection::product;
use crate::fit::effects::unknowns::{ShapeUnknown, is_physical, shapes};
use crate::fit::least_squares::bounded;
use crate::model::effects::AxisEffect;
use crate::study::{Axis, AxisKind};
use crate::text::work;
use faer::Mat;
use jointwatch_shared::effect::{Acts, EFFECTS, Subsystem};
use rayon::prelude::*;
use std::ops::Range;

/// Starting values of one effect's shapes that are tried at most; more are thinned out.
const MAX_STARTS: usize = 40;
/// Rows that a scan looks at: every so manieth of more.
const MAX_ROWS: usize = 6000;
/// Of what a hypothesis leaves, an effect that takes away less than this part is no news.
const MIN_NEW: f64 = 1e-7;

/// One effect at one choice of its shapes.
struct Start {
    part: Part,
    columns: Range<usize>,
    products: Mat<f64>,
}

/// An effect that would explain something.
#[derive(Clone)]
pub(crate) struct Promise {
    pub(crate) bound: AxisEffect,
    /// Shapes as they start; strengths as least squares has them.
    pub(crate) values: Vec<f64>,
    /// Power that it takes away in the rows of the scan, beside that of the force.
    pub(crate) gain: f64,
}

/// Every candidate at every start, on the rows of a scan.
pub(crate) struct Library {
    starts: Vec<Start>,
    matrix: Mat<f64>,
    step: usize,
}

/// Every effect that could be added on an axis to a model that has the `known` terms.
pub(crate) fn candidates(
    bench: &Bench<'_>,
    axes: &[Axis],
    known: &[AxisEffect],
    inputs: &[&'static str],
    without: &[String],
) -> Vec<AxisEffect> {
    let axis = bench.axis;
    let names: Vec<&str> = axes.iter().map(|a| a.name.as_str()).collect();
    let bound = |entry, axis, input| AxisEffect { entry, axis, input };
    let bounds = EFFECTS.iter().filter_map(|entry| match entry.acts {
        Acts::OwnAxis => Some(bound(entry, axis, None)),
        Acts::BothAxes => (axes.len() == 2).then_some(bound(entry, 0, None)),
    });
    // Every force of the joint may follow an input that changes.
    let of_joint = EFFECTS
        .iter()
        .filter(|entry| entry.acts == Acts::OwnAxis && entry.subsystem == Subsystem::Plant);
    let following =
        of_joint.flat_map(|entry| inputs.iter().map(move |i| bound(entry, axis, Some(*i))));
    // A square is no candidate by itself: it comes with the input, or after it.
    let following = following.filter(|bound| {
        let mut known = known.iter();
        bound.squared().is_some() || known.any(|k| k.squared().as_ref() == Some(bound))
    });
    let bounds = bounds.chain(following);
    let inertia = bench.records.doubtful_inertia(axis);
    bounds
        .filter(|bound| {
            let name = bound.entry.about.name;
            let tells = match name {
                "inertia_error" => inertia.is_some(),
                // Where no inertia force is known, a gain is another joint.
                "force_gain" => inertia.is_some_and(|stated| stated > 0.0),
                _ => true,
            };
            // A law that holds one of the base as a special case takes its place.
            let rival = known
                .iter()
                .any(|term| bound.rules_out(term) && !bound.replaces(term));
            // A length that is given whatever the motion is a full turn, which a translation has
            // not.
            let mut listed = bound.entry.parameters().iter();
            let turns = listed.any(|p| p.is_given() && bound.entry.is_in_si(p));
            let shows = bench.reverses || !needs_a_way_back(bound);
            // What is wrong with a force channel takes one.
            let measured =
                bound.entry.subsystem != Subsystem::Sensor || bench.records.forced[bench.axis];
            // Whether every record has a zero of its own is asked apart.
            !rival
                && shows
                && measured
                && (!turns || axes[bound.axis].kind == AxisKind::Rotation)
                && !bound.entry.is_zero_per_record()
                && !known.contains(bound)
                && tells
                && !without
                    .iter()
                    .any(|w| w == name || *w == bound.name(&names))
        })
        .collect()
}

/// Friction and damping that change with the place.
const BY_PLACE: [&str; 4] = [
    "position_damping",
    "position_friction",
    "periodic_friction",
    "bouc_wen_by_place",
];

/// Whether an axis that goes one way says nothing of an effect: there time passes as the place
/// does, and what changes with the place is a spring.
fn needs_a_way_back(bound: &AxisEffect) -> bool {
    bound.entry.subsystem == Subsystem::TimeVaryingPlant
        || BY_PLACE.contains(&bound.entry.about.name)
}

impl Library {
    /// Evaluates candidates at their starts; `known` are all terms of the model with their values,
    /// for shapes that are tied to theirs.
    pub(crate) fn new(
        bench: &Bench<'_>,
        candidates: &[AxisEffect],
        known: &[AxisEffect],
        values: &[Vec<f64>],
        residual: &[f64],
    ) -> Self {
        let rows = bench.measured.len();
        let step = rows.div_ceil(MAX_ROWS).max(1);
        let all: Vec<(AxisEffect, Vec<f64>)> = candidates
            .iter()
            .flat_map(|bound| {
                let starts = starts(bench, bound, known, values, residual);
                // A pitch that is thinned out is not found from its neighbours, so that every one
                // stays once.
                let thin = match bound.entry.pitch() {
                    None => starts.len().div_ceil(MAX_STARTS),
                    Some(_) => starts.len() / MAX_STARTS,
                };
                starts
                    .into_iter()
                    .step_by(thin.max(1))
                    .map(|values| (*bound, values))
            })
            .collect();
        let parts: Vec<Part> = all
            .par_iter()
            .map(|(bound, values)| {
                work::step();
                thinned(bench.part(bound, values), step)
            })
            .collect();
        let mut starts = Vec::new();
        let mut count = 0;
        for part in parts {
            let columns = count..count + part.columns.len();
            count = columns.end;
            let own = matrix_of(&part.columns);
            starts.push(Start {
                products: product(&own, &own),
                columns,
                part,
            });
        }
        let columns: Vec<&Column> = starts.iter().flat_map(|s| &s.part.columns).collect();
        let matrix = Mat::from_fn(rows.div_ceil(step), count, |r, c| columns[c].data[r]);
        Self {
            starts,
            matrix,
            step,
        }
    }

    /// Whether a candidate is such.
    pub(crate) fn has(&self, such: impl Fn(&AxisEffect) -> bool) -> bool {
        self.starts.iter().any(|start| such(&start.part.bound))
    }

    /// What each candidate would explain beside a hypothesis with this design, the most promising
    /// first: one start of each.
    pub(crate) fn scan(
        &self,
        bench: &Bench<'_>,
        hypothesis: &Hypothesis,
        design: &[Column],
    ) -> Vec<Promise> {
        let rows = self.matrix.nrows();
        let all = Mat::from_fn(rows, design.len() + 1, |r, c| {
            let row = r * self.step;
            design
                .get(c)
                .map_or(bench.measured[row], |column| column.data[row])
        });
        let bounds: Vec<[f64; 2]> = design.iter().map(|c| c.bounds).collect();
        let own = product(&all, &all);
        let left = bounded::left(&own, &bounded::factors(&own, &bounds));
        let beside = Beside {
            cross: product(&all, &self.matrix),
            own,
            bounds,
            left,
        };
        let starts = self.starts.par_iter();
        let promises = starts.filter_map(|start| promise(bench, hypothesis, start, &beside));
        let whole = rows as f64 * bench.power;
        let mut best: Vec<Promise> = Vec::new();
        for mut promise in promises.collect::<Vec<_>>() {
            promise.gain /= whole;
            match best.iter_mut().find(|p| p.bound == promise.bound) {
                Some(known) if known.gain < promise.gain => *known = promise,
                Some(_) => {}
                None => best.push(promise),
            }
        }
        best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        best
    }
}

/// What stands beside every start of a scan: the columns of a hypothesis, and the force as the last
/// one.
struct Beside {
    /// Products of them with each other, and with the columns of all starts.
    own: Mat<f64>,
    cross: Mat<f64>,
    /// The least and the most of each column's factor.
    bounds: Vec<[f64; 2]>,
    /// Σ of the squared error that they leave.
    left: f64,
}

/// What one start explains beside a hypothesis.
fn promise(
    bench: &Bench<'_>,
    hypothesis: &Hypothesis,
    start: &Start,
    beside: &Beside,
) -> Option<Promise> {
    let bound = &start.part.bound;
    let rivals = |(at, term): (usize, &AxisEffect)| {
        let special = at < hypothesis.base && bound.replaces(term);
        term == bound || (bound.rules_out(term) && !special)
    };
    if hypothesis.members.iter().enumerate().any(rivals) {
        return None;
    }
    let (before, count) = (beside.bounds.len(), start.columns.len());
    // Its columns stand between those of the hypothesis and the force.
    let own = |c: usize| (before..before + count).contains(&c).then(|| c - before);
    let others = |c: usize| if c < before { c } else { before };
    let products = Mat::from_fn(before + count + 1, before + count + 1, |r, c| {
        match (own(r), own(c)) {
            (Some(r), Some(c)) => start.products[(r, c)],
            (Some(r), None) => beside.cross[(others(c), start.columns.start + r)],
            (None, Some(c)) => beside.cross[(others(r), start.columns.start + c)],
            (None, None) => beside.own[(others(r), others(c))],
        }
    });
    let columns = start.part.columns.iter().map(|c| c.bounds);
    let mut bounds: Vec<[f64; 2]> = beside.bounds.iter().copied().chain(columns).collect();
    // It takes the place of its special cases in the base, whose columns stand first.
    let mut first = 0;
    for part in &bench.base_parts {
        let columns = first..first + part.columns.len();
        first = columns.end;
        if bound.replaces(&part.bound) {
            bounds[columns].fill([0.0; 2]);
        }
    }
    let factors = bounded::factors(&products, &bounds);
    let gain = beside.left - bounded::left(&products, &factors);
    let mut values = start.part.values.clone();
    bench.records.put(bound, &factors[before..], &mut values);
    (gain > MIN_NEW * beside.left && is_physical(bound, &values, bench.records)).then_some(
        Promise {
            bound: *bound,
            values,
            gain,
        },
    )
}

fn thinned(part: Part, step: usize) -> Part {
    let columns = part.columns.into_iter().map(|column| Column {
        data: column
            .data
            .iter()
            .copied()
            .step_by(step)
            .collect::<Vec<_>>()
            .into(),
        bounds: column.bounds,
    });
    Part {
        columns: columns.collect(),
        ..part
    }
}

fn matrix_of(columns: &[Column]) -> Mat<f64> {
    let rows = columns.first().map_or(0, |c| c.data.len());
    Mat::from_fn(rows, columns.len(), |r, c| columns[c].data[r])
}

/// Every combination of an effect's starting values, all its parameters in SI; shapes that are tied
/// to a term of the model have its value.
fn starts(
    bench: &Bench<'_>,
    bound: &AxisEffect,
    known: &[AxisEffect],
    values: &[Vec<f64>],
    residual: &[f64],
) -> Vec<Vec<f64>> {
    let records = bench.records;
    let mut with = known.to_vec();
    with.push(*bound);
    let all = shapes(&with, &records.references);
    let mut first = vec![0.0; bound.entry.parameters().len()];
    let mut own: Vec<&ShapeUnknown> = Vec::new();
    for unknown in &all {
        let mine = unknown.places.iter().filter(|place| place.0 == known.len());
        for &(_, index) in mine {
            let owner = unknown.places[0];
            if owner.0 < known.len() {
                first[index] = values[owner.0][owner.1];
            } else {
                own.push(unknown);
            }
        }
    }
    let mut combined = vec![first];
    for unknown in own {
        let index = unknown.places[0].1;
        let candidates: Vec<f64> = if bound.entry.is_line() {
            vec![records.line_in(residual, bound.axis, &unknown.shape)]
        } else {
            let starts = unknown.shape.starts.iter();
            let starts = starts.map(|start| start * unknown.reference);
            let short = (bound.entry.pitch() == Some(index))
                .then(|| records.pitches_in(residual, bound, unknown));
            starts.chain(short.into_iter().flatten()).collect()
        };
        combined = combined
            .into_iter()
            .flat_map(|so_far| {
                candidates.iter().map(move |value| {
                    let mut longer = so_far.clone();
                    longer[index] = *value;
                    longer
                })
            })
            .collect();
    }
    combined
}
