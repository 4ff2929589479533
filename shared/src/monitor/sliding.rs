//! The NMSE as it slides along: sums over blocks that forget the old ones little by little.

use super::block::Sums;

/// How far an error figure looks back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// About 16 blocks, a second or so.
    Fast,
    /// About 1024 blocks, a minute or so.
    Slow,
}

/// Binary logarithms of the blocks that the fast and the slow NMSE remember.
pub(super) const FAST: u32 = 4;
pub(super) const SLOW: u32 = 10;
/// Bits below the monitor's units that the sliding sums keep.
pub(super) const PLACES: u32 = 6;
/// Sums of a sliding NMSE, times 2^[`PLACES`]: e², r², r per block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sliding {
    error: i64,
    force: i64,
    force_sum: i64,
}

impl Sliding {
    /// Adds a block to sums that remember 2^`MEMORY` of them. A constant, because a shift of 64
    /// bits by any number of places is a call.
    pub(super) fn add<const MEMORY: u32>(&mut self, sums: &Sums) {
        let slide = |mean: &mut i64, sum: i64| *mean += ((sum << PLACES) - *mean) >> MEMORY;
        slide(&mut self.error, sums.error);
        slide(&mut self.force, sums.force);
        slide(&mut self.force_sum, sums.force_sum);
    }

    /// 100·Σe²/(N·var r) in 1/1000 %, for blocks of 2^`log_values` residuals; none while the force
    /// does not vary.
    pub(super) fn nmse(&self, log_values: u32) -> Option<u32> {
        let mean = i128::from(self.force_sum);
        let of_mean = (mean * mean) >> ((log_values & 15) + PLACES);
        let spread = i128::from(self.force) - of_mean;
        // Both to 44 bits at most, so that the product with 10⁵ fits.
        let bits = 128 - (spread.max(self.error.into()).max(0) as u128).leading_zeros();
        let shift = bits.saturating_sub(44);
        let (error, spread) = ((self.error >> shift) as u64, (spread >> shift) as i64);
        if spread <= 0 {
            return None;
        }
        let nmse = error.saturating_mul(100_000) / spread as u64;
        Some(nmse.min(u32::MAX.into()) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_nmse_and_forgets() {
        let mut sliding = Sliding::default();
        assert_eq!(sliding.nmse(6), None, "no force, no figure");
        // r = 1000 ± 60000, e = ±6000: 1 % of the variance.
        let block = |e: i64| Sums {
            error: 64 * e * e,
            force: 64 * (60_000 * 60_000 + 1000 * 1000),
            force_sum: 64_000,
            ..Sums::default()
        };
        for _ in 0..3 {
            sliding.add::<FAST>(&block(6000));
        }
        let seen = sliding.nmse(6).unwrap();
        assert!(seen.abs_diff(1000) < 3, "{seen}");
        // The error trebles: nine times the power, of which one memory later 63 % are seen.
        for _ in 0..200 {
            sliding.add::<FAST>(&block(6000));
        }
        for _ in 0..16 {
            sliding.add::<FAST>(&block(18_000));
        }
        let seen = sliding.nmse(6).unwrap();
        assert!((5800..6400).contains(&seen), "{seen}");
        for _ in 0..400 {
            let rail = Sums {
                error: 1 << 56,
                force: 1 << 56,
                force_sum: -(1 << 33),
                ..Sums::default()
            };
            sliding.add::<FAST>(&rail);
        }
        assert!(sliding.nmse(10).is_none_or(|seen| seen >= 100_000));
    }
}
