//! The paper's polynomial in integers: up to 256 terms per axis, both axes at once, the same bits on every machine.
//!
//! r = Σ a_ijkl · x^i · ẋ^j · φ^k · φ̇^l with i, j, k, l from 0 to 3 (the paper's Eqs. 10–13); for one axis r = Σ a_ij · x^i · ẋ^j.
//!
//! The terms lie in 16 blocks, one for each x^i·ẋ^j. Within a block four rows, one per power of φ, are summed over the
//! powers of φ̇, and the four row sums over the powers of φ, each product one rounded high-word multiplication
//! ([`mul_high_add`]). The block sums times x^i·ẋ^j are then added up in 64 bits and rounded once. `docs/numerics.md` derives
//! the scales, the bounds and the error; [`PolynomialModel::check`] proves the bounds for the words at hand.

use crate::error::Error;
use crate::fixed::{mul_high_add, mul_shift, q31_powers, round_shift};

/// Blocks of a two-axis polynomial, one for each x^i·ẋ^j; block number 4·i + j.
pub const BLOCKS: usize = 16;
/// The largest output shift; with more the 64-bit sum could overflow before its bound of 2⁶³ is reached.
pub const MAX_OUTPUT_SHIFT: u8 = 2;

/// The coefficients of one block as stored: word 4·k + l belongs to φ^k·φ̇^l (one axis: to x^k·ẋ^l).
pub type Block = [i32; 16];

/// A polynomial in fixed point, for one or two axes.
///
/// Stored words are the coefficients times S, the scale of the axis, which is any real number: S/4 when both k and l
/// are 0, S/2 when one of them is, S otherwise, because every multiplication by a Q31 number halves the scale. The
/// output is the force times S/2^(2+shift).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolynomialModel {
    pub(crate) orders: [u8; 4],
    pub(crate) axes: u8,
    pub(crate) shifts: [u8; 2],
    pub(crate) blocks: [[Block; 2]; BLOCKS],
}

