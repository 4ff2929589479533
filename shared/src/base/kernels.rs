//! The inner loops of a sample: a third of its instructions are in the filters' sums of products, a quarter in those of a polynomial.
//!
//! Here they are in Rust, for every machine. A board may have its own, which give the same bits in fewer instructions; the self-test on the
//! board compares them with these on the host.

use crate::base::network::{self, Neuron};
use crate::base::polynomial::{self, BLOCKS, Blocks};
use crate::chain::filter;

/// The loops.
pub trait Kernels {
    /// `Σ weight·row` of both columns, modulo 2⁶⁴, over as many as there are of both.
    fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2];

    /// `Σ block sum · ⌈outer·gain⌋` over the blocks of an axis, for the powers `row` and `column` of the last two inputs: what
    /// [`crate::base::polynomial`] says of it. It fits, as was checked when the model was made.
    fn sum_of_blocks(
        blocks: &Blocks,
        outer: &[i32; BLOCKS],
        row: &[i32; 3],
        column: &[i32; 3],
    ) -> i64;

    /// `bias` and what the neurons add to the forces of the first `AXES` axes; words of an axis that is not there are 0, as was checked.
    fn sum_of_neurons<const AXES: usize>(
        neurons: &[Neuron],
        bias: [i64; 2],
        u: &[i32; 4],
    ) -> [i64; 2];
}

/// In Rust.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Kernels for Portable {
    #[inline(always)]
    fn products(weights: &[i32], rows: &[[i32; 2]]) -> [i64; 2] {
        filter::products(weights, rows)
    }

    #[inline(always)]
    fn sum_of_blocks(
        blocks: &Blocks,
        outer: &[i32; BLOCKS],
        row: &[i32; 3],
        column: &[i32; 3],
    ) -> i64 {
        polynomial::sum_of_blocks(blocks, outer, row, column)
    }

    #[inline(always)]
    fn sum_of_neurons<const AXES: usize>(
        neurons: &[Neuron],
        bias: [i64; 2],
        u: &[i32; 4],
    ) -> [i64; 2] {
        network::sum_of_neurons::<AXES>(neurons, bias, u)
    }
}
