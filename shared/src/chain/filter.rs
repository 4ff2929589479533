//! The chain's three linear-phase filters in integers: first derivative, second derivative,
//! low-pass.
//!
//! Encoder counters wrap at 2³². Both derivatives therefore work on the steps of a counter from
//! sample to sample, taken with wrapping subtraction: they stay right when a counter wraps, and a
//! large offset costs no precision. The taps of a derivative sum to zero, so that Σ tapᵢ·x[n−i] = Σ
//! Cᵢ·(x[n−i] − x[n−i−1]), where Cᵢ is the sum of the taps up to the i-th: the same number to the
//! bit, and on the device one multiplication for each step of both axes, as for the low-pass.

use crate::base::kernels::Kernels;
use crate::scalar::fixed::{round_shift, saturate};
use crate::wire::rig::MAX_TAPS;
use core::ops::Range;
use heapless::Vec;

/// The last `LENGTH` values of `CHANNELS` channels of both axes, each readable as one contiguous
/// window.
///
/// Every row is written twice, `LENGTH` places apart, so that a window never has to be put together
/// from two pieces: a filter is then one loop over two slices.
#[derive(Clone, Debug)]
pub struct History<const LENGTH: usize, const CHANNELS: usize = 1> {
    rows: [[[[i32; 2]; LENGTH]; 2]; CHANNELS],
    next: usize,
}

impl<const LENGTH: usize, const CHANNELS: usize> History<LENGTH, CHANNELS> {
    /// Before the first value: all zeros.
    pub const NEW: Self = Self {
        rows: [[[[0; 2]; LENGTH]; 2]; CHANNELS],
        next: 0,
    };

    /// Adds the newest row of every channel; the oldest is forgotten.
    #[inline(always)]
    pub fn push(&mut self, rows: [[i32; 2]; CHANNELS]) {
        let place = self.next;
        for ([first, second], row) in self.rows.iter_mut().zip(rows) {
            if let (Some(first), Some(second)) = (first.get_mut(place), second.get_mut(place)) {
                (*first, *second) = (row, row);
            }
        }
        self.next = if place + 1 < LENGTH { place + 1 } else { 0 };
    }

    /// Where the newest `length` rows lie, for [`Self::window`]; nowhere when `length` is more than
    /// `LENGTH`.
    #[inline(always)]
    pub fn newest(&self, length: usize) -> Range<usize> {
        let end = self.next + LENGTH;
        if length <= LENGTH {
            end - length..end
        } else {
            0..0
        }
    }

    /// The rows of a channel in such a place, oldest first; empty for a channel that is not there.
    #[inline(always)]
    pub fn window(&self, channel: usize, place: &Range<usize>) -> &[[i32; 2]] {
        let rows = self.rows.get(channel).map(|rows| rows.as_flattened());
        rows.and_then(|rows| rows.get(place.clone()))
            .unwrap_or_default()
    }
}

/// Steps from one sample to the next that the longest derivative sees.
pub const MAX_STEPS: usize = MAX_TAPS - 1;

/// Two counters of each axis, of its displacement and of its body: where they were in the middle of
/// the derivatives' window, and their steps over the window.
#[derive(Clone, Debug)]
pub struct Counters {
    steps: History<MAX_STEPS, 2>,
    newest: [[i32; 2]; 2],
    middle: [[i32; 2]; 2],
}

impl Counters {
    /// At rest at 0.
    pub const NEW: Self = Self {
        steps: History::NEW,
        newest: [[0; 2]; 2],
        middle: [[0; 2]; 2],
    };

    /// Takes the first counts: until then the joint counts as at rest there.
    pub fn begin(&mut self, counts: [[i32; 2]; 2]) {
        (self.newest, self.middle) = (counts, counts);
    }

    /// Takes the next counts; the middle of the window is `delay` samples ago, at most
    /// [`MAX_DELAY`].
    #[inline(always)]
    pub fn push(&mut self, counts: [[i32; 2]; 2], delay: usize) {
        let [[a, b], [c, d]] = counts;
        let [[old_a, old_b], [old_c, old_d]] = self.newest;
        self.steps.push([
            [a.wrapping_sub(old_a), b.wrapping_sub(old_b)],
            [c.wrapping_sub(old_c), d.wrapping_sub(old_d)],
        ]);
        self.newest = counts;
        let place = self.steps.newest(delay + 1);
        let step = |kind| {
            let window = self.steps.window(kind, &place);
            window.first().copied().unwrap_or_default()
        };
        let ([[a, b], [c, d]], [step_a, step_b], [step_c, step_d]) =
            (self.middle, step(0), step(1));
        self.middle = [
            [a.wrapping_add(step_a), b.wrapping_add(step_b)],
            [c.wrapping_add(step_c), d.wrapping_add(step_d)],
        ];
    }

