//! A figure over several seeds: its median and its range.

use crate::text::table::rounded;
use serde::Serialize;
use std::fmt;

/// Median, least and most of a number that differs from seed to seed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the values lie below it.
    pub median: f64,
    /// The least of the values.
    pub least: f64,
    /// The largest of the values.
    pub most: f64,
}

impl Spread {
    /// Of some values; `None` when there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (least, most) = (*values.first()?, *values.last()?);
        let middle = values.len() / 2;
        Some(Self {
            median: 0.5 * (values[middle] + values[values.len() - 1 - middle]),
            least,
            most,
        })
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} ({} to {})",
            rounded(self.median),
            rounded(self.least),
            rounded(self.most)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_range_of_odd_and_even_counts() {
        let spread = Spread::of([5.0, 1.0, 30.0]).unwrap();
        assert_eq!((spread.median, spread.least, spread.most), (5.0, 1.0, 30.0));
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 8.0]).unwrap().median, 3.0);
        assert_eq!(Spread::of([]), None);
        assert_eq!(spread.to_string(), "5.00 (1.00 to 30.0)");
    }
}
