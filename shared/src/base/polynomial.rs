//! The paper's polynomial in integers: up to 256 terms per axis, both axes at once, the same bits
//! on every machine.
//!
//! r = Σ a_ijkl · x^i · ẋ^j · φ^k · φ̇^l with i, j, k, l from 0 to 3 (the paper's Eqs. 10–13); for
//! one axis r = Σ a_ij · x^i · ẋ^j.
//!
//! The terms lie in 16 blocks, one for each x^i·ẋ^j. Within a block four rows, one per power of φ,
//! are summed over the powers of φ̇, and the four row sums over the powers of φ, each product one
//! rounded high-word multiplication ([`mul_high_add`]). The block sums times x^i·ẋ^j times the
//! block's gain are then added up in 64 bits and rounded once. The gain lets a block of small
//! coefficients use all 32 bits beside a block of large ones. `docs/explanation/numerics.md`
//! derives the scales, the bounds and the error; [`PolynomialModel::check`] proves the bounds for
//! the words at hand.

pub use super::stored::{BLOCKS, Block, Blocks};

use super::kernels::{Kernels, Portable, block_sum};
use crate::fault::{Checks, Error};
use crate::scalar::fixed::{mul_high_add, q31_powers};

/// The largest output shift; beyond it the 64-bit sum would overflow first.
pub const MAX_OUTPUT_SHIFT: u8 = 3;
/// The binary places of the 64-bit sum beyond those of the block sums: 30 of the monomial and 31 of
/// the gain, less the 32 that their product loses.
pub const SUM_PLACES: u32 = 29;

/// A polynomial in fixed point, for one or two axes.
///
/// With A the scale of a block, which is any real number, the stored words are the coefficients
/// times A when both k and l are 0, times 2·A when one of them is, times 4·A otherwise, because
/// every multiplication by a Q31 number halves the scale. A times the gain is the same number G for
/// all blocks of an axis, and the output is the force times G/2^shift. One axis has one block, and
/// the output is the force times A; where it follows an input as well, a block for each power
/// of that, which stand as those of the powers of x do for two axes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolynomialModel {
    pub(crate) orders: [u8; 4],
    pub(crate) axes: u8,
    pub(crate) shifts: [u8; 2],
    pub(crate) blocks: [Blocks; 2],
}

impl PolynomialModel {
    /// Axes: 1 or 2.
    pub fn axes(&self) -> usize {
        usize::from(self.axes)
    }

    /// The highest exponents of x, ẋ, φ, φ̇; of one axis the third is that of its input.
    pub fn orders(&self) -> [u8; 4] {
        self.orders
    }

    /// The right shift of each axis's sum, beyond [`SUM_PLACES`].
    pub fn shifts(&self) -> [u8; 2] {
        self.shifts
    }

    /// The stored blocks, `[axis][4·i + j]`.
    pub fn blocks(&self) -> &[Blocks; 2] {
        &self.blocks
    }

    /// Whether a force of one axis depends on its input.
    pub fn follows(&self) -> bool {
        let [_, _, input, _] = self.orders;
        self.axes == 1 && input > 0
    }

    /// Whether blocks are summed: not where there is one alone.
    pub(super) fn sums_blocks(&self) -> bool {
        self.axes == 2 || self.follows()
    }

    /// The exponents of x, ẋ, φ, φ̇ that belong to a stored word.
    pub(crate) fn exponents(&self, block: usize, word: usize) -> [u8; 4] {
        let (block, word) = (block as u8, word as u8);
        if self.axes == 1 {
            [word / 4, word % 4, block / 4, block % 4]
        } else {
            [block / 4, block % 4, word / 4, word % 4]
        }
    }

    /// The force on each axis, in units of its `force_per_lsb`, for inputs [x, ẋ, φ, φ̇] in Q31.
    ///
    /// A one-axis polynomial reads [x, ẋ], the third where it follows an input, and leaves the
    /// second output at 0. The instructions that run are the same for all inputs: no branch
    /// depends on one. Nothing overflows and nothing has to be saturated,
    /// because [`Self::check`] has bounded every sum for all inputs.
    #[inline]
    pub fn evaluate(&self, u: &[i32; 4]) -> [i32; 2] {
        self.evaluate_by::<Portable>(u)
    }

    /// [`Self::evaluate`] with a board's kernels.
    #[inline]
    pub fn evaluate_by<K: Kernels>(&self, u: &[i32; 4]) -> [i32; 2] {
        let [first, second] = &self.blocks;
        let [x, v, phi, omega] = *u;
        let (a, b) = (q31_powers(x), q31_powers(v));
        let [s, t] = self.shifts;
        if self.axes == 1 {
            if self.follows() {
                let outer = monomials(&q31_powers(phi), &[0; 3]);
                return [output(K::sum_of_blocks(first, &outer, &a, &b), s), 0];
            }
            let [block, ..] = first;
            return [block_sum(&block.words, a, b), 0];
        }
        let (c, d) = (q31_powers(phi), q31_powers(omega));
        let outer = monomials(&a, &b);
        [
            output(K::sum_of_blocks(first, &outer, &c, &d), s),
            output(K::sum_of_blocks(second, &outer, &c, &d), t),
        ]
    }

