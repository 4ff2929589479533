//! One axis of the training records, ready to hold hypotheses against: what a set of effects makes
//! of the measured force, with values that keep to physical bounds, and what it leaves on blocks
//! that it was not learnt from.

use super::blocks::Blocks;
use super::hypothesis::{
    Column, Hypothesis, Part, driven, is_at_bound, is_replaced, is_turned, mean_product,
};
use crate::diagnose::criteria;
use crate::fit::effects::are_enough;
use crate::fit::effects::columns::Records;
use crate::fit::effects::projection::product;
use crate::fit::effects::slopes::{At, SHAPES_MOVE};
use crate::fit::effects::unknowns::{MAX_FORCE, ShapeUnknown, column_bounds, shapes};
use crate::fit::least_squares::bounded;
use crate::model::effects::AxisEffect;
use crate::study::quasi_static::is_without_meaning;
use crate::study::series::{mean, peak, rms};
use faer::Mat;
use jointwatch_shared::effect::Entry;
use std::ops::Range;
use std::sync::Arc;

/// Without an applied force there is no second channel whose gain, zero or lateness could pass for
/// a force: then so much less is explained at least.
const ONE_CHANNEL: f64 = 0.1;
/// A way back is at least this part of the way there: noise on a slow motion comes back as well.
const WAY_BACK: f64 = 0.015;
/// Of a column's energy, what has to be left in the blocks that a fold learns from.
pub(crate) const LEARNT: f64 = 0.02;

/// An axis to hold hypotheses against.
pub(crate) struct Bench<'a> {
    pub(crate) records: &'a Records<'a>,
    pub(crate) axis: usize,
    pub(crate) measured: &'a [f64],
    pub(crate) blocks: Blocks,
    /// Mean square of the force.
    pub(crate) power: f64,
    /// What an effect explains at least, RMS beside the RMS force.
    pub(crate) least_share: f64,
    /// Mean square of the force about its mean, beside its mean square.
    pub(crate) moving: f64,
    /// The largest RMS force of a term of the base, or the measured one.
    scale: f64,
    /// The same of the largest force.
    peak: f64,
    /// The velocity of every row.
    velocity: Vec<f64>,
    /// Whether the velocity is the direction of travel alone, as without time.
    only_direction: bool,
    /// Mean power with which the base's own dampers drive the joint: their strengths are below 0,
    /// and the base lacks a force.
    driven: f64,
    /// Whether the motion turns round, without which a hysteresis looks like a spring.
    pub(crate) reverses: bool,
    /// Zero, inertia and lateness within their tolerances: the effect that each stands for, and
    /// its column.
    instruments: Vec<(&'static str, Column)>,
    /// The force of each record's own zero, where zeros differ.
    zeros: Vec<Column>,
    /// Inertia that is not stated.
    acceleration: Option<Column>,
    /// The base's columns, and the tangents of its shapes.
    pub(crate) base_parts: Vec<Part>,
    base_tangents: Vec<Column>,
}

/// The rows of an axis in a whole column.
pub(crate) fn rows_of(records: &Records<'_>, axis: usize) -> Range<usize> {
    let rows = records.rows_per_axis();
    axis * rows..(axis + 1) * rows
}

/// What an effect explains of an axis at least, RMS beside the RMS force: a share of what the force
/// has about its mean.
pub(crate) fn least_share(records: &Records<'_>, axis: usize) -> f64 {
    let channels = if records.forced[axis] {
        1.0
    } else {
        ONE_CHANNEL
    };
    channels * criteria::LEAST_SHARE * moving(records, axis).sqrt()
}

/// Mean square of an axis's force about its mean, beside its mean square: a load that stands still
/// is no yardstick for what moves.
pub(crate) fn moving(records: &Records<'_>, axis: usize) -> f64 {
    let force = &records.measured[rows_of(records, axis)];
    let power = mean_product(force, force).max(f64::MIN_POSITIVE);
    let mean = mean(force);
    (1.0 - mean * mean / power).max(0.0)
}

