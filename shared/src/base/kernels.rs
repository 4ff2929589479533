//! The inner loops of a sample: a third of its instructions are in the filters' sums of products, a
//! quarter in those of a polynomial.
//!
//! Here they are in Rust, for every machine. A board may have its own, which give the same bits in
//! fewer instructions; the self-test on the board compares them with these on the host.

use super::stored::{BLOCKS, Block, Blocks, Neuron};
use super::tanh::tanh_scaled;
use crate::scalar::fixed::{in_order, mul_high_add};

/// The inner loops, which a board may have its own of.
pub trait Kernels {
    /// `Σ weight·row` of both columns, modulo 2⁶⁴, over as many as there are of both.
    fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2];

    /// `Σ block sum · ⌈outer·gain⌋` over the blocks of an axis, for the powers `row` and `column`
    /// of the last two inputs: what [`crate::base::polynomial`] says of it. It fits, as was
    /// checked when the model was made.
    fn sum_of_blocks(
        blocks: &Blocks,
        outer: &[i32; BLOCKS],
        row: &[i32; 3],
        column: &[i32; 3],
    ) -> i64;

    /// `bias` and what the neurons add to the forces of the first `AXES` axes; words of an axis
    /// that is not there are 0, as was checked.
    fn sum_of_neurons<const AXES: usize>(
        neurons: &[Neuron],
        bias: [i64; 2],
        u: &[i32; 4],
    ) -> [i64; 2];
}

/// The loops in Rust.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Kernels for Portable {
    #[inline(always)]
    fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2] {
        products(weights, rows)
    }

    #[inline(always)]
    fn sum_of_blocks(
        blocks: &Blocks,
        outer: &[i32; BLOCKS],
        row: &[i32; 3],
        column: &[i32; 3],
    ) -> i64 {
        sum_of_blocks(blocks, outer, row, column)
    }

    #[inline(always)]
    fn sum_of_neurons<const AXES: usize>(
        neurons: &[Neuron],
        bias: [i64; 2],
        u: &[i32; 4],
    ) -> [i64; 2] {
        sum_of_neurons::<AXES>(neurons, bias, u)
    }
}

/// `Σ weight·row` of both columns, modulo 2⁶⁴.
///
/// Sixteen rows at a time, seven instructions for two: as few as the compiler can do with, but for
/// the counting.
#[inline(never)]
fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2] {
    let (many_weights, weights) = weights.as_chunks::<16>();
    let (many_rows, rows) = rows.as_chunks::<16>();
    let mut many_rows = many_rows.iter();
    let mut sums = (0, 0);
    for weights in many_weights {
        let Some(rows) = many_rows.next() else {
            break;
        };
        let ([a, b], [c, d]) = (weights.as_chunks().0, rows.as_chunks().0) else {
            break;
        };
        sums = add_eight(add_eight(sums, a, c), b, d);
    }
    let (mut weights, mut rows) = (weights, rows);
    if let (Some((a, rest)), Some((b, other_rest))) =
        (weights.split_first_chunk(), rows.split_first_chunk())
    {
        sums = add_eight(sums, a, b);
        (weights, rows) = (rest, other_rest);
    }
    for (weight, row) in weights.iter().zip(rows) {
        sums = add(sums, *weight, *row);
    }
    // Not an array before: it would be kept in memory, where it is handed back.
    sums.into()
}

/// `sums` and eight rows more.
#[inline(always)]
fn add_eight(
    sums: (i64, i64),
    [a, b, c, d, e, f, g, h]: &[i32; 8],
    [i, j, k, l, m, n, o, p]: &[[i32; 2]; 8],
) -> (i64, i64) {
    let sums = add_two(sums, [a, b], [i, j]);
    let sums = add_two(sums, [c, d], [k, l]);
    let sums = add_two(sums, [e, f], [m, n]);
    add_two(sums, [g, h], [o, p])
}

/// `sums` and two rows more. In order, or the compiler would load all rows before it multiplies,
/// and had no registers left.
#[inline(always)]
fn add_two(sums: (i64, i64), [v, w]: [&i32; 2], [first, second]: [&[i32; 2]; 2]) -> (i64, i64) {
    let sums = add(add(sums, *v, *first), *w, *second);
    in_order();
    sums
}

