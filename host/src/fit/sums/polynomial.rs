//! The sums that a polynomial is made of: products of powers of the states with each other and with
//! the restoring force, per block of the cross-validation.

use super::exact::Exact;
use super::plan::Plan;
use super::products::{FLUSHED, LANES, Rows, add_products, with_products};
use crate::fit::cross_validation::{FOLDS, Folds, edges, guard_rows};
use crate::fit::moments::Moments;
use crate::model::InputRange;
use crate::model::powers::{PAIRS, powers};
use crate::signal::motion::Motion;
use crate::text::error::Result;

/// Parts of a record that are summed apart: the blocks of the cross-validation with their two
/// edges.
pub(super) const PARTS: usize = 3 * FOLDS;
/// Rows whose products are made at a time, so that they stay in the second-level cache.
const BLOCK: usize = 128;

/// Sizes of the sums for one axis or two.
#[derive(Clone, Copy)]
struct Sizes {
    /// Products of powers up to 6 of the first half of the inputs; of the second half there are as
    /// many.
    powers: usize,
    /// The same up to 3.
    low: usize,
    outputs: usize,
}

impl Sizes {
    fn of(axes: usize) -> Self {
        let exponent = axes as u32;
        Self {
            powers: 7_usize.pow(exponent),
            low: 4_usize.pow(exponent),
            outputs: axes,
        }
    }

    /// Exact sums of one part.
    fn count(self) -> usize {
        self.powers * self.powers + self.outputs * (self.low * self.low + 1)
    }

    /// Numbers in a row of the left side: the products, then the low ones times each output.
    fn left(self) -> usize {
        self.powers + self.outputs * self.low
    }

    /// Numbers in a row of the right side, padded.
    fn right(self) -> usize {
        self.powers.next_multiple_of(LANES)
    }

    /// Where the product at a place of the right side stands among those of the left side, whose
    /// last exponent runs fastest.
    fn column(self, place: usize) -> usize {
        if self.outputs == 1 {
            place
        } else {
            7 * PAIRS[place].0 + PAIRS[place].1
        }
    }
}

/// How many sums a part of a study of so many axes has.
pub(super) fn count(axes: usize) -> usize {
    Sizes::of(axes).count()
}

/// Sums rows in floating point, and hands them on.
struct Summation {
    sizes: Sizes,
    left: Vec<f64>,
    right: Vec<f64>,
    sums: Vec<f64>,
    squares: Vec<f64>,
}

impl Summation {
    fn new(sizes: Sizes) -> Self {
        Self {
            sizes,
            left: vec![0.0; BLOCK * sizes.left()],
            right: vec![0.0; BLOCK * sizes.right()],
            sums: vec![0.0; sizes.left() * sizes.right()],
            squares: vec![0.0; sizes.outputs],
        }
    }

    /// Adds rows of normalised inputs and outputs.
    fn add(&mut self, inputs: &[&[f64]], outputs: &[&[f64]]) {
        let (sizes, rows) = (self.sizes, inputs[0].len());
        let lefts = self.left.chunks_exact_mut(sizes.left());
        let rights = self.right.chunks_exact_mut(sizes.right());
        for (row, (left, right)) in lefts.zip(rights).enumerate().take(rows) {
            fill(
                sizes,
                left,
                right,
                |input| inputs[input][row],
                |output| outputs[output][row],
            );
        }
        let left = Rows {
            values: &self.left[..rows * sizes.left()],
            width: sizes.left(),
        };
        let right = Rows {
            values: &self.right[..rows * sizes.right()],
            width: sizes.right(),
        };
        let low = sizes.low.next_multiple_of(LANES);
        add_products(
            left,
            0..sizes.powers,
            right,
            sizes.right(),
            (&mut self.sums, sizes.right()),
        );
        add_products(
            left,
            sizes.powers..sizes.left(),
            right,
            low,
            (&mut self.sums, sizes.right()),
        );
        for (square, output) in self.squares.iter_mut().zip(outputs) {
            [*square] = with_products([*square], [(output, output)]);
        }
    }