/// Whether an axis goes both ways: as far as a part of the longest way that it goes in a
/// record. To and fro at one place, as noise does, it goes nowhere.
fn reverses(records: &Records<'_>, axis: usize) -> bool {
    let displacement = records.of_motion(axis, None, |at| at.displacement);
    let (mut ahead, mut back, mut from) = (0.0_f64, 0.0_f64, 0);
    for rows in &records.rows {
        let own = &displacement[from..from + rows];
        from += rows;
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for &x in own {
            (lowest, highest) = (lowest.min(x), highest.max(x));
            (ahead, back) = (ahead.max(x - lowest), back.max(highest - x));
        }
    }
    ahead.min(back) > WAY_BACK * ahead.max(back)
}

impl<'a> Bench<'a> {
    /// An axis beside a base; `own_zero` is the effect that gives every record a zero of its own.
    pub(crate) fn new(
        records: &'a Records<'a>,
        axis: usize,
        base: &Hypothesis,
        own_zero: Option<AxisEffect>,
    ) -> Self {
        let measured = &records.measured[rows_of(records, axis)];
        let velocity = records.of_motion(axis, None, |at| at.velocity);
        let mut bench = Self {
            records,
            axis,
            measured,
            blocks: Blocks::new(measured, &records.rows),
            power: records.references.force[axis].powi(2),
            least_share: least_share(records, axis),
            moving: moving(records, axis),
            scale: rms(measured),
            peak: peak(measured),
            driven: 0.0,
            reverses: reverses(records, axis),
            only_direction: velocity.iter().all(|v| [0.0, 1.0].contains(&v.abs())),
            velocity,
            instruments: Vec::new(),
            zeros: Vec::new(),
            acceleration: None,
            base_parts: Vec::new(),
            base_tangents: Vec::new(),
        };
        bench.acceleration = records.accelerations[axis].as_ref().map(|column| Column {
            data: Arc::new(column[rows_of(records, axis)].to_vec()),
            bounds: [0.0, f64::INFINITY],
        });
        if let Some(own) = own_zero {
            bench.zeros = bench
                .part(&own, &vec![0.0; own.entry.parameters().len()])
                .columns;
        }
        bench.instruments = bench.instrument_columns();
        bench.bound_by(base);
        bench
    }

    /// Whether the records are long enough for a hypothesis beside their zeros.
    pub(crate) fn is_long_enough(&self, hypothesis: &Hypothesis) -> bool {
        are_enough(self.records, &hypothesis.members, self.zeros.len())
    }

    /// Takes the largest force among the base's terms as the measure of what effects may have, and
    /// keeps the folds that determine the base.
    fn bound_by(&mut self, base: &Hypothesis) {
        let parts = self.parts(base, &[]);
        let columns = self.columns(&parts, base.base);
        let (factors, _) = self.factors(&columns);
        let forces = columns.iter().zip(&factors);
        let largest = forces.map(|(c, f)| f.abs() * rms(&c.data));
        self.scale = largest.fold(self.scale, f64::max);
        self.driven = driven(&self.valued(base, &parts, &factors), &self.velocity);
        let peaks = columns.iter().zip(&factors);
        let peaks = peaks.map(|(c, f)| f.abs() * peak(&c.data));
        self.peak = peaks.fold(self.peak, f64::max);
        let energy = |rows: &Range<usize>, column: &Column| -> f64 {
            column.data[rows.clone()].iter().map(|v| v * v).sum()
        };
        let own: Vec<&Column> = columns.iter().collect();
        let turns = self.blocks.turns;
        let mut folds = std::mem::take(&mut self.blocks.folds);
        let mut at = 0;
        folds.retain(|fold| {
            at += 1;
            let left = |column: &&Column| {
                let whole = energy(&(0..self.measured.len()), column);
                let judged: f64 = fold
                    .iter()
                    .map(|&b| energy(&self.blocks.rows[b], column))
                    .sum();
                whole - judged >= LEARNT * whole
            };
            at <= turns || own.iter().all(left)
        });
        self.blocks.folds = folds;
        let (of_base, _) = self.unknowns(base);
        self.base_tangents = self.tangents(base, &parts, &of_base.iter().collect::<Vec<_>>());
        self.base_parts = parts;
    }

