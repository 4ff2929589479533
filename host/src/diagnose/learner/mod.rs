//! What a learner without physics can still take away from what a model leaves, on blocks that it
//! has not seen: a smooth function of the axis' own displacement and velocity, and trees on what
//! that leaves.
//!
//! Its inputs grow: the states of all axes; then memory (travel since the last reversal, where that
//! was, the swing before it, the largest excursion); then states of moments ago; then the inputs of
//! the study; then the time in the record; then which record it is. The step at which the error
//! falls is the kind of what is missing, whatever its law.

pub(super) mod smooth;

use crate::diagnose::criteria;
use crate::diagnose::search::bench::Bench;
use crate::diagnose::search::hypothesis::Column;
use crate::diagnose::search::score::NO_POWER;
use crate::fit::trees::{Binned, SIZE, Trees};
use crate::study::series::{mean, range};
use crate::text::work;
use rayon::prelude::*;
use smooth::Smooth;
use std::ops::Range;

/// Rows that the learner is taught on and judged on: every so manieth of more.
const MAX_ROWS: usize = 5000;
/// Folds on which it is asked what the remainder follows.
const FIRST_FOLDS: usize = 3;
/// How long ago the displacement and velocity are that the learner sees besides, s.
const DELAYS_S: [f64; 4] = [0.005, 0.012, 0.03, 0.06];
/// A turn of the motion is one of this part of the travel.
const TURN: f64 = 0.01;

/// What the learner knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Knows {
    States,
    Memory,
    Delays,
    Inputs,
    Time,
    Record,
}

impl Knows {
    /// Every step, in order.
    pub(super) const ALL: [Self; 6] = [
        Self::States,
        Self::Memory,
        Self::Delays,
        Self::Inputs,
        Self::Time,
        Self::Record,
    ];

    /// What the remainder follows, as it stands in answers.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::States => "states",
            Self::Memory => "memory",
            Self::Delays => "delays",
            Self::Inputs => "inputs",
            Self::Time => "time",
            Self::Record => "record",
        }
    }

    /// The same in a sentence.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::States => "displacement and velocity of the same moment",
            Self::Memory => "the way since the last reversal and the largest excursion",
            Self::Delays => "the displacements of the last moments",
            Self::Inputs => "the inputs",
            Self::Time => "the time since the record began",
            Self::Record => "the record: the joint differs from one to the next",
        }
    }
}

/// Error power of the judged blocks without and with the learner, fold after fold; beside that of
/// the force.
#[derive(Clone, Debug)]
pub(super) struct Taken {
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    /// Over the folds that deal every block once.
    pub(super) power: [f64; 2],
    /// RMS beside the RMS force that counts at least.
    pub(super) least_share: f64,
}

impl Taken {
    /// Log error power that the learner gains, block by block.
    pub(super) fn gains(&self) -> Vec<f64> {
        gains(&self.before, &self.after)
    }

    /// The same beside what another one leaves.
    pub(super) fn gains_beside(&self, other: &Self) -> Vec<f64> {
        gains(&other.after, &self.after)
    }
}

fn gains(before: &[f64], after: &[f64]) -> Vec<f64> {
    let pairs = before.iter().zip(after);
    pairs
        .map(|(before, after)| ((before + NO_POWER) / (after + NO_POWER)).ln())
        .collect()
}

/// What a design leaves, fold after fold, at the rows that the learner looks at.
pub(super) struct Left {
    each: Vec<Vec<f64>>,
    /// The same without a smooth function of the axis' own states.
    rough: Vec<Vec<f64>>,
    /// The block of each row.
    block: Vec<usize>,
}

/// Inputs of the learner on an axis, with what it knows at each step.
pub(super) struct Inputs {
    series: Vec<(Knows, Vec<f64>)>,
    step: usize,
}

