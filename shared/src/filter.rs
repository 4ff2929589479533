//! The chain's three linear-phase filters in integers: first derivative, second derivative, low-pass.
//!
//! Encoder counters wrap at 2³². Both derivatives therefore work on differences of counts only, taken with wrapping
//! subtraction: they stay right when a counter wraps, and a large offset costs no precision.

use crate::fixed::{round_shift, saturate};
use crate::rig::{MAX_TAPS, Taps};

/// The last `LENGTH` values of one channel, readable as one contiguous window.
///
/// Every value is written twice, `LENGTH` places apart, so that a window never has to be put together from two
/// pieces: a filter is then one loop over two slices.
#[derive(Clone, Debug)]
pub struct History<const LENGTH: usize = MAX_TAPS> {
    values: [[i32; LENGTH]; 2],
    next: usize,
}

impl<const LENGTH: usize> Default for History<LENGTH> {
    fn default() -> Self {
        Self {
            values: [[0; LENGTH]; 2],
            next: 0,
        }
    }
}

impl<const LENGTH: usize> History<LENGTH> {
    /// Adds the newest value; the oldest is forgotten.
    pub fn push(&mut self, value: i32) {
        for copy in &mut self.values {
            if let Some(slot) = copy.get_mut(self.next) {
                *slot = value;
            }
        }
        self.next = if self.next + 1 < LENGTH {
            self.next + 1
        } else {
            0
        };
    }

    /// The newest `length` values, oldest first; empty when `length` is more than `LENGTH`.
    pub fn window(&self, length: usize) -> &[i32] {
        let end = self.next + LENGTH;
        match end.checked_sub(length) {
            Some(start) if length <= LENGTH => {
                self.values.as_flattened().get(start..end).unwrap_or(&[])
            }
            _ => &[],
        }
    }

    /// The value that came `age` pushes before the newest; 0 when `age` is `LENGTH` or more.
    pub fn delayed(&self, age: usize) -> i32 {
        self.window(age + 1).first().copied().unwrap_or(0)
    }
}

/// The longest delay of a channel that is not filtered: half of [`MAX_TAPS`], rounded down.
pub const MAX_DELAY: usize = MAX_TAPS / 2;

/// A channel that only has to wait, for the filters unless told otherwise: the last `LENGTH` values.
#[derive(Clone, Debug)]
pub struct Delay<const LENGTH: usize = { MAX_DELAY + 1 }> {
    values: [i32; LENGTH],
    newest: usize,
}

impl<const LENGTH: usize> Default for Delay<LENGTH> {
    fn default() -> Self {
        Self {
            values: [0; LENGTH],
            newest: 0,
        }
    }
}

impl<const LENGTH: usize> Delay<LENGTH> {
    /// Adds the newest value; the oldest is forgotten.
    pub fn push(&mut self, value: i32) {
        self.newest = if self.newest + 1 < LENGTH {
            self.newest + 1
        } else {
            0
        };
        if let Some(slot) = self.values.get_mut(self.newest) {
            *slot = value;
        }
    }

    /// The value that came `age` pushes before the newest; 0 when `age` is `LENGTH` or more.
    pub fn delayed(&self, age: usize) -> i32 {
        let place = match self.newest.checked_sub(age) {
            Some(place) => place,
            None => (self.newest + LENGTH).saturating_sub(age),
        };
        if age >= LENGTH {
            return 0;
        }
        self.values.get(place).copied().unwrap_or(0)
    }
}

/// `Σ tap·x` with antisymmetric taps, oldest value first: the slope in the middle of the window, times `2^shift`.
///
/// No overflow: |x₊ − x₋| < 2³¹ and Σ|tap| < 2³² ([`crate::rig::Rig::check`]) keep the sum under 2⁶³.
pub fn slope(taps: &Taps, history: &History) -> i64 {
    let window = history.window(taps.taps.len());
    let half = window.len() / 2;
    let late = window.iter().rev().take(half);
    let early = window.iter().take(half);
    // taps[i] multiplies x[n−i]: the first tap belongs to the newest value.
    taps.taps
        .iter()
        .zip(late.zip(early))
        .map(|(&tap, (&new, &old))| tap as i64 * new.wrapping_sub(old) as i64)
        .sum()
}