    fn instrument_columns(&self) -> Vec<(&'static str, Column)> {
        let within = |name: &'static str, most: f64| {
            let entry = Entry::named(name)?;
            let bound = AxisEffect {
                input: None,
                entry,
                axis: self.axis,
            };
            let part = self.part(&bound, &vec![0.0; entry.parameters().len()]);
            let column = part.columns.first()?;
            (rms(&column.data) > 0.0).then(|| {
                let bounds = [-most, most];
                let data = column.data.clone();
                (name, Column { data, bounds })
            })
        };
        let applied = self.records.applied_rms(self.axis);
        let stated = self.records.doubtful_inertia(self.axis);
        let stated = stated.filter(|inertia| *inertia > 0.0);
        [
            within("preload", criteria::ZERO * applied),
            stated.and_then(|stated| within("inertia_error", criteria::GAIN * stated)),
            within("time_delay", criteria::LATENESS_S),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// An effect's shapes as they start, all its parameters in SI.
    pub(crate) fn middle(&self, bound: &AxisEffect) -> Vec<f64> {
        let mut values = vec![0.0; bound.entry.parameters().len()];
        for unknown in shapes(&[*bound], &self.records.references) {
            let start = unknown.shape.starts.first().copied().unwrap_or(1.0);
            for (_, index) in &unknown.places {
                values[*index] = unknown.clamp(start * unknown.reference);
            }
        }
        values
    }

    /// The columns of an effect at these values.
    pub(crate) fn part(&self, bound: &AxisEffect, values: &[f64]) -> Part {
        self.part_of((bound, values), self.records.columns(bound, values))
    }

    /// The same from the columns that it has on all axes.
    fn part_of(&self, (bound, values): (&AxisEffect, &[f64]), columns: Vec<Vec<f64>>) -> Part {
        let rows = rows_of(self.records, self.axis);
        let bounds = column_bounds(bound, self.records);
        let columns = columns.iter().zip(bounds).map(|(column, bounds)| Column {
            data: Arc::new(column[rows.clone()].to_vec()),
            bounds,
        });
        Part {
            bound: *bound,
            values: values.to_vec(),
            columns: columns.collect(),
        }
    }

    /// The columns of every member; those of the base and of `known` parts are taken over.
    pub(crate) fn parts(&self, hypothesis: &Hypothesis, known: &[Part]) -> Vec<Part> {
        let members = hypothesis.members.iter().zip(&hypothesis.values);
        let members: Vec<(&AxisEffect, &[f64])> = members.map(|(b, v)| (b, v.as_slice())).collect();
        let taken_over = |(bound, values): &(&AxisEffect, &[f64])| {
            let mut all = known.iter().chain(&self.base_parts);
            all.find(|part| part.is(bound, values)).cloned()
        };
        let parts: Vec<Option<Part>> = members.iter().map(taken_over).collect();
        let news = members
            .iter()
            .zip(&parts)
            .filter(|(_, part)| part.is_none());
        let news: Vec<(&AxisEffect, &[f64])> = news.map(|(member, _)| *member).collect();
        let columns = self.records.columns_of_all(&news);
        let mut news = news
            .into_iter()
            .zip(columns)
            .map(|(new, columns)| self.part_of(new, columns));
        let parts = parts.into_iter();
        parts
            .filter_map(|part| part.or_else(|| news.next()))
            .collect()
    }

    /// The columns of parts, of which the first `base` belong to the base, and of what stands
    /// beside every hypothesis. A term of the base that an added effect replaces is held at
    /// nothing.
    pub(crate) fn columns(&self, parts: &[Part], base: usize) -> Vec<Column> {
        let mut columns: Vec<Column> = Vec::new();
        for (at, part) in parts.iter().enumerate() {
            let replaced = is_replaced(parts, base, at);
            columns.extend(part.columns.iter().cloned().map(|mut column| {
                if replaced {
                    column.bounds = [0.0; 2];
                } else if at >= base {
                    let by_size = self.scale / rms(&column.data).max(f64::MIN_POSITIVE);
                    let by_peak = self.peak / peak(&column.data).max(f64::MIN_POSITIVE);
                    let most = MAX_FORCE * by_size.min(by_peak);
                    column.bounds = [column.bounds[0].max(-most), column.bounds[1].min(most)];
                }
                column
            }));
        }
        columns.extend(self.acceleration.clone());
        let has = |names: &[&str]| {
            let mut parts = parts.iter();
            parts.any(|part| names.contains(&part.bound.entry.about.name))
        };
        for (name, column) in &self.instruments {
            let named = match *name {
                "inertia_error" => has(&["inertia_error", "force_gain"]),
                "preload" => has(&["preload"]) || !self.zeros.is_empty(),
                name => has(&[name]),
            };
            if !named {
                columns.push(column.clone());
            }
        }
        columns.extend(self.zeros.iter().cloned());
        columns
    }

    /// The tangents of shapes at these factors of the parts' columns.
    pub(crate) fn slopes(
        &self,
        parts: &[Part],
        factors: &[f64],
        unknowns: &[&ShapeUnknown],
    ) -> Vec<Vec<f64>> {
        let rows = rows_of(self.records, self.axis);
        let mut rest = factors;
        let terms = parts.iter().map(|part| {
            let (own, others) = rest.split_at(part.columns.len());
            rest = others;
            At {
                bound: &part.bound,
                values: &part.values,
                factors: own,
            }
        });
        let slopes = self.records.slopes(&terms.collect::<Vec<_>>(), unknowns);
        slopes
            .iter()
            .map(|slope| slope[rows.clone()].to_vec())
            .collect()
    }

    /// Products of columns with each other and with the measured force, over some rows; `more`
    /// stand before the force.
    pub(crate) fn products(
        &self,
        columns: &[Column],
        more: &[Vec<f64>],
        rows: Range<usize>,
    ) -> Mat<f64> {
        let count = columns.len();
        let design = Mat::from_fn(rows.len(), count + more.len() + 1, |r, c| {
            let row = rows.start + r;
            if c < count {
                columns[c].data[row]
            } else if c < count + more.len() {
                more[c - count][row]
            } else {
                self.measured[row]
            }
        });
        product(&design, &design)
    }

    /// What the tangents of the base's shapes add to a hypothesis, each held to small changes.
    pub(crate) fn tangents(
        &self,
        hypothesis: &Hypothesis,
        parts: &[Part],
        fixed: &[&ShapeUnknown],
    ) -> Vec<Column> {
        if fixed.is_empty() {
            return Vec::new();
        }
        let base = self.base_parts.iter().zip(parts);
        let mut same = base.map(|(known, part)| known.is(&part.bound, &part.values));
        if !self.base_parts.is_empty() && same.all(|same| same) {
            return self.base_tangents.clone();
        }
        let columns = self.columns(parts, hypothesis.base);
        let (factors, _) = self.factors(&columns);
        let slopes = self.slopes(parts, &factors, fixed).into_iter();
        let columns = slopes.map(|slope| Column {
            data: Arc::new(slope),
            bounds: [-SHAPES_MOVE, SHAPES_MOVE],
        });
        columns.collect()
    }

    /// The shape unknowns of a hypothesis: those of its base, and the others.
    pub(crate) fn unknowns(
        &self,
        hypothesis: &Hypothesis,
    ) -> (Vec<ShapeUnknown>, Vec<ShapeUnknown>) {
        let mut all = shapes(&hypothesis.members, &self.records.references);
        let says_nothing = |unknown: &ShapeUnknown| {
            let (member, parameter) = unknown.places[0];
            let entry = hypothesis.members[member].entry;
            self.only_direction && is_without_meaning(entry.parameters()[parameter].name)
        };
        all.retain(|unknown| !unknown.shape.is_given() && !says_nothing(unknown));
        all.into_iter()
            .partition(|u| u.places[0].0 < hypothesis.base)
    }

    /// Everything that stands beside each other in a hypothesis, its base's tangents included.
    pub(crate) fn design(&self, hypothesis: &Hypothesis, parts: &[Part]) -> Vec<Column> {
        let (of_base, _) = self.unknowns(hypothesis);
        let mut columns = self.columns(parts, hypothesis.base);
        columns.extend(self.tangents(hypothesis, parts, &of_base.iter().collect::<Vec<_>>()));
        columns
    }

    /// Factors of a design's columns on all rows, and the products that they follow from.
    pub(super) fn factors(&self, columns: &[Column]) -> (Vec<f64>, Mat<f64>) {
        let products = self.products(columns, &[], 0..self.measured.len());
        let bounds: Vec<[f64; 2]> = columns.iter().map(|c| c.bounds).collect();
        (bounded::factors(&products, &bounds), products)
    }

    /// Factors of a design's columns, and what they leave of the force.
    pub(crate) fn solved(&self, columns: &[Column]) -> (Vec<f64>, Vec<f64>) {
        let (factors, _) = self.factors(columns);
        let mut left = self.measured.to_vec();
        for (column, factor) in columns.iter().zip(&factors) {
            let pairs = left.iter_mut().zip(column.data.iter());
            pairs.for_each(|(l, c)| *l -= factor * c);
        }
        (factors, left)
    }

    /// A hypothesis with these factors of its parts' columns as its linear values.
    pub(crate) fn valued(
        &self,
        hypothesis: &Hypothesis,
        parts: &[Part],
        mut rest: &[f64],
    ) -> Hypothesis {
        let mut valued = hypothesis.clone();
        for ((part, bound), values) in parts
            .iter()
            .zip(&hypothesis.members)
            .zip(&mut valued.values)
        {
            let (mine, others) = rest.split_at(part.columns.len());
            values.clone_from(&part.values);
            self.records.put(bound, mine, values);
            rest = others;
        }
        valued
    }

    /// Whether a hypothesis is physics: every added effect has values that it can have, none stands
    /// at the edge of what was searched, and dampers of the base do not give back most of the
    /// energy that the added effects take. `factors` are those of the parts' columns.
    pub(crate) fn is_sound(
        &self,
        hypothesis: &Hypothesis,
        parts: &[Part],
        factors: &[f64],
    ) -> bool {
        let mut added = hypothesis.base..hypothesis.members.len();
        if added.any(|at| {
            let (bound, values) = (&hypothesis.members[at], &hypothesis.values[at]);
            is_at_bound(bound, values, self.records) || is_turned(hypothesis, at, self.records)
        }) {
            return false;
        }
        let given = driven(hypothesis, &self.velocity) - self.driven;
        let little =
            self.least_share * (self.power * mean_product(&self.velocity, &self.velocity)).sqrt();
        let before: usize = parts[..hypothesis.base]
            .iter()
            .map(|p| p.columns.len())
            .sum();
        let columns = parts[hypothesis.base..].iter().flat_map(|p| &p.columns);
        let taken = columns.zip(&factors[before..]);
        let taken: f64 = taken
            .map(|(c, f)| f * mean_product(&c.data, &self.velocity))
            .sum();
        given <= little.max(0.5 * taken)
    }
}
