//! Products of powers of two inputs, block by block: what polynomial fits and predictions are built
//! from.
//!
//! The loops are plain Rust; `pulp` compiles them for the vector registers that the processor turns
//! out to have. Each product is rounded the same way on all of them.

use pulp::{Arch, Simd, WithSimd};

/// Exponents of the two inputs of each product, highest exponent 6. The sixteen with both exponents
/// up to 3 come first, the second exponent running fastest, so that they can be used alone.
pub(crate) const PAIRS: [(usize, usize); 49] = pairs();

const fn pairs() -> [(usize, usize); 49] {
    let mut pairs = [(0, 0); 49];
    let (mut low, mut high) = (0, 16);
    let mut a = 0;
    while a < 7 {
        let mut b = 0;
        while b < 7 {
            if a < 4 && b < 4 {
                pairs[low] = (a, b);
                low += 1;
            } else {
                pairs[high] = (a, b);
                high += 1;
            }
            b += 1;
        }
        a += 1;
    }
    pairs
}

/// Where the product with the given exponents stands in [`PAIRS`].
pub(crate) const POSITION: [[usize; 7]; 7] = positions();

const fn positions() -> [[usize; 7]; 7] {
    let mut positions = [[0; 7]; 7];
    let mut i = 0;
    while i < 49 {
        positions[PAIRS[i].0][PAIRS[i].1] = i;
        i += 1;
    }
    positions
}

/// Fills `products` with u^a·v^b in the order of [`PAIRS`]: one stretch of `u.len()` values per
/// product, as many products (16 or 49) as there is room for.
pub(crate) fn pair_products(u: &[f64], v: &[f64], products: &mut [f64]) {
    Arch::new().dispatch(ByProduct { u, v, products });
}

/// A loop as `pulp` takes it: what stands in `with_simd` is compiled once per kind of vector
/// register.
struct ByProduct<'a> {
    u: &'a [f64],
    v: &'a [f64],
    products: &'a mut [f64],
}

impl WithSimd for ByProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let Self { u, v, products } = self;
        let rows = u.len();
        products[..rows].fill(1.0);
        let count = products.len() / rows;
        for (i, (a, b)) in PAIRS.into_iter().enumerate().take(count).skip(1) {
            // One multiplication from a product that stands further to the left: both halves of
            // `PAIRS` rise in the first exponent, and in the second within it.
            let (from, factor) = if b > 0 {
                (POSITION[a][b - 1], v)
            } else {
                (POSITION[a - 1][b], u)
            };
            let (left, right) = products.split_at_mut(i * rows);
            let source = &left[from * rows..][..rows];
            for ((target, source), factor) in right[..rows].iter_mut().zip(source).zip(factor) {
                *target = source * factor;
            }
        }
    }
}

/// Values per sample in [`pair_products_by_sample`] before the weighted products: seven unused
/// ones, so that the product after the constant begins a cache line, and the 49 products.
pub(crate) const SAMPLE: usize = 56;

/// Where in a sample's values the 49 products begin.
pub(crate) const CONSTANT: usize = 7;

/// The products u^a·v^b sample by sample, as the left side of a matrix product wants them: per
/// sample [`SAMPLE`] values of which the product with exponents a and b stands at
/// [`CONSTANT`] + 7a + b, then for each output 16 values, the products with exponents up to 3 (at
/// 4a + b) times that output at that sample.
pub(crate) fn pair_products_by_sample(
    u: &[f64],
    v: &[f64],
    outputs: &[&[f64]],
    products: &mut [f64],
) {
    Arch::new().dispatch(BySample {
        u,
        v,
        outputs,
        products,
    });
}

struct BySample<'a> {
    u: &'a [f64],
    v: &'a [f64],
    outputs: &'a [&'a [f64]],
    products: &'a mut [f64],
}

impl WithSimd for BySample<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _registers: S) {
        let Self {
            u,
            v,
            outputs,
            products,
        } = self;
        let samples = products.chunks_exact_mut(SAMPLE + 16 * outputs.len());
        for (sample, (products, (u, v))) in samples.zip(u.iter().zip(v)).enumerate() {
            let (u, v) = (powers(*u), powers(*v));
            let (plain, weighted) = products.split_at_mut(SAMPLE);
            for (row, u) in plain[CONSTANT..].as_chunks_mut::<7>().0.iter_mut().zip(u) {
                *row = v.map(|v| u * v);
            }
            for (weighted, output) in weighted.as_chunks_mut::<16>().0.iter_mut().zip(outputs) {
                let y = output[sample];
                for (row, u) in weighted.as_chunks_mut::<4>().0.iter_mut().zip(u) {
                    let weight = u * y;
                    *row = [weight * v[0], weight * v[1], weight * v[2], weight * v[3]];
                }
            }
        }
    }
}

/// The powers 0 to 6.
#[inline(always)]
pub(crate) fn powers(x: f64) -> [f64; 7] {
    let (x2, x3) = (x * x, x * x * x);
    [1.0, x, x2, x3, x2 * x2, x2 * x3, x3 * x3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_stands_where_the_table_says() {
        let (u, v) = ([0.3, -1.0, 0.9], [-0.7, 0.5, 1.0]);
        let mut products = [0.0; 3 * 49];
        pair_products(&u, &v, &mut products);
        let y = [2.0, -3.0, 0.5];
        let mut by_sample = [0.0; 3 * 72];
        pair_products_by_sample(&u, &v, &[&y], &mut by_sample);
        for (i, (a, b)) in PAIRS.iter().enumerate() {
            assert_eq!(POSITION[*a][*b], i);
            for row in 0..3 {
                let expected = u[row].powi(*a as i32) * v[row].powi(*b as i32);
                assert!((products[3 * i + row] - expected).abs() < 1e-15);
                let at = 72 * row + CONSTANT + 7 * a + b;
                assert!((by_sample[at] - expected).abs() < 1e-15);
                if i < 16 {
                    let weighted = by_sample[72 * row + SAMPLE + i];
                    assert!((weighted - y[row] * expected).abs() < 1e-15);
                }
            }
        }
    }
}