    /// The counts in the middle of the window: displacements and bodies.
    pub fn middle(&self) -> &[[i32; 2]; 2] {
        &self.middle
    }

    /// The newest `length` steps of displacements and bodies, oldest first.
    #[inline(always)]
    pub fn steps(&self, length: usize) -> [&[[i32; 2]]; 2] {
        let place = self.steps.newest(length);
        [self.steps.window(0, &place), self.steps.window(1, &place)]
    }
}

/// `Σ tap·x` of a counter of both axes, the derivative in the middle of the window times `2^shift`,
/// for weights of [`weights_of_steps`] and as many steps.
///
/// Right as long as no step is 2³¹ or more and all counts of the window are within 2³¹ of the
/// middle one: with Σ|tap| < 2³² ([`crate::wire::rig::Rig::check`]) the sum is then under 2⁶³.
#[inline(always)]
pub fn derivative<K: Kernels>(weights: &[i32], steps: &[[i32; 2]]) -> [i64; 2] {
    K::products(weights, steps)
}

/// What a derivative's taps make of the steps of a counter, oldest step first: sums of taps, which
/// sum to zero.
pub fn weights_of_steps(
    taps: impl DoubleEndedIterator<Item = i32> + ExactSizeIterator,
) -> Vec<i32, MAX_STEPS> {
    let mut weights = Vec::new();
    let steps = taps.len().saturating_sub(1);
    let mut sum = 0_i32;
    // taps[i] multiplies x[n−i]. From the oldest value on, the sums are those of all other taps,
    // with the other sign.
    for tap in taps.rev().take(steps) {
        // Half of Σ|tap| < 2³² at most, because the taps of one sign are as many as those of the
        // other.
        sum = sum.wrapping_sub(tap);
        // One step less than there are taps.
        let _ = weights.push(sum);
    }
    weights
}

/// The longest delay of a channel that is not filtered: half of [`MAX_TAPS`], rounded down.
pub const MAX_DELAY: usize = MAX_TAPS / 2;

/// Places that a [`Delay`] has more than it remembers values.
pub const DELAY_ENDS: usize = 3;

/// A channel that only has to wait, for the filters unless told otherwise: the last `PLACES` − 3
/// values.
///
/// The first three places of the ring are behind its end once more, so that four neighbours always
/// lie in one piece.
#[derive(Clone, Debug)]
pub struct Delay<const PLACES: usize = { MAX_DELAY + 1 + DELAY_ENDS }> {
    values: [i32; PLACES],
    newest: usize,
}

impl<const PLACES: usize> Delay<PLACES> {
    /// Values that are remembered.
    const LENGTH: usize = PLACES - DELAY_ENDS;

    /// Before the first value: all zeros.
    pub const NEW: Self = Self {
        values: [0; PLACES],
        newest: 0,
    };

    /// Adds the newest value; the oldest is forgotten.
    #[inline(always)]
    pub fn push(&mut self, value: i32) {
        self.newest = if self.newest + 1 < Self::LENGTH {
            self.newest + 1
        } else {
            0
        };
        if let Some(slot) = self.values.get_mut(self.newest) {
            *slot = value;
        }
        if self.newest < DELAY_ENDS
            && let Some(slot) = self.values.get_mut(self.newest + Self::LENGTH)
        {
            *slot = value;
        }
    }

    /// The value that came `age` pushes before the newest; 0 when it is not remembered any more.
    #[inline(always)]
    pub fn delayed(&self, age: usize) -> i32 {
        if age >= Self::LENGTH {
            return 0;
        }
        self.values.get(self.place(age)).copied().unwrap_or(0)
    }

    /// The values that came `age`, `age` − 1, `age` − 2 and `age` − 3 pushes before the newest,
    /// where they are all there; else [`Self::four_apart`] has them.
    #[inline(always)]
    pub fn four(&self, age: usize) -> Option<&[i32; 4]> {
        if age < 3 || age >= Self::LENGTH {
            return None;
        }
        self.values.get(self.place(age)..)?.first_chunk()
    }

    /// [`Self::four`] at any age; the newest stands in for those after it.
    pub fn four_apart(&self, age: usize) -> [i32; 4] {
        [0, 1, 2, 3].map(|later| self.delayed(age.saturating_sub(later)))
    }

    #[inline(always)]
    fn place(&self, age: usize) -> usize {
        match self.newest.checked_sub(age) {
            Some(place) => place,
            None => (self.newest + Self::LENGTH).saturating_sub(age),
        }
    }
}