    /// Empties the sums into exact ones.
    fn flush(&mut self, exact: &mut Exact) -> Result<()> {
        let (sizes, width) = (self.sizes, self.sizes.right());
        let mut at = 0;
        let mut put = |value: f64| {
            exact.add(at, value)?;
            at += 1;
            Ok(())
        };
        for row in 0..sizes.left() {
            let columns = if row < sizes.powers {
                sizes.powers
            } else {
                sizes.low
            };
            self.sums[row * width..][..columns]
                .iter()
                .try_for_each(|sum| put(*sum))?;
        }
        self.squares.iter().try_for_each(|square| put(*square))?;
        self.sums.fill(0.0);
        self.squares.fill(0.0);
        Ok(())
    }
}

/// One row of both sides.
#[inline]
fn fill(
    sizes: Sizes,
    left: &mut [f64],
    right: &mut [f64],
    input: impl Fn(usize) -> f64,
    output: impl Fn(usize) -> f64,
) {
    let (plain, weighted) = left.split_at_mut(sizes.powers);
    let weighted = weighted.chunks_exact_mut(sizes.low);
    if sizes.outputs == 1 {
        let u = powers(input(0));
        plain.copy_from_slice(&u);
        right[..7].copy_from_slice(&powers(input(1)));
        for weighted in weighted {
            let y = output(0);
            weighted
                .iter_mut()
                .zip(u)
                .for_each(|(place, u)| *place = u * y);
        }
        return;
    }
    let [u, v, s, t] = [0, 1, 2, 3].map(|i| powers(input(i)));
    for (row, u) in plain.as_chunks_mut::<7>().0.iter_mut().zip(u) {
        *row = v.map(|v| u * v);
    }
    for (place, (c, d)) in right.iter_mut().zip(PAIRS) {
        *place = s[c] * t[d];
    }
    for (index, weighted) in weighted.enumerate() {
        let y = output(index);
        for (row, u) in weighted.as_chunks_mut::<4>().0.iter_mut().zip(u) {
            let weight = u * y;
            *row = [weight * v[0], weight * v[1], weight * v[2], weight * v[3]];
        }
    }
}

/// Adds a motion to the sums of a plan's parts; `rows` counts theirs.
pub(super) fn add(
    plan: &Plan,
    motion: &Motion,
    parts: &mut [Exact],
    rows: &mut [u64],
) -> Result<()> {
    let normalise = |(range, series): (&InputRange, &Vec<f64>)| -> Vec<f64> {
        let inverse = 1.0 / range.half_range;
        series
            .iter()
            .map(|v| (v - range.center) * inverse)
            .collect()
    };
    let inputs: Vec<Vec<f64>> = plan
        .inputs
        .iter()
        .zip(&motion.states)
        .map(normalise)
        .collect();
    let axes = plan.axes.iter().zip(&plan.scales).enumerate();
    let outputs = axes.map(|(index, (axis, scales))| {
        let scale = 2f64.powi(-scales[0]);
        let inertia = axis.inertia.unwrap_or(0.0);
        let mut force = motion.restoring_force(index, inertia, axis.restoring_force);
        force.iter_mut().for_each(|r| *r *= scale);
        force
    });
    let outputs: Vec<Vec<f64>> = outputs.collect();
    let mut summation = Summation::new(Sizes::of(plan.axes.len()));
    let guard = guard_rows(plan.filters.sample_rate_hz, &plan.filters.band);
    for fold in 0..FOLDS {
        for (place, edge) in edges(fold, motion.rows(), guard).windows(2).enumerate() {
            let part = 3 * fold + place;
            for from in (edge[0]..edge[1]).step_by(FLUSHED) {
                let end = (from + FLUSHED).min(edge[1]);
                for start in (from..end).step_by(BLOCK) {
                    let to = (start + BLOCK).min(end);
                    let inputs: Vec<&[f64]> = inputs.iter().map(|s| &s[start..to]).collect();
                    let outputs: Vec<&[f64]> = outputs.iter().map(|s| &s[start..to]).collect();
                    summation.add(&inputs, &outputs);
                }
                summation.flush(&mut parts[part])?;
            }
            rows[part] += (edge[1] - edge[0]) as u64;
        }
    }
    Ok(())
}