impl PolynomialModel {
    /// A polynomial from its stored words, `blocks[4·i + j][axis][4·k + l]`.
    ///
    /// `orders` are the highest exponents of x, ẋ, φ, φ̇; of a one-axis polynomial the last two are 0 and its words
    /// are `blocks[0][0][4·i + j]`.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn from_words(
        orders: [u8; 4],
        axes: u8,
        shifts: [u8; 2],
        blocks: [[Block; 2]; BLOCKS],
    ) -> Result<Self, Error> {
        let model = Self {
            orders,
            axes,
            shifts,
            blocks,
        };
        model.check()?;
        Ok(model)
    }

    /// Axes: 1 or 2.
    pub fn axes(&self) -> usize {
        usize::from(self.axes)
    }

    /// The highest exponents of x, ẋ, φ, φ̇.
    pub fn orders(&self) -> [u8; 4] {
        self.orders
    }

    /// The right shift of each axis's sum, beyond the 30 places of the monomials.
    pub fn shifts(&self) -> [u8; 2] {
        self.shifts
    }

    /// The stored words, `[4·i + j][axis][4·k + l]`.
    pub fn blocks(&self) -> &[[Block; 2]; BLOCKS] {
        &self.blocks
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
    /// A one-axis polynomial reads the first two inputs and leaves the second output at 0. The instructions that run
    /// are the same for all inputs: no branch depends on one. Nothing overflows and nothing has to be saturated,
    /// because [`Self::check`] has bounded every sum for all inputs.
    #[inline]
    pub fn evaluate(&self, u: &[i32; 4]) -> [i32; 2] {
        let [a, b, c, d] = u;
        if self.axes == 1 {
            let [[block, _], ..] = &self.blocks;
            [block_sum(block, &q31_powers(*a), &q31_powers(*b)), 0]
        } else {
            let outer = monomials(&q31_powers(*a), &q31_powers(*b));
            self.sum_of_blocks(&outer, &q31_powers(*c), &q31_powers(*d))
        }
    }

    /// The sum over all blocks, for the monomials x^i·ẋ^j in Q30 and the powers of φ and φ̇ in Q31.
    #[inline]
    fn sum_of_blocks(&self, outer: &[i32; BLOCKS], row: &[i32; 3], column: &[i32; 3]) -> [i32; 2] {
        let mut sums = [0_i64; 2];
        for ([first, second], &monomial) in self.blocks.iter().zip(outer) {
            sums[0] += i64::from(block_sum(first, row, column)) * i64::from(monomial);
            sums[1] += i64::from(block_sum(second, row, column)) * i64::from(monomial);
        }
        let [first, second] = self.shifts;
        [
            round_shift(sums[0], 30 + u32::from(first)) as i32,
            round_shift(sums[1], 30 + u32::from(second)) as i32,
        ]
    }

    /// Proves that no input can overflow any sum of the evaluation, and that the rest of the model is what it states.
    ///
    /// With |factor| ≤ 2³¹ a rounded high-word product is at most ⌊(|word| + 1)/2⌋ in size, and with |monomial| ≤ 2³⁰
    /// the final sum is at most 2³⁰·Σ|block sum|; so the sizes of the stored words bound everything.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for axes, orders and shifts, [`Error::Coefficient`] for a word outside the orders or
    /// the axes, [`Error::Overflow`] for the sum that could overflow.
    pub fn check(&self) -> Result<(), Error> {
        Error::unless_within("number of axes", f64::from(self.axes), 1.0, 2.0)?;
        for (input, &order) in self.orders.iter().enumerate() {
            let most = if input < 2 * self.axes() { 3.0 } else { 0.0 };
            Error::unless_within("order of the polynomial", f64::from(order), 0.0, most)?;
        }
        for (axis, &shift) in self.shifts.iter().enumerate() {
            let shifted = self.axes == 2 && axis < 2;
            let most = if shifted { MAX_OUTPUT_SHIFT } else { 0 };
            Error::unless_within(
                "output shift of the polynomial",
                f64::from(shift),
                0.0,
                f64::from(most),
            )?;
        }
        self.check_words_outside()?;
        for (axis, &shift) in self.shifts.iter().enumerate().take(self.axes()) {
            self.check_sums(axis, shift)?;
        }
        Ok(())
    }

    /// Refuses words that no term of the stated orders and axes owns.
    fn check_words_outside(&self) -> Result<(), Error> {
        for (number, pair) in self.blocks.iter().enumerate() {
            for (axis, block) in pair.iter().enumerate() {
                for (place, &word) in block.iter().enumerate() {
                    let exponents = self.exponents(number, place);
                    let inside = axis < self.axes()
                        && exponents.iter().zip(&self.orders).all(|(e, o)| e <= o);
                    if word != 0 && !inside {
                        return Err(Error::Coefficient {
                            axis: axis as u8,
                            exponents,
                            seen: f64::from(word),
                        });
                    }
                }
            }
        }
        Ok(())
    }

    /// Bounds the row sums, the block sums, the 64-bit sum and the output of one axis.
    fn check_sums(&self, axis: usize, shift: u8) -> Result<(), Error> {
        let overflow = |sum, number: usize| Error::Overflow {
            axis: axis as u8,
            sum,
            block: [number as u8 / 4, number as u8 % 4],
        };
        const MOST: u64 = i32::MAX as u64;
        let mut total = 0_u64;
        for (number, pair) in self.blocks.iter().enumerate() {
            let Some(block) = pair.get(axis) else {
                continue;
            };
            let (rows, _) = block.as_chunks::<4>();
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
            total += sum;
        }
        // At most 16·2³¹·2³⁰ = 2⁶⁵, so it is computed in 128 bits.
        let total = u128::from(total) << 30;
        if total > i64::MAX as u128 {
            return Err(overflow("64-bit sum", 0));
        }
        let n = 30 + u32::from(shift);
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

/// x^i·ẋ^j in Q30, in the order of the blocks; 1 is exact, and so is every size at most 2³⁰.
#[inline(always)]
fn monomials(x: &[i32; 3], v: &[i32; 3]) -> [i32; BLOCKS] {
    let halved = |a: i32| round_shift(i64::from(a), 1) as i32;
    let product = |a: i32, b: i32| mul_shift(a, b, 32) as i32;
    let [v1, v2, v3] = *v;
    let [a, b, c] = x.map(|p| [halved(p), product(p, v1), product(p, v2), product(p, v3)]);
    let one = [1 << 30, halved(v1), halved(v2), halved(v3)];
    let mut all = [0; BLOCKS];
    let (rows, _) = all.as_chunks_mut::<4>();
    for (row, values) in rows.iter_mut().zip([one, a, b, c]) {
        *row = values;
    }
    all
}

/// Σ w_kl·row^k·column^l of one block, at a quarter of the words' scale S.
#[inline(always)]
fn block_sum(block: &Block, row: &[i32; 3], column: &[i32; 3]) -> i32 {
    let [p1, p2, p3] = *column;
    let [q1, q2, q3] = *row;
    let (rows, _) = block.as_chunks::<4>();
    let [r0, r1, r2, r3] = rows else {
        return 0;
    };
    let row_sum = |&[w0, w1, w2, w3]: &[i32; 4]| {
        mul_high_add(w3, p3, mul_high_add(w2, p2, mul_high_add(w1, p1, w0)))
    };
    let sum = mul_high_add(row_sum(r1), q1, row_sum(r0));
    let sum = mul_high_add(row_sum(r2), q2, sum);
    mul_high_add(row_sum(r3), q3, sum)
}