/// `value · 2^−shift`, rounded half up and saturated to `i32`, for a shift from 0 to 62.
#[inline(always)]
pub fn shift_round(value: i64, shift: i8) -> i32 {
    saturate(round_shift(value, u32::from(shift as u8))).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::kernels::Portable;
    use crate::wire::rig::Taps;
    use heapless::Vec;

    fn taps(values: &[i32], shift: i8) -> Taps {
        Taps {
            taps: Vec::from_slice(values).unwrap(),
            shift,
        }
    }

    /// Two channels, of which the second is the first upside down.
    fn filled(values: impl Iterator<Item = i32>) -> History<MAX_TAPS> {
        let mut history = History::NEW;
        values.for_each(|v| history.push([[v, v.wrapping_neg()]]));
        history
    }

    #[test]
    fn a_window_is_contiguous_and_in_order_at_every_phase_of_the_ring() {
        for pushed in MAX_TAPS..3 * MAX_TAPS {
            let history = filled(0..pushed as i32);
            for length in [1, 2, 7, MAX_TAPS] {
                let wanted = (pushed - length) as i32..pushed as i32;
                let window = history.window(0, &history.newest(length));
                let seen = window.iter().map(|[value, _]| *value);
                assert!(seen.eq(wanted), "pushed {pushed}, length {length}");
            }
            assert!(history.newest(MAX_TAPS + 1).is_empty());
        }
    }

    #[test]
    fn a_delay_gives_back_every_value_at_every_phase_of_the_ring() {
        let mut delay: Delay = Delay::NEW;
        for pushed in 0..4 * MAX_TAPS as i32 {
            delay.push(pushed);
            for age in 0..=MAX_DELAY as i32 {
                assert_eq!(delay.delayed(age as usize), (pushed - age).max(0));
                let four = [0, 1, 2, 3].map(|later| (pushed - (age - later).max(0)).max(0));
                assert_eq!(delay.four_apart(age as usize), four);
                let wanted = (age >= 3).then_some(&four);
                assert_eq!(delay.four(age as usize), wanted);
            }
            assert_eq!(delay.delayed(MAX_DELAY + 1), 0);
        }
    }

    #[test]
    fn derivatives_of_a_parabola_are_exact_and_survive_a_counter_that_wraps() {
        // Central differences: slope (x[n] − x[n−2]) / 2, curvature x[n] − 2x[n−1] + x[n−2], scaled
        // by 2¹.
        let first = taps(&[1, 0, -1], 1);
        let second = taps(&[2, -4, 2], 1);
        for offset in [0, 1_000_000, i32::MAX - 30] {
            let count = |n: i32| (3 * n * n + 5 * n).wrapping_add(offset);
            let mut counters = Counters::NEW;
            counters.begin([[count(0), 0], [0, count(0)]]);
            (0..10).for_each(|n| counters.push([[count(n), -n * n], [-n * n, count(n)]], 1));
            assert_eq!(counters.middle(), &[[count(8), -64], [-64, count(8)]]);
            let derivatives = |taps: &Taps| {
                let weights = weights_of_steps(taps.taps.iter().copied());
                counters
                    .steps(2)
                    .map(|steps| derivative::<Portable>(&weights, steps))
            };
            let (slope, curvature) = (2 * (6 * 8 + 5), 2 * 6);
            assert_eq!(derivatives(&first), [[slope, -32], [-32, slope]]);
            assert_eq!(derivatives(&second), [[curvature, -4], [-4, curvature]]);
        }
    }

    #[test]
    fn weights_of_steps_give_what_the_taps_give_at_the_largest_taps_and_counts() {
        let most = i32::MAX;
        for (taps, counts) in [
            (taps(&[most, 0, -most], 1), &[-most, 0, most][..]),
            (
                taps(&[-most / 2, most - 1, -most / 2], 1),
                &[-most, -1, most - 1],
            ),
            (taps(&[5, -3, 0, 3, -5], 1), &[-7, 11, 13, 17, 1 << 30]),
        ] {
            let mut counters = Counters::NEW;
            counters.begin([[counts[0]; 2]; 2]);
            counts[1..]
                .iter()
                .for_each(|count| counters.push([[*count; 2]; 2], 1));
            let products = taps.taps.iter().zip(counts.iter().rev());
            let wanted: i128 = products
                .map(|(tap, x)| i128::from(*tap) * i128::from(*x))
                .sum();
            let weights = weights_of_steps(taps.taps.iter().copied());
            for steps in counters.steps(weights.len()) {
                let seen = derivative::<Portable>(&weights, steps);
                assert_eq!(seen.map(i128::from), [wanted; 2], "{taps:?}");
            }
        }
    }

    #[test]
    fn rounding_is_half_up() {
        assert_eq!(
            [5, 6, 7, -5, -6, -7].map(|v| shift_round(v, 2)),
            [1, 2, 2, -1, -1, -2]
        );
        assert_eq!(shift_round(i64::MAX, 1), i32::MAX);
        assert_eq!(shift_round(i64::MIN, 1), i32::MIN);
    }
}
