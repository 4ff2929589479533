//! Sums of products over rows, always in the same order: the same bits on every processor.
//!
//! A general matrix product may sum in another order on a machine with other registers. Here every
//! sum takes its rows one after the other with fused multiply-adds, and only different sums stand
//! side by side in a register.

use pulp::{Arch, Simd, WithSimd};

/// Columns of the right side that are summed at once; its rows are padded to a multiple of them.
pub(crate) const LANES: usize = 8;

/// Columns of the left side that are summed at once.
const HEIGHT: usize = 6;

/// Rows that are summed in floating point before they enter the exact sums.
pub(super) const FLUSHED: usize = 4096;

/// `sums` with Σ left·right of series that are equally long, each summed in the order of its rows.
pub(super) fn with_products<const N: usize>(
    mut sums: [f64; N],
    pairs: [(&[f64], &[f64]); N],
) -> [f64; N] {
    Arch::new().dispatch(|| {
        let rows = pairs.first().map_or(0, |(left, _)| left.len());
        for row in 0..rows {
            for (sum, (left, right)) in sums.iter_mut().zip(pairs) {
                *sum = left[row].mul_add(right[row], *sum);
            }
        }
        sums
    })
}

/// Rows of numbers, one row after the other.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) values: &'a [f64],
    /// How many each row has.
    pub(crate) width: usize,
}

/// Adds Σ left[row][i]·right[row][j] to `sums[i·stride + j]` for the columns i of `of_left` and the
/// first `columns` of the right side, a multiple of [`LANES`].
pub(crate) fn add_products(
    left: Rows<'_>,
    of_left: std::ops::Range<usize>,
    right: Rows<'_>,
    columns: usize,
    sums: (&mut [f64], usize),
) {
    Arch::new().dispatch(Products {
        left,
        of_left,
        right,
        columns,
        sums,
    });
}

/// The loops, which `pulp` compiles for the vector registers that the processor turns out to have.
struct Products<'a> {
    left: Rows<'a>,
    of_left: std::ops::Range<usize>,
    right: Rows<'a>,
    columns: usize,
    sums: (&'a mut [f64], usize),
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let Self {
            left,
            of_left,
            right,
            columns,
            sums: (sums, stride),
        } = self;
        let end = of_left.end;
        for i in of_left.step_by(HEIGHT) {
            for j in (0..columns).step_by(LANES) {
                let place = (i, j, stride);
                match end - i {
                    1 => tile::<1>(left, right, sums, place),
                    2 => tile::<2>(left, right, sums, place),
                    3 => tile::<3>(left, right, sums, place),
                    4 => tile::<4>(left, right, sums, place),
                    5 => tile::<5>(left, right, sums, place),
                    _ => tile::<HEIGHT>(left, right, sums, place),
                }
            }
        }
    }
}

/// `HEIGHT` times `LANES` sums, held in registers while the rows go by.
#[inline(always)]
fn tile<const H: usize>(
    left: Rows<'_>,
    right: Rows<'_>,
    sums: &mut [f64],
    (i, j, stride): (usize, usize, usize),
) {
    let mut tile = [[0.0; LANES]; H];
    let lefts = left.values.chunks_exact(left.width);
    let rights = right.values.chunks_exact(right.width);
    for (l, r) in lefts.zip(rights) {
        let (Some(l), Some(r)) = (l[i..].first_chunk::<H>(), r[j..].first_chunk::<LANES>()) else {
            continue;
        };
        for (sums, l) in tile.iter_mut().zip(l) {
            for (sum, r) in sums.iter_mut().zip(r) {
                *sum = l.mul_add(*r, *sum);
            }
        }
    }
    for (row, tile) in tile.iter().enumerate() {
        let target = &mut sums[(i + row) * stride + j..][..LANES];
        for (sum, more) in target.iter_mut().zip(tile) {
            *sum += more;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn every_sum_is_that_of_its_rows_in_their_order_to_the_bit() {
        let mut rng = ChaCha8Rng::seed_from_u64(71);
        let mut random =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        for lefts in [1, 5, 6, 13] {
            let (left, right) = (random(37 * (lefts + 2)), random(37 * 16));
            let mut sums = vec![0.5; (lefts + 2) * 24];
            let rows = |values, width| Rows { values, width };
            add_products(
                rows(&left, lefts + 2),
                2..lefts + 2,
                rows(&right, 16),
                16,
                (&mut sums, 24),
            );
            for i in 0..lefts + 2 {
                for j in 0..24 {
                    let mut sum = 0.0_f64;
                    if i >= 2 && j < 16 {
                        for row in 0..37 {
                            sum = left[row * (lefts + 2) + i].mul_add(right[row * 16 + j], sum);
                        }
                    }
                    assert_eq!((0.5 + sum).to_bits(), sums[i * 24 + j].to_bits(), "{i} {j}");
                }
            }
        }
    }
}
