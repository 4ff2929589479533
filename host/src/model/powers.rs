//! Products of powers of two inputs, block by block: what polynomial fits and predictions are built from.

/// Exponents of the two inputs of each product, highest exponent 6. The sixteen with both exponents up to 3
/// come first, the second exponent running fastest, so that they can be used alone.
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

/// Fills `products` with u^a·v^b in the order of [`PAIRS`]: one stretch of `u.len()` values per product, as
/// many products (16 or 49) as there is room for.
pub(crate) fn pair_products(u: &[f64], v: &[f64], products: &mut [f64]) {
    let rows = u.len();
    products[..rows].fill(1.0);
    for i in 1..products.len() / rows {
        let (a, b) = PAIRS[i];
        // One multiplication from a product that stands further to the left: both halves of `PAIRS` rise
        // in the first exponent, and in the second within it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_stands_where_the_table_says() {
        let (u, v) = ([0.3, -1.0, 0.9], [-0.7, 0.5, 1.0]);
        let mut products = [0.0; 3 * 49];
        pair_products(&u, &v, &mut products);
        for (i, (a, b)) in PAIRS.iter().enumerate() {
            assert_eq!(POSITION[*a][*b], i);
            for row in 0..3 {
                let expected = u[row].powi(*a as i32) * v[row].powi(*b as i32);
                assert!((products[3 * i + row] - expected).abs() < 1e-15);
            }
        }
    }
}