/// The moments of all parts, for inputs normalised by `ranges` in place of the plan's.
pub(super) fn folds(plan: &Plan, parts: &[Exact], rows: &[u64], ranges: &[InputRange]) -> Folds {
    let moments: Vec<Moments> = parts
        .iter()
        .zip(rows)
        .map(|(part, rows)| moments(plan, part, *rows, ranges))
        .collect();
    let mut moments = moments.into_iter();
    let mut next = || {
        moments
            .next()
            .unwrap_or_else(|| unreachable!("a part of three per fold"))
    };
    Folds::of_parts(
        (0..FOLDS)
            .map(|_| std::array::from_fn(|_| next()))
            .collect(),
    )
}

fn moments(plan: &Plan, part: &Exact, rows: u64, ranges: &[InputRange]) -> Moments {
    let sizes = Sizes::of(plan.axes.len());
    let squared = sizes.powers * sizes.powers;
    let low = sizes.low * sizes.low;
    // From the order of the sums to that of the exponents, the last input's running fastest.
    let mut power = vec![0.0; squared];
    for left in 0..sizes.powers {
        for place in 0..sizes.powers {
            power[left * sizes.powers + sizes.column(place)] =
                part.value(left * sizes.powers + place);
        }
    }
    let mut cross: Vec<Vec<f64>> = plan
        .scales
        .iter()
        .enumerate()
        .map(|(output, scales)| {
            let scale = 2f64.powi(scales[0]);
            (0..low)
                .map(|i| scale * part.value(squared + output * low + i))
                .collect()
        })
        .collect();
    for (input, (from, to)) in plan.inputs.iter().zip(ranges).enumerate() {
        renormalise(&mut power, 7, (plan.inputs.len(), input), (from, to));
        for cross in &mut cross {
            renormalise(cross, 4, (plan.inputs.len(), input), (from, to));
        }
    }
    let squares = squared + sizes.outputs * low;
    let place = |e: [usize; 4], side: usize| {
        let inputs = plan.inputs.len();
        e[..inputs].iter().fold(0, |place, e| side * place + e)
    };
    Moments::of_sums(
        plan.inputs.len(),
        sizes.outputs,
        rows as usize,
        |e| power[place(e, 7)],
        |output, e| cross[output][place(e, 4)],
        |output| 4f64.powi(plan.scales[output][0]) * part.value(squares + output),
    )
}

/// Turns sums of powers u^p of one input, p up to `side` − 1, into those of u' = (u·h + c − c')/h'
/// by the binomial theorem.
fn renormalise(
    sums: &mut [f64],
    side: usize,
    (inputs, input): (usize, usize),
    (from, to): (&InputRange, &InputRange),
) {
    if from == to {
        return;
    }
    let factor = from.half_range / to.half_range;
    let shift = (from.center - to.center) / to.half_range;
    let stride = side.pow((inputs - 1 - input) as u32);
    for block in sums.chunks_exact_mut(side * stride) {
        for offset in 0..stride {
            // From the highest power down, so that those that it needs are still the old ones.
            for p in (0..side).rev() {
                let mut binomial = 1.0;
                let mut sum = 0.0;
                for q in (0..=p).rev() {
                    // Here p choose q.
                    let weight = binomial * factor.powi(q as i32) * shift.powi((p - q) as i32);
                    sum += weight * block[q * stride + offset];
                    binomial *= q as f64 / (p - q + 1) as f64;
                }
                block[p * stride + offset] = sum;
            }
        }
    }
}