impl Inputs {
    /// Reads them from the motion, and those of the study by their names.
    pub(super) fn new(bench: &Bench<'_>, axes: usize, named: &[&'static str]) -> Self {
        let records = bench.records;
        let rows = bench.measured.len();
        let step = rows.div_ceil(MAX_ROWS).max(1);
        let slice = |axis: usize, column: Vec<f64>| column[axis * rows..(axis + 1) * rows].to_vec();
        let mut series = Vec::new();
        let state = |axis: usize, moves: bool| {
            let column =
                records.of_motion(
                    axis,
                    None,
                    |m| if moves { m.velocity } else { m.displacement },
                );
            slice(axis, column)
        };
        let mut own = Vec::new();
        for axis in 0..axes {
            for moves in [false, true] {
                let column = state(axis, moves);
                if axis == bench.axis {
                    own.push(column.clone());
                }
                series.push((Knows::States, column));
            }
        }
        let [displacement, velocity] = own.as_slice() else {
            return Self { series, step };
        };
        let before = records.displacement_before(bench.axis);
        let remembered = memory(displacement, &records.rows, &before);
        series.extend(remembered.map(|column| (Knows::Memory, column)));
        for delay in DELAYS_S {
            let late = (delay * records.thinned_rate_hz).round().max(1.0) as usize;
            for column in [displacement, velocity] {
                series.push((Knows::Delays, delayed(column, &records.rows, late)));
            }
        }
        for name in named {
            let column = slice(bench.axis, records.of_input(bench.axis, name));
            series.push((Knows::Inputs, column));
        }
        let time = records.of_motion(bench.axis, None, |m| m.time_s);
        series.push((Knows::Time, slice(bench.axis, time)));
        if records.rows.len() > 1 {
            let numbered = records.rows.iter().enumerate();
            let which = numbered.flat_map(|(number, &rows)| vec![number as f64; rows]);
            series.push((Knows::Record, which.collect()));
        }
        for (_, column) in &mut series {
            *column = column.iter().copied().step_by(step).collect();
        }
        Self { series, step }
    }

    /// What a design leaves, on the same folds as hypotheses are judged on; `briefly` on some of
    /// them only.
    pub(super) fn left(&self, bench: &Bench<'_>, design: &[Column], briefly: bool) -> Left {
        let rows = bench.measured.len().div_ceil(self.step);
        let mut block = vec![0; rows];
        for (number, range) in bench.blocks.rows.iter().enumerate() {
            let from = range.start.div_ceil(self.step);
            let to = range.end.div_ceil(self.step);
            block[from..to].fill(number);
        }
        let folds = bench.judged(design).folds;
        // A function without a law says nothing where it has seen nothing: it is judged in turn
        // only.
        let count = if briefly {
            FIRST_FOLDS.min(bench.blocks.turns)
        } else {
            bench.blocks.turns
        };
        let small = small_zero(bench);
        let left: Vec<Vec<f64>> = folds[..count]
            .iter()
            .map(|factors| {
                let left = (0..rows).map(|row| {
                    let row = row * self.step;
                    let columns = design.iter().zip(factors);
                    bench.measured[row] - columns.map(|(c, f)| f * c.data[row]).sum::<f64>()
                });
                self.without_small_zeros(left.collect(), records(bench), small)
            })
            .collect();
        Left {
            rough: self.without_smooth(bench, &left, &block),
            each: left,
            block,
        }
    }

    /// A series without the mean of every part, such as a record, in which that is `small`, as a
    /// data sheet allows a zero of force: noise that grows with one over the frequency makes such
    /// zeros, and the learner would find them. The parts are rows before every so manieth is taken.
    fn without_small_zeros(
        &self,
        mut left: Vec<f64>,
        parts: impl Iterator<Item = Range<usize>>,
        small: f64,
    ) -> Vec<f64> {
        for part in parts {
            let own = &mut left[part.start.div_ceil(self.step)..part.end.div_ceil(self.step)];
            let mean = mean(own);
            if mean.abs() <= small {
                own.iter_mut().for_each(|value| *value -= mean);
            }
        }
        left
    }

    /// The same without zeros that wander from block to block within what a data sheet allows.
    pub(super) fn steady(&self, bench: &Bench<'_>, left: &Left) -> Left {
        let small = small_zero(bench);
        let blocks = || bench.blocks.rows.iter().cloned();
        let each = left.each.iter().cloned();
        let each = each.map(|left| self.without_small_zeros(left, blocks(), small));
        let each: Vec<Vec<f64>> = each.collect();
        Left {
            rough: self.without_smooth(bench, &each, &left.block),
            each,
            block: left.block.clone(),
        }
    }

    /// Teaches the learner what a design leaves.
    pub(super) fn taken(&self, bench: &Bench<'_>, of: &Left, knows: Knows) -> Taken {
        self.taken_by(bench, of, |step| step <= knows)
    }

    /// The same for one that knows the inputs of some steps.
    pub(super) fn taken_by(
        &self,
        bench: &Bench<'_>,
        of: &Left,
        knows: impl Fn(Knows) -> bool,
    ) -> Taken {
        let known: Vec<Vec<f64>> = self
            .series
            .iter()
            .filter(|(step, _)| knows(*step))
            .map(|(_, column)| column.clone())
            .collect();
        let inputs = Binned::new(&known);
        let (block, rows) = (&of.block, of.block.len());
        let judged: Vec<Vec<[f64; 2]>> = (0..of.each.len())
            .into_par_iter()
            .map(|at| {
                work::step();
                let fold = &bench.blocks.folds[at];
                let (left, rough) = (&of.each[at], &of.rough[at]);
                let taught = (0..rows as u32).filter(|&r| !fold.contains(&block[r as usize]));
                let trees = Trees::teach(&inputs, rough, &taught.collect::<Vec<_>>(), SIZE);
                let of_block = |number: &usize| {
                    let mut sums = [0.0; 2];
                    let mut own = 0.0_f64;
                    for row in (0..rows).filter(|&row| block[row] == *number) {
                        sums[0] += left[row].powi(2);
                        sums[1] += (rough[row] - trees.at(&inputs, row)).powi(2);
                        own += 1.0;
                    }
                    sums.map(|sum| sum / own.max(1.0) / bench.power)
                };
                fold.iter().map(of_block).collect()
            })
            .collect();
        let mut power = [0.0; 2];
        let all = bench.measured.len() as f64;
        for (fold, errors) in bench.blocks.folds.iter().zip(&judged) {
            for (block, errors) in fold.iter().zip(errors) {
                let share = bench.blocks.rows[*block].len() as f64 / all;
                power
                    .iter_mut()
                    .zip(errors)
                    .for_each(|(p, e)| *p += share * e);
            }
        }
        let errors = |place: usize| judged.iter().flatten().map(|e| e[place]).collect();
        Taken {
            before: errors(0),
            after: errors(1),
            power,
            least_share: bench.least_share,
        }
    }

    /// What a smooth function of the axis' own states leaves in each fold, where such a function
    /// helps on the blocks that it has not seen.
    fn without_smooth(
        &self,
        bench: &Bench<'_>,
        left: &[Vec<f64>],
        block: &[usize],
    ) -> Vec<Vec<f64>> {
        let states = 2 * bench.axis;
        let own = |place: usize| self.series[states + place].1.as_slice();
        let smooth = Smooth::new([own(0), own(1)], block, bench.blocks.rows.len());
        let each: Vec<Vec<Vec<f64>>> = left
            .par_iter()
            .enumerate()
            .map(|(at, left)| smooth.taught(left, block, &bench.blocks.folds[at]))
            .collect();
        let unseen = |at: usize, rough: &dyn Fn(usize) -> f64| {
            let rows = (0..block.len()).filter(|row| bench.blocks.folds[at].contains(&block[*row]));
            rows.map(|row| rough(row).powi(2)).sum::<f64>()
        };
        let none: f64 = (0..left.len())
            .map(|at| unseen(at, &|row| left[at][row]))
            .sum();
        let prices = each.first().map_or(0, Vec::len);
        let error = |price: usize| -> f64 {
            let folds = 0..left.len();
            folds
                .map(|at| unseen(at, &|row| left[at][row] - each[at][price][row]))
                .sum()
        };
        let best = (0..prices)
            .map(|price| (price, error(price)))
            .filter(|(_, error)| *error < none)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((price, _)) = best else {
            return left.to_vec();
        };
        let folds = left.iter().zip(each);
        folds
            .map(|(left, mut each)| {
                let taught = each.swap_remove(price);
                left.iter().zip(taught).map(|(l, t)| l - t).collect()
            })
            .collect()
    }
}

