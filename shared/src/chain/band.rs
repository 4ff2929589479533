//! The low-pass over the residual, at the rate of its band: a value at every so many samples, its
//! products spread over them.
//!
//! A value at sample n sums up the residuals of the window that ends there. All of them but the
//! last few are there some samples before, so the sum is begun with the oldest of them as soon as
//! the value before it is out, and every sample adds as large a piece as the others. The value
//! comes no later than if it were summed up at once, and has the same bits.

use crate::base::kernels::Kernels;
use crate::chain::filter::{History, shift_round};
use crate::wire::rig::{MAX_BAND_TAPS, Taps};

/// The low-pass and how often it gives a value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Band {
    pub(super) taps: Taps<MAX_BAND_TAPS>,
    /// Binary logarithm of the samples from one value to the next, as
    /// [`crate::wire::rig::Rig::band_every_log2`].
    pub(super) every_log2: u8,
}

impl Band {
    /// Samples from one value to the next.
    pub(super) fn every(&self) -> usize {
        1 << (self.every_log2 & 15)
    }

    /// Takes the residuals of one sample in; gives the residuals in the band when it is time for
    /// them.
    #[inline(always)]
    pub(super) fn step<K: Kernels>(
        &self,
        state: &mut BandState,
        residual: [i32; 2],
    ) -> Option<[i32; 2]> {
        state.residuals.push([residual]);
        let (length, every, left) = (self.taps.taps.len(), self.every(), state.left);
        if left < every {
            // Of the window that ends `left` samples later, its oldest rows are there.
            let there = length.saturating_sub(left);
            let piece = (length + every - 1) >> (self.every_log2 & 15);
            let (from, to) = (state.done, there.min(state.done + piece));
            let start = state.residuals.newest(there).start;
            let rows = state.residuals.window(0, &(start + from..start + to));
            let weights = self.taps.taps.get(from..to).unwrap_or_default();
            let ([a, b], [c, d]) = (state.sums, K::products(weights, rows));
            state.sums = [a.wrapping_add(c), b.wrapping_add(d)];
            state.done = to;
        }
        if left > 0 {
            state.left = left - 1;
            return None;
        }
        let value = state.sums.map(|sum| shift_round(sum, self.taps.shift));
        (state.sums, state.done, state.left) = ([0; 2], 0, every - 1);
        Some(value)
    }
}

/// What moves of a [`Band`]: the residuals in its window, and the sums under way.
#[derive(Clone, Debug)]
pub(super) struct BandState {
    residuals: History<MAX_BAND_TAPS>,
    /// Over the first `done` rows of the window of the next value.
    sums: [i64; 2],
    done: usize,
    /// Samples until the next value.
    left: usize,
}

impl BandState {
    /// Nothing was taken yet.
    pub(super) const NEW: Self = Self {
        residuals: History::NEW,
        sums: [0; 2],
        done: 0,
        left: 0,
    };

    /// Before the first residual: the first value comes when the window is full.
    pub(super) fn begin(&mut self, band: &Band) {
        self.left = band.taps.taps.len().saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::base::kernels::Portable;
    use std::vec::Vec;

    /// A symmetric filter of so many taps.
    fn band(length: usize, every_log2: u8) -> Band {
        let tap = |at: usize| 1000 + 37 * at.min(length - 1 - at) as i32;
        Band {
            taps: Taps {
                taps: (0..length).map(tap).collect(),
                shift: 9,
            },
            every_log2,
        }
    }

    fn values(band: &Band) -> Vec<Option<[i32; 2]>> {
        let mut state = BandState::NEW;
        state.begin(band);
        let residual = |n: i32| [n.wrapping_mul(0x3A7_1E5D) >> 4, (n * n) << 8];
        let step = |n| band.step::<Portable>(&mut state, residual(n));
        (0..700).map(step).collect()
    }

    #[test]
    fn it_keeps_a_constant_and_saturates_at_the_rails() {
        let passed = |taps: [i32; 3], value: i32| {
            let taps = Taps {
                taps: heapless::Vec::from_slice(&taps).unwrap(),
                shift: 22,
            };
            let (band, mut state) = (
                Band {
                    taps,
                    every_log2: 1,
                },
                BandState::NEW,
            );
            state.begin(&band);
            let step = |_| band.step::<Portable>(&mut state, [value, value.wrapping_neg()]);
            (0..5).filter_map(step).last()
        };
        let mean = [1 << 20, 1 << 21, 1 << 20];
        assert_eq!(passed(mean, 7), Some([7, -7]));
        assert_eq!(passed(mean, i32::MIN), Some([i32::MIN; 2]));
        let gain_two = mean.map(|tap| 2 * tap);
        assert_eq!(passed(gain_two, i32::MAX), Some([i32::MAX, i32::MIN]));
    }

    #[test]
    fn every_so_many_samples_it_gives_what_it_would_give_at_each_in_even_pieces() {
        for length in [1, 3, 5, 9, 31, 63, 65, 127, 129, 255, MAX_BAND_TAPS] {
            let all = values(&band(length, 0));
            assert!(all[..length - 1].iter().all(Option::is_none));
            assert!(all[length - 1..].iter().all(Option::is_some));
            for log2 in 1..=crate::wire::rig::MAX_BAND_EVERY_LOG2 {
                let seen = values(&band(length, log2));
                for (n, (seen, all)) in seen.iter().zip(&all).enumerate() {
                    let due = n + 1 >= length && (n + 1 - length).is_multiple_of(1 << log2);
                    let wanted = all.filter(|_| due);
                    assert_eq!(*seen, wanted, "{length} taps, 2^{log2}, residual {n}");
                }
            }
        }
    }
}
