//! What the limits, their trial and their sums share: figures, and the step of a gross threshold.

use jointwatch_shared::monitor::OCTAVE;

/// The fewest judged blocks of validation from which limits are set.
pub(super) const MIN_BLOCKS: usize = 24;
/// Statistics of a gross change per axis, after the five others.
pub(super) const GROSS: [usize; 2] = [5, 6];

/// A threshold of a gross change as the limits hold it: in quarters of an octave, rounded up.
pub(super) fn quarters(threshold: f64) -> u8 {
    (4.0 * threshold / f64::from(OCTAVE))
        .ceil()
        .min(u8::MAX.into()) as u8
}