/// `Σ tap·x` with symmetric taps that sum to zero: the curvature in the middle of the window, times `2^shift`.
pub fn curvature(taps: &Taps, history: &History) -> i64 {
    let window = history.window(taps.taps.len());
    let half = window.len() / 2;
    let Some(&middle) = window.get(half) else {
        return 0;
    };
    let late = window.iter().rev().take(half);
    let early = window.iter().take(half);
    taps.taps
        .iter()
        .zip(late.zip(early))
        .map(|(&tap, (&new, &old))| {
            tap as i64 * (new.wrapping_sub(middle) as i64)
                + tap as i64 * (old.wrapping_sub(middle) as i64)
        })
        .sum()
}

/// `Σ tap·x` with symmetric taps, rounded to nearest and saturated: the window's low-passed middle.
pub fn low_pass<const MOST: usize>(taps: &Taps<MOST>, history: &History<MOST>) -> i32 {
    let window = history.window(taps.taps.len());
    let sum: i64 = taps
        .taps
        .iter()
        .zip(window)
        .map(|(&tap, &x)| tap as i64 * x as i64)
        .sum();
    shift_round(sum, taps.shift)
}

/// `value · 2^−shift`, rounded half up and saturated to `i32`; a shift outside 1..=62 counts as the nearest in it.
pub fn shift_round(value: i64, shift: i8) -> i32 {
    saturate(round_shift(value, shift.clamp(1, 62) as u32)).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Vec;

    fn taps(values: &[i32], shift: i8) -> Taps {
        Taps {
            taps: Vec::from_slice(values).unwrap(),
            shift,
        }
    }

    fn filled(values: impl Iterator<Item = i32>) -> History {
        let mut history = History::default();
        values.for_each(|v| history.push(v));
        history
    }

    #[test]
    fn a_window_is_contiguous_and_in_order_at_every_phase_of_the_ring() {
        for pushed in MAX_TAPS..3 * MAX_TAPS {
            let history = filled(0..pushed as i32);
            for length in [1, 2, 7, MAX_TAPS] {
                let wanted = (pushed - length) as i32..pushed as i32;
                assert!(
                    history.window(length).iter().copied().eq(wanted),
                    "pushed {pushed}, length {length}"
                );
            }
            assert_eq!(history.delayed(5), pushed as i32 - 6);
            assert!(history.window(MAX_TAPS + 1).is_empty());
        }
    }

    #[test]
    fn a_delay_gives_back_every_value_at_every_phase_of_the_ring() {
        let mut delay: Delay = Delay::default();
        for pushed in 0..4 * MAX_TAPS as i32 {
            delay.push(pushed);
            for age in 0..=MAX_DELAY as i32 {
                assert_eq!(delay.delayed(age as usize), (pushed - age).max(0));
            }
            assert_eq!(delay.delayed(MAX_DELAY + 1), 0);
        }
    }

    #[test]
    fn derivatives_of_a_parabola_are_exact_and_survive_a_counter_that_wraps() {
        // Central differences: slope (x[n] − x[n−2]) / 2, curvature x[n] − 2x[n−1] + x[n−2], scaled by 2¹.
        let first = taps(&[1, 0, -1], 1);
        let second = taps(&[2, -4, 2], 1);
        for offset in [0, 1_000_000, i32::MAX - 30] {
            let history = filled((0..10).map(|n: i32| (3 * n * n + 5 * n).wrapping_add(offset)));
            assert_eq!(slope(&first, &history), 2 * (6 * 8 + 5));
            assert_eq!(curvature(&second, &history), 2 * 6);
        }
    }

    #[test]
    fn the_low_pass_keeps_a_constant_and_saturates_at_the_rails() {
        let mean = taps(&[1 << 20, 1 << 21, 1 << 20], 22);
        assert_eq!(low_pass(&mean, &filled([7; 5].into_iter())), 7);
        assert_eq!(
            low_pass(&mean, &filled([i32::MIN; 5].into_iter())),
            i32::MIN
        );
        let gain_two = taps(&[1 << 21, 1 << 22, 1 << 21], 22);
        assert_eq!(
            low_pass(&gain_two, &filled([i32::MAX; 5].into_iter())),
            i32::MAX
        );
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
