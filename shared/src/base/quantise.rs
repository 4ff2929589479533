//! From a polynomial in newtons to one in integers: the scale of each axis, the stored words, and
//! the bound of the error.
//!
//! The scales are any real numbers, so each is set to the largest value at which no stored word, no
//! row, no block and no sum of blocks can leave its integer: the tightest of these is met with a
//! margin of 2⁻²², where powers of two would lose up to one bit. `docs/explanation/numerics.md`
//! derives the conditions and the terms of the error bound.

use super::axis::MAGNITUDE;
use super::header::Output;
use super::polynomial::{BLOCKS, Block, MAX_OUTPUT_SHIFT, PolynomialModel};
use crate::fault::Error;
use crate::scalar::fixed::round_to_i64;
use heapless::Vec;

/// 2³¹: one more than the largest word.
const RAIL: f64 = 2_147_483_648.0;
/// What a word, a row or a block may reach before roundings, which add at most 8.4 to a block.
const BLOCK_LIMIT: f64 = RAIL - 512.0;
/// What the sum of the blocks may reach per unit of 2^shift; 16 blocks add at most 135 by rounding,
/// and the weights of 2²⁹ add at most 16·4.
const TOTAL_LIMIT: f64 = RAIL - 256.0;
/// The largest gain. Gains are multiples of 4, so that the product with the monomial 1 is exact.
const MAX_GAIN: i32 = i32::MAX - 3;

/// The coefficients of one axis in the order in which words are stored.
type Coefficients = [[f64; 16]; BLOCKS];

impl PolynomialModel {
    /// Brings coefficients in N or N·m to fixed point, and says what one unit of each output is and
    /// how far off it may be.
    ///
    /// `orders` has two entries per axis, 0 to 3 each, and of one axis a third for the input that
    /// it follows, if any; `coefficients` has one slice per axis of (m+1)(n+1)(o+1)(p+1) values
    /// for inputs normalised to ±1, the last input's exponent running fastest. An axis
    /// whose coefficients are all 0 gets the unit 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the number of axes or an order, [`Error::CoefficientCount`], and
    /// [`Error::Coefficient`] for the first that is not a number, is larger than 1e60, or, when all
    /// others are smaller still, is smaller than 1e-50.
    pub fn quantise(
        orders: &[u8],
        coefficients: &[&[f64]],
    ) -> Result<(Self, Vec<Output, 2>), Error> {
        let axes = coefficients.len();
        Error::unless_within("number of axes", axes as f64, 1.0, 2.0)?;
        let (states, most) = (2 * axes, 2 + axes);
        Error::unless_within(
            "number of orders (two per axis)",
            orders.len() as f64,
            states as f64,
            most as f64,
        )?;
        let mut model = Self {
            orders: [0; 4],
            axes: axes as u8,
            shifts: [0; 2],
            blocks: [[Block::EMPTY; BLOCKS]; 2],
        };
        for (stored, &order) in model.orders.iter_mut().zip(orders) {
            Error::unless_within("order of the polynomial", f64::from(order), 0.0, 3.0)?;
            *stored = order;
        }
        let mut outputs = Vec::new();
        for (axis, values) in coefficients.iter().enumerate() {
            let output = model.set_axis(axis, values)?;
            // The capacity is two and there are at most two axes.
            let _ = outputs.push(output);
        }
        model.check()?;
        Ok((model, outputs))
    }

