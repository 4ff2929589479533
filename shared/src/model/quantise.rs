//! From a polynomial in newtons to one in integers: the scale of each axis, the stored words, and the bound of the error.
//!
//! The scale S of an axis is any real number, so it is set to the largest value at which no stored word, no row, no
//! block and no sum of blocks can leave its integer: the tightest of these is met with a margin of 2⁻²², where powers of
//! two would lose up to one bit. `docs/numerics.md` derives the conditions and the terms of the error bound.

use super::Output;
use super::axis::MAGNITUDE;
use super::polynomial::{BLOCKS, Block, MAX_OUTPUT_SHIFT, PolynomialModel};
use crate::error::Error;
use crate::fixed::round_to_i64;
use heapless::Vec;

/// 2³¹.
const RAIL: f64 = 2_147_483_648.0;
/// What a row, a block or a stored word may reach in the scaled `f64` model; roundings add at most 8.4 to a block.
const BLOCK_LIMIT: f64 = RAIL - 512.0;
/// What the sum of the blocks may reach per unit of 2^shift; 16 blocks add at most 135 by rounding.
const TOTAL_LIMIT: f64 = RAIL - 256.0;

/// The coefficients of one axis in the order in which words are stored.
type Blocks = [[f64; 16]; BLOCKS];

impl PolynomialModel {
    /// Brings coefficients in N or N·m to fixed point, and says what one unit of each output is and how far off it may be.
    ///
    /// `orders` has two entries per axis, 0 to 3 each; `coefficients` has one slice per axis of
    /// (m+1)(n+1)(o+1)(p+1) values for inputs normalised to ±1, the last input's exponent running fastest. An axis
    /// whose coefficients are all 0 gets the unit 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the number of axes or an order, [`Error::CoefficientCount`], and
    /// [`Error::Coefficient`] for the first that is not a number, is larger than 1e60, or, when all others are
    /// smaller still, is smaller than 1e-50.
    pub fn quantise(
        orders: &[u8],
        coefficients: &[&[f64]],
    ) -> Result<(Self, Vec<Output, 2>), Error> {
        let axes = coefficients.len();
        Error::unless_within("number of axes", axes as f64, 1.0, 2.0)?;
        let inputs = 2.0 * axes as f64;
        Error::unless_within(
            "number of orders (two per axis)",
            orders.len() as f64,
            inputs,
            inputs,
        )?;
        let mut model = Self {
            orders: [0; 4],
            axes: axes as u8,
            shifts: [0; 2],
            blocks: [[[0; 16]; 2]; BLOCKS],
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
        let blocks = self.place(axis, values)?;
        let scale = match largest_scale(&blocks) {
            Some(scale) => scale,
            None => {
                let (exponents, seen) = largest(self.orders, values);
                if seen != 0.0 {
                    return Err(Error::Coefficient {
                        axis: axis as u8,
                        exponents,
                        seen,
                    });
                }
                4.0
            }
        };
        let total = blocks.as_flattened().iter().map(|c| c.abs()).sum::<f64>() * scale / 4.0;
        let mut shift = 0_u8;
        while shift < MAX_OUTPUT_SHIFT && total > TOTAL_LIMIT * f64::from(1_u8 << shift) {
            shift += 1;
        }
        if let Some(place) = self.shifts.get_mut(axis) {
            *place = shift;
        }
        let mut coefficient_error = 0.0;
        for (pair, block) in self.blocks.iter_mut().zip(&blocks) {
            for (word_number, &coefficient) in block.iter().enumerate() {
                let word_scale = scale / divisor(word_number);
                // The scale keeps every word 500 units away from the rails.
                let word = round_to_i64(coefficient * word_scale) as i32;
                coefficient_error += (coefficient - f64::from(word) / word_scale).abs();
                if let Some(place) = pair.get_mut(axis).and_then(|b| b.get_mut(word_number)) {
                    *place = word;
                }
            }
        }
        let force_per_lsb = f64::from(4_u8 << shift) / scale;
        Ok(Output {
            force_per_lsb,
            error_bound: coefficient_error + self.error_bound_lsb(axis) * force_per_lsb,
        })
    }

    /// Puts the values of one axis where their words will be stored.
    fn place(&self, axis: usize, values: &[f64]) -> Result<Blocks, Error> {
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
                (0, 4 * i + j)
            } else {
                (4 * i + j, 4 * k + l)
            };
            if let Some(place) = blocks.get_mut(block).and_then(|b| b.get_mut(word)) {
                *place = seen;
            }
        }
        Ok(blocks)
    }

    /// The largest difference between an output and the real polynomial of the stored words, in units of the output.
    ///
    /// It holds for every real input in [−1, 1], rounded to Q31 on the way in. Three causes: a power of degree n is off by at
    /// most n·2⁻³¹, of which the largest part is 1.0 becoming 1 − 2⁻³¹, and a monomial of the outer inputs by 2⁻³¹
    /// more; every product of a word or row that is not 0 is rounded by at most half a unit; and so is the output. The
    /// rounding of the coefficients to words is not in it; [`Output::error_bound`] has both.
    pub fn error_bound_lsb(&self, axis: usize) -> f64 {
        let mut powers = 0.0;
        let mut roundings = 0.0;
        for (number, pair) in self.blocks.iter().enumerate() {
            let Some(block) = pair.get(axis) else {
                continue;
            };
            for (place, &word) in block.iter().enumerate() {
                let [i, j, k, l] = self.exponents(number, place);
                let outer = if number > 0 { 1 } else { 0 };
                powers += f64::from(i + j + k + l + outer) / RAIL
                    * (f64::from(word.unsigned_abs()) * divisor(place) / 4.0);
            }
            roundings += block_rounding(block);
        }
        let unit = f64::from(1_u8 << self.shifts.get(axis).copied().unwrap_or(0));
        let output = if self.axes == 1 { 0.0 } else { 0.5 };
        // Products of two errors are below 2⁻²⁷ of the errors themselves.
        (powers + roundings) * (1.0 + 1e-7) / unit + output
    }
}