/// A zero of force as a data sheet allows it, N or N·m.
fn small_zero(bench: &Bench<'_>) -> f64 {
    criteria::ZERO * bench.records.applied_rms(bench.axis)
}

/// The rows of every record.
fn records<'a>(bench: &'a Bench<'_>) -> impl Iterator<Item = Range<usize>> + 'a {
    let mut end = 0;
    bench.records.rows.iter().map(move |rows| {
        end += rows;
        end - rows..end
    })
}

/// Way since the last reversal, where it was, the swing before it, and the largest excursion so
/// far, record by record, each after what is known of the motion before it.
fn memory(displacement: &[f64], records: &[usize], before: &[&[f64]]) -> [Vec<f64>; 4] {
    let mut out: [Vec<f64>; 4] = Default::default();
    let turn = TURN * range(displacement);
    let mut start = 0;
    for (&count, known) in records.iter().zip(before) {
        let part = &displacement[start..start + count];
        let first = known.iter().chain(part).next().copied().unwrap_or(0.0);
        let (mut last, mut before, mut extreme) = (first, first, first);
        let (mut direction, mut largest) = (1.0, 0.0_f64);
        let rows = known.iter().chain(part).enumerate();
        for (row, &x) in rows {
            if direction * (x - extreme) > 0.0 {
                extreme = x;
            } else if direction * (extreme - x) > turn {
                (before, last, extreme) = (last, extreme, x);
                direction = -direction;
            }
            largest = largest.max(x.abs());
            if row < known.len() {
                continue;
            }
            let row = [x - last, last, last - before, largest];
            out.iter_mut()
                .zip(row)
                .for_each(|(column, value)| column.push(value));
        }
        start += count;
    }
    out
}

/// A column so many rows late, record by record.
fn delayed(column: &[f64], records: &[usize], late: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(column.len());
    let mut start = 0;
    for &count in records {
        let part = &column[start..start + count];
        out.extend((0..count).map(|row| part[row.saturating_sub(late)]));
        start += count;
    }
    out
}