    /// Stores the words and the shift of one axis.
    fn set_axis(&mut self, axis: usize, values: &[f64]) -> Result<Output, Error> {
        let coefficients = self.place(axis, values)?;
        let total: f64 = coefficients.as_flattened().iter().map(|c| c.abs()).sum();
        if total < 1e-50 {
            let (exponents, seen) = largest(self.orders, values);
            if seen != 0.0 {
                return Err(Error::Coefficient {
                    axis: axis as u8,
                    exponents,
                    seen,
                });
            }
        }
        let limits = coefficients.map(|block| largest_scale(&block));
        let alone = !self.sums_blocks();
        let common = common_scale(&limits, total, alone);
        let mut shift = 0_u8;
        while total * common > TOTAL_LIMIT * f64::from(1_u8 << shift) && shift < MAX_OUTPUT_SHIFT {
            shift += 1;
        }
        let mut coefficient_error = 0.0;
        let blocks = self.blocks.get_mut(axis).into_iter().flatten();
        for (block, (&limit, values)) in blocks.zip(limits.iter().zip(&coefficients)) {
            let scale = if alone {
                common
            } else {
                block.gain = gain(common / limit);
                if block.gain == 0 {
                    continue;
                }
                common * RAIL / f64::from(block.gain)
            };
            for (place, (word, &coefficient)) in block.words.iter_mut().zip(values).enumerate() {
                let scale = scale * factor(place);
                // The scale keeps every word 500 units away from the rails.
                *word = round_to_i64(coefficient * scale) as i32;
                coefficient_error += (coefficient - f64::from(*word) / scale).abs();
            }
        }
        if let Some(place) = self.shifts.get_mut(axis) {
            *place = shift;
        }
        let force_per_lsb = f64::from(1_u8 << shift) / common;
        Ok(Output {
            force_per_lsb,
            error_bound: coefficient_error + self.error_bound_lsb(axis) * force_per_lsb,
        })
    }

    /// Puts the values of one axis where their words will be stored.
    fn place(&self, axis: usize, values: &[f64]) -> Result<Coefficients, Error> {
        let wanted = self.orders.iter().map(|&o| usize::from(o) + 1).product();
        if values.len() != wanted {
            return Err(Error::CoefficientCount {
                axis: axis as u8,
                seen: values.len(),
                wanted,
            });
        }
        let mut blocks = [[0.0; 16]; BLOCKS];
        for (exponents, &seen) in terms(self.orders).zip(values) {
            if seen.is_nan() || seen.abs() > MAGNITUDE {
                return Err(Error::Coefficient {
                    axis: axis as u8,
                    exponents,
                    seen,
                });
            }
            let [i, j, k, l] = exponents.map(usize::from);
            let (block, word) = if self.axes == 1 {
                (4 * k + l, 4 * i + j)
            } else {
                (4 * i + j, 4 * k + l)
            };
            if let Some(place) = blocks.get_mut(block).and_then(|b| b.get_mut(word)) {
                *place = seen;
            }
        }
        Ok(blocks)
    }

    /// The largest difference between an output and the real polynomial of the stored words, in
    /// units of the output.
    ///
    /// It holds for every real input in [−1, 1], rounded to Q31 on the way in. The causes: a power
    /// of degree n is off by at most n·2⁻³¹, of which the largest part is 1.0 becoming 1 −
    /// 2⁻³¹; a monomial of the outer inputs by 2⁻³¹ more, and by 2⁻³⁰ of the largest weight
    /// after the gain; every product of a word or row that is not 0 is rounded by at
    /// most half a unit; and so is the output. The rounding of the coefficients to words is not in
    /// it; [`Output::error_bound`] has both.
    pub fn error_bound_lsb(&self, axis: usize) -> f64 {
        let mut bound = 0.0;
        for (number, block) in self.blocks.get(axis).into_iter().flatten().enumerate() {
            let gain = if self.sums_blocks() {
                f64::from(block.gain) / RAIL
            } else {
                1.0
            };
            let mut error = block_rounding(&block.words);
            for (place, &word) in block.words.iter().enumerate() {
                // Both 0 for the monomial 1, which is exact, and for one block alone, which has no
                // monomials.
                let (outer, weight) = if number > 0 { (1.0, 2.0) } else { (0.0, 0.0) };
                let degree = self.exponents(number, place).iter().sum::<u8>();
                let value = f64::from(word.unsigned_abs()) / factor(place);
                if word != 0 {
                    error += value * (f64::from(degree) + outer + weight / gain) / RAIL;
                }
            }
            bound += error * gain;
        }
        let unit = f64::from(1_u8 << self.shifts.get(axis).copied().unwrap_or(0));
        let output = if self.sums_blocks() { 0.5 } else { 0.0 };
        // Products of two errors are below 2⁻²⁷ of the errors themselves.
        bound * (1.0 + 1e-7) / unit + output
    }
}