/// By how much the scale of a stored word is below S: 4 for k = l = 0, 2 when one of them is 0, else 1.
fn divisor(word: usize) -> f64 {
    match (word / 4, word % 4) {
        (0, 0) => 4.0,
        (0, _) | (_, 0) => 2.0,
        _ => 1.0,
    }
}

/// The largest error of one block sum by rounding, in its own units: half a unit per product that is not 0.
fn block_rounding(block: &Block) -> f64 {
    let (rows, _) = block.as_chunks::<4>();
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

/// The largest S that keeps every word, row, block and sum of blocks in its integer; `None` when all are too small.
fn largest_scale(blocks: &Blocks) -> Option<f64> {
    // Each demand is what would stand in its integer for S = 1, so S is the limit over the largest of them.
    let mut demand = 0.0_f64;
    let mut total = 0.0;
    for block in blocks {
        let (rows, _) = block.as_chunks::<4>();
        let mut sum = 0.0;
        for (k, row) in rows.iter().enumerate() {
            let row_sum: f64 = row.iter().map(|c| c.abs()).sum();
            demand = demand.max(row_sum / if k == 0 { 4.0 } else { 2.0 });
            sum += row_sum;
        }
        for (word, &coefficient) in block.iter().enumerate() {
            demand = demand.max(coefficient.abs() / divisor(word));
        }
        demand = demand.max(sum / 4.0);
        total += sum;
    }
    let of_all_blocks = total / 4.0 / f64::from(1_u8 << MAX_OUTPUT_SHIFT);
    let scale = (BLOCK_LIMIT / demand).min(BLOCK_LIMIT / of_all_blocks);
    (total >= 1e-50).then_some(scale)
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
