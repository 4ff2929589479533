//! What blocks gain, and when that is more than chance.

use crate::diagnose::criteria;
use crate::study::series::mean;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// How often the blocks are drawn anew, with replacement.
pub(super) const DRAWS: usize = 300;

/// Mean and its standard error.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = mean(values);
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (square / (count - 1.0).max(1.0) / count).sqrt())
}

/// By how much each log error power falls from one list of blocks to another.
pub(crate) fn falls(from: &[f64], to: &[f64]) -> Vec<f64> {
    let pairs = from.iter().zip(to);
    pairs.map(|(from, to)| from - to).collect()
}

/// Whether log error power is gained by more than chance, from the gain of each block.
pub(crate) fn is_gained(gains: &[f64]) -> bool {
    is_more_than_chance(mean_and_error(gains))
}

/// The same from their mean and its standard error.
fn is_more_than_chance((mean, error): (f64, f64)) -> bool {
    mean > error.max(criteria::LEAST_DIFFERENCE)
}

/// Whether unseen blocks speak against an effect, from the gain of each block that let it in and of
/// each unseen one.
///
/// Blocks of the training records have let an effect in, by more than chance, so a difference
/// within the scatter of the unseen blocks is no reason to take it out. But it was also the best of
/// many that were tried on those blocks, and the unseen ones were not chosen by: what just
/// beat chance there has to be confirmed here. So an effect goes where the unseen blocks gain
/// without it by more than chance, and where both together, each with half the say whatever the
/// number of its blocks, no longer gain with it by more than chance.
pub(crate) fn is_refuted(seen: &[f64], unseen: &[f64]) -> bool {
    let ((mean, error), (of_unseen, error_of_unseen)) =
        (mean_and_error(seen), mean_and_error(unseen));
    let both = (0.5 * (mean + of_unseen), 0.5 * error.hypot(error_of_unseen));
    is_more_than_chance((-of_unseen, error_of_unseen)) || !is_more_than_chance(both)
}

/// Whether the error power of all blocks together rises from one list of their logs to another:
/// what a user sees of an effect that halves small errors in most blocks and doubles large ones in
/// a few.
pub(crate) fn is_raised(from: &[f64], to: &[f64]) -> bool {
    let power = |logs: &[f64]| logs.iter().map(|log| log.exp()).sum::<f64>();
    (power(to) / power(from)).ln() > criteria::LEAST_DIFFERENCE
}

/// How likely it is that blocks gain, from the gain of each: the share of draws in which they do.
pub(crate) fn chance_of_gain(gains: &[f64]) -> f64 {
    let mut rng = StdRng::seed_from_u64(0);
    let mut drawn = || {
        let draws = (0..gains.len()).map(|_| gains[rng.random_range(0..gains.len())]);
        draws.sum::<f64>() / gains.len() as f64
    };
    let gained = (0..DRAWS).filter(|_| drawn() > criteria::LEAST_DIFFERENCE);
    gained.count() as f64 / DRAWS as f64
}

#[cfg(test)]
mod tests {
    use super::{is_gained, is_raised, is_refuted};

    #[test]
    fn unseen_blocks_speak_against_an_effect_by_more_than_their_scatter() {
        let blocks = |mean: f64, scatter: f64| -> Vec<f64> {
            let signs = (0..24).map(|b| [1.0, -1.0][b % 2]);
            signs.map(|sign| mean + scatter * sign).collect()
        };
        let clear = blocks(1.0, 0.5);
        // Larger errors without a meaning: the standard error is 0.1.
        assert!(!is_refuted(&clear, &blocks(-0.05, 0.5)));
        assert!(is_refuted(&clear, &blocks(-0.2, 0.5)));
        // What just beat chance among many is confirmed or goes.
        let faint = blocks(0.05, 0.2);
        assert!(is_gained(&faint));
        assert!(is_refuted(&faint, &blocks(0.0, 0.2)));
        assert!(!is_refuted(&faint, &blocks(0.05, 0.2)));
    }

    #[test]
    fn what_doubles_a_few_large_errors_raises_them_though_most_blocks_gain() {
        let of = |quiet: f64, loud: f64| [vec![quiet; 20], vec![loud; 2]].concat();
        let (without, with) = (of(-12.0, -4.0), of(-13.4, -2.6));
        let gains: Vec<f64> = without.iter().zip(&with).map(|(b, a)| b - a).collect();
        assert!(is_gained(&gains) && !is_refuted(&gains, &gains));
        assert!(is_raised(&without, &with) && !is_raised(&with, &without));
        assert!(!is_raised(&without, &without));
    }
}