    /// Proves that no input can overflow any sum of the evaluation, and that the rest of the model
    /// is what it states.
    ///
    /// With |factor| ≤ 2³¹ a rounded high-word product is at most ⌊(|word| + 1)/2⌋ in size, and
    /// with |monomial| ≤ 2³⁰ its product with a gain is at most ⌊(gain + 2)/4⌋; so the sizes of
    /// the stored words bound everything.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for axes, orders and shifts, [`Error::Coefficient`] for a word outside
    /// the orders or the axes or for a block with a gain that is not its, [`Error::Overflow`]
    /// for the sum that could overflow.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.whole("number of axes", i32::from(self.axes), 1, 2);
        for (input, &order) in self.orders.iter().enumerate() {
            // Of one axis the third is its input.
            let most = if input < 2 + self.axes() { 3 } else { 0 };
            checks.whole("order of the polynomial", i32::from(order), 0, most);
        }
        let most = if self.sums_blocks() {
            MAX_OUTPUT_SHIFT
        } else {
            0
        };
        for &shift in &self.shifts {
            let quantity = "output shift of the polynomial";
            checks.whole(quantity, i32::from(shift), 0, i32::from(most));
        }
        checks.done()?;
        self.check_words_outside()?;
        for (axis, (blocks, &shift)) in self.blocks.iter().zip(&self.shifts).enumerate() {
            self.check_sums(axis, blocks, shift)?;
        }
        Ok(())
    }

    /// Refuses words and gains that no term of the stated orders and axes owns.
    fn check_words_outside(&self) -> Result<(), Error> {
        for (axis, blocks) in self.blocks.iter().enumerate() {
            for (number, block) in blocks.iter().enumerate() {
                let refuse = |exponents, word| {
                    Err(Error::Coefficient {
                        axis: axis as u8,
                        exponents,
                        seen: f64::from(word),
                    })
                };
                let mut used = false;
                for (place, &word) in block.words.iter().enumerate() {
                    let exponents = self.exponents(number, place);
                    let inside = axis < self.axes()
                        && exponents.iter().zip(&self.orders).all(|(e, o)| e <= o);
                    if word != 0 && !inside {
                        return refuse(exponents, word);
                    }
                    used |= inside;
                }
                let gain_is_sound = if used && self.sums_blocks() {
                    block.gain >= 0
                } else {
                    block.gain == 0
                };
                if !gain_is_sound {
                    return refuse(self.exponents(number, 0), block.gain);
                }
            }
        }
        Ok(())
    }

    /// Bounds the row sums, the block sums, the 64-bit sum and the output of one axis.
    fn check_sums(&self, axis: usize, blocks: &Blocks, shift: u8) -> Result<(), Error> {
        let overflow = |sum, number: usize| Error::Overflow {
            axis: axis as u8,
            sum,
            block: [number as u8 / 4, number as u8 % 4],
        };
        const MOST: u64 = i32::MAX as u64;
        // At most 16·2³¹·2²⁹ = 2⁶⁴, so it is computed in 128 bits.
        let mut total = 0_u128;
        for (number, block) in blocks.iter().enumerate() {
            let (rows, _) = block.words.as_chunks::<4>();
            let mut sum = 0_u64;
            for (k, row) in rows.iter().enumerate() {
                let largest = bound_of_sum(&row.map(|word| u64::from(word.unsigned_abs())));
                if largest > MOST {
                    return Err(overflow("sum over the powers of the last input", number));
                }
                sum += if k == 0 { largest } else { largest.div_ceil(2) };
            }
            if sum > MOST {
                return Err(overflow("sum of a block", number));
            }
            let weight = (u64::from(block.gain.unsigned_abs()) + 2) / 4;
            total += u128::from(sum) * u128::from(weight);
        }
        if total > i64::MAX as u128 {
            return Err(overflow("64-bit sum", 0));
        }
        let n = SUM_PLACES + u32::from(shift);
        if (total + (1 << (n - 1))) >> n > u128::from(MOST) {
            return Err(overflow("output", 0));
        }
        Ok(())
    }
}

/// The largest size of `w₀ + Σ round(wᵢ·p/2³²)` over |p| ≤ 2³¹, for the sizes of the words.
fn bound_of_sum(&[first, a, b, c]: &[u64; 4]) -> u64 {
    first + a.div_ceil(2) + b.div_ceil(2) + c.div_ceil(2)
}

/// The sum of an axis, rounded half up to the places of its output: `round_shift(sum, SUM_PLACES +
/// shift)`.
///
/// Written in 32-bit halves: a 64-bit shift by a variable costs three times as many instructions.
#[inline(always)]
fn output(sum: i64, shift: u8) -> i32 {
    // The output is the high word of the sum shifted up by 0 to 3 places, which `check` has proven
    // to fit.
    let up = u32::from(MAX_OUTPUT_SHIFT - shift);
    let (high, low) = ((sum >> 32) as i32, sum as u32);
    let carried = (low >> 1) >> (31 - up);
    let rounding = (low << up) >> 31;
    (high << up) + carried as i32 + rounding as i32
}

/// Half of a Q31 number, rounded half up.
#[inline(always)]
fn halved(a: i32) -> i32 {
    (a >> 1) + (a & 1)
}

/// The product of two Q31 numbers in Q30.
#[inline(always)]
fn product(a: i32, b: i32) -> i32 {
    mul_high_add(a, b, 0)
}

/// x^i·ẋ^j in Q30, in the order of the blocks; 1 is exact, and so is every size at most 2³⁰.
#[inline(always)]
fn monomials(x: &[i32; 3], v: &[i32; 3]) -> [i32; BLOCKS] {
    let [a, b, c] = *x;
    let [d, e, f] = *v;
    [
        1 << 30,
        halved(d),
        halved(e),
        halved(f),
        halved(a),
        product(a, d),
        product(a, e),
        product(a, f),
        halved(b),
        product(b, d),
        product(b, e),
        product(b, f),
        halved(c),
        product(c, d),
        product(c, e),
        product(c, f),
    ]
}
