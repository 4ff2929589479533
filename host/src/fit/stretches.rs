//! Which rows of long records a fit of effects looks at.
//!
//! A handful of parameters is known to a part in thousands from some hundred thousand rows, and
//! every further row costs as much as the first. So of more rows than enough, stretches are taken
//! that are spread evenly over all records: each long enough for laws with memory to forget where
//! they began, and so many that slow changes over the records are seen.

use crate::signal::motion::Motion;
use std::ops::Range;

/// Rows that are enough: 2⁻¹⁹ of the variance of a row is left of noise.
const ENOUGH: usize = 1 << 19;
/// Rows of one stretch.
const STRETCH: usize = 1 << 15;

/// The rows to look at, a list per record.
pub(crate) struct Stretches(Vec<Vec<Range<usize>>>);

impl Stretches {
    /// For records of so many rows; none where all of them are looked at.
    pub(crate) fn of(rows: &[usize]) -> Option<Self> {
        let all: usize = rows.iter().sum();
        if all <= ENOUGH {
            return None;
        }
        let of_one = |rows: &usize| {
            let count = (*rows as f64 * ENOUGH as f64 / all as f64 / STRETCH as f64).round();
            let count = (count as usize).max(1);
            let length = STRETCH.min(*rows);
            // Each in the middle of its part of the record.
            let middle = |n: usize| rows * (2 * n + 1) / (2 * count);
            let start = |n: usize| middle(n).saturating_sub(length / 2).min(rows - length);
            (0..count).map(|n| start(n)..start(n) + length).collect()
        };
        Some(Self(rows.iter().map(of_one).collect()))
    }

    /// The stretches of the record at `index`.
    pub(crate) fn cut(&self, index: usize, motion: &Motion) -> Vec<Motion> {
        let stretches = self.0[index].iter();
        stretches.map(|rows| motion.cut(rows.clone())).collect()
    }

    /// What is said of it, of so many rows.
    pub(crate) fn in_words(&self, all: usize) -> String {
        let rows: usize = self.0.iter().flatten().map(|r| r.len()).sum();
        let count = self.0.iter().map(Vec::len).sum::<usize>();
        format!(
            "the effects were fitted to {rows} of the {all} training rows, in {count} stretches spread evenly over the records; errors are \
             those on all rows"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_rows_are_spread_evenly_over_all_records() {
        assert!(Stretches::of(&[ENOUGH / 2, ENOUGH / 2]).is_none());
        let rows = [2_000_000, 40_000, 700_000];
        let chosen = Stretches::of(&rows).unwrap();
        let total: usize = chosen.0.iter().flatten().map(|r| r.len()).sum();
        assert!(
            (ENOUGH - STRETCH..ENOUGH + 2 * STRETCH).contains(&total),
            "{total}"
        );
        for (stretches, rows) in chosen.0.iter().zip(rows) {
            assert!(
                stretches
                    .iter()
                    .all(|r| r.end <= rows && r.len() == STRETCH)
            );
            assert!(stretches.windows(2).all(|w| w[0].end <= w[1].start));
            let before = stretches[0].start;
            let after = rows - stretches[stretches.len() - 1].end;
            assert!(before.abs_diff(after) <= STRETCH, "{stretches:?}");
        }
    }
}