/// By how much the scale of a stored word is above that of its block: 1 for k = l = 0, 2 when one
/// of them is 0, else 4.
fn factor(word: usize) -> f64 {
    match (word / 4, word % 4) {
        (0, 0) => 1.0,
        (0, _) | (_, 0) => 2.0,
        _ => 4.0,
    }
}

/// The largest error of one block sum by rounding, in its own units: half a unit per product that
/// is not 0.
fn block_rounding(words: &[i32; 16]) -> f64 {
    let (rows, _) = words.as_chunks::<4>();
    let mut error = 0.0;
    for (k, row) in rows.iter().enumerate() {
        let [first, products @ ..] = row;
        let row_error = 0.5 * products.iter().filter(|&&word| word != 0).count() as f64;
        if k == 0 {
            error += row_error;
        } else if *first != 0 || row_error > 0.0 {
            error += 0.5 * row_error + 0.5;
        }
    }
    error
}

/// The largest scale A that keeps every word, every row and the sum of a block in 32 bits; infinite
/// for a block of zeros.
fn largest_scale(block: &[f64; 16]) -> f64 {
    // Each demand is what would stand in its integer for A = 1, so A is the limit over the largest
    // of them.
    let mut demand = 0.0_f64;
    let mut sum = 0.0;
    let (rows, _) = block.as_chunks::<4>();
    for (k, row) in rows.iter().enumerate() {
        let row_sum: f64 = row.iter().map(|c| c.abs()).sum();
        demand = demand.max(if k == 0 { row_sum } else { 2.0 * row_sum });
        sum += row_sum;
    }
    for (place, coefficient) in block.iter().enumerate() {
        demand = demand.max(coefficient.abs() * factor(place));
    }
    BLOCK_LIMIT / demand.max(sum)
}

/// The largest scale G of an axis: no block's scale times a gain below 1 is less, and the 64-bit
/// sum cannot overflow.
fn common_scale(limits: &[f64; BLOCKS], total: f64, alone: bool) -> f64 {
    let smallest = limits.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    if total == 0.0 {
        1.0
    } else if alone {
        smallest
    } else {
        let of_sum = BLOCK_LIMIT * f64::from(1_u8 << MAX_OUTPUT_SHIFT) / total;
        (smallest * (f64::from(MAX_GAIN) / RAIL)).min(of_sum)
    }
}

/// The gain of a block that could do with `least`, a number from 0 to 1: the geometric mean of that
/// and 1.
///
/// With the least gain the block uses all 32 bits and its roundings hardly count, but the rounding
/// of its weight does, in proportion to least/gain; with the gain 1 it is the other way round. The
/// geometric mean makes both equal and small.
fn gain(least: f64) -> i32 {
    let product = (least * RAIL) as u64 * (1 << 31);
    if least == 0.0 {
        return 0;
    }
    // One more than the root, up to the next multiple of 4.
    ((product.isqrt() as u32 | 3) + 1).min(MAX_GAIN as u32) as i32
}

/// The exponents and the value of the largest coefficient.
pub(crate) fn largest(orders: [u8; 4], values: &[f64]) -> ([u8; 4], f64) {
    let mut found = ([0; 4], 0.0_f64);
    for (exponents, &value) in terms(orders).zip(values) {
        if value.abs() > found.1.abs() {
            found = (exponents, value);
        }
    }
    found
}

/// The exponents of all terms up to `orders`, the last input's running fastest.
fn terms(orders: [u8; 4]) -> impl Iterator<Item = [u8; 4]> {
    let [m, n, o, p] = orders;
    (0..=m).flat_map(move |i| {
        (0..=n).flat_map(move |j| (0..=o).flat_map(move |k| (0..=p).map(move |l| [i, j, k, l])))
    })
}