/// `sums` and a row more.
#[inline(always)]
fn add((first, second): (i64, i64), weight: i32, [a, b]: [i32; 2]) -> (i64, i64) {
    let product = |value: i32| i64::from(weight) * i64::from(value);
    (
        first.wrapping_add(product(a)),
        second.wrapping_add(product(b)),
    )
}

/// Σ block sum · monomial · gain of one axis, with [`SUM_PLACES`](super::polynomial::SUM_PLACES)
/// more binary places than the block sums have.
///
/// Not inlined: where the compiler sees how the powers were computed it keeps some of them in 64
/// bits, and then needs eight instructions for a product that is otherwise one. Written out, not a
/// loop: the addresses of all words are then constants, which leaves two more registers for powers
/// and lets pairs of words be loaded at once.
#[inline(never)]
fn sum_of_blocks(blocks: &Blocks, outer: &[i32; BLOCKS], row: &[i32; 3], column: &[i32; 3]) -> i64 {
    let (blocks, _) = blocks.as_chunks::<4>();
    let (outer, _) = outer.as_chunks::<4>();
    let ([b0, b1, b2, b3], [m0, m1, m2, m3]) = (blocks, outer) else {
        return 0;
    };
    // Not by reference: they would be loaded anew for every row.
    let (row, column) = (*row, *column);
    let sum = add_four_blocks(0, b0, m0, row, column);
    let sum = add_four_blocks(sum, b1, m1, row, column);
    let sum = add_four_blocks(sum, b2, m2, row, column);
    add_four_blocks(sum, b3, m3, row, column)
}

/// `sum` and the blocks of one power of x.
#[inline(always)]
fn add_four_blocks(
    sum: i64,
    [b0, b1, b2, b3]: &[Block; 4],
    [m0, m1, m2, m3]: &[i32; 4],
    row: [i32; 3],
    column: [i32; 3],
) -> i64 {
    let sum = add_block(sum, b0, *m0, row, column);
    let sum = add_block(sum, b1, *m1, row, column);
    let sum = add_block(sum, b2, *m2, row, column);
    add_block(sum, b3, *m3, row, column)
}

/// `sum` and one block.
#[inline(always)]
fn add_block(sum: i64, block: &Block, monomial: i32, row: [i32; 3], column: [i32; 3]) -> i64 {
    let block_sum = block_sum(&block.words, row, column);
    let weight = mul_high_add(monomial, block.gain, 0);
    in_order();
    sum + i64::from(block_sum) * i64::from(weight)
}

/// Σ w_kl·row^k·column^l of one block, at the block's scale A.
#[inline(always)]
pub(super) fn block_sum(words: &[i32; 16], row: [i32; 3], column: [i32; 3]) -> i32 {
    let [q1, q2, q3] = row;
    let (rows, _) = words.as_chunks::<4>();
    let [r0, r1, r2, r3] = rows else {
        return 0;
    };
    let sum = row_sum(r0, column);
    let sum = mul_high_add(row_sum(r1, column), q1, sum);
    let sum = mul_high_add(row_sum(r2, column), q2, sum);
    mul_high_add(row_sum(r3, column), q3, sum)
}

/// Σ w_l·column^l of one row.
#[inline(always)]
fn row_sum(&[w0, w1, w2, w3]: &[i32; 4], [p1, p2, p3]: [i32; 3]) -> i32 {
    let sum = mul_high_add(w3, p3, mul_high_add(w2, p2, mul_high_add(w1, p1, w0)));
    in_order();
    sum
}

/// `bias` and what the neurons add to the forces of the first `AXES` axes.
#[inline(never)]
fn sum_of_neurons<const AXES: usize>(
    neurons: &[Neuron],
    [mut first, mut second]: [i64; 2],
    u: &[i32; 4],
) -> [i64; 2] {
    for neuron in neurons {
        let ([a, b, c, d], [x, v, phi, omega]) = (neuron.weights, *u);
        // Of one axis the third is its input.
        let mut argument = neuron.bias + product(a, x) + product(b, v) + product(c, phi);
        if AXES == 2 {
            argument += product(d, omega);
        }
        let value = tanh_scaled((argument >> 32) as i32, neuron.steps);
        let [v, w] = neuron.outputs;
        first += product(v, value);
        if AXES == 2 {
            second += product(w, value);
        }
    }
    [first, second]
}

/// The exact product, widened where it is used so that it and an addition are one instruction.
#[inline(always)]
fn product(word: i32, factor: i32) -> i64 {
    i64::from(word) * i64::from(factor)
}
