//! Sums that do not depend on the order in which they are summed: integers of 2⁻⁶⁴ in 128 bits.
//!
//! What is added is rounded to a whole number of 2⁻⁶⁴ once; integers then add up to the same bits
//! in any order and any grouping. A superaccumulator would keep every bit of every summand, in 272
//! bytes a sum instead of 16; what is summed here is brought to the size of 1 first, so its bits
//! below 2⁻⁶⁴ lie under the rounding of the sum it came from.

use crate::text::error::{Error, Result};

/// 2⁶⁴: units in 1.
const ONE: f64 = 18_446_744_073_709_551_616.0;

/// The largest summand: a sum holds 2³⁰ of them without leaving 128 bits.
const LARGEST: f64 = (1_u64 << 33) as f64;

/// Sums side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Exact(Vec<i128>);

impl Exact {
    /// So many sums of nothing.
    pub(crate) fn zeros(count: usize) -> Self {
        Self(vec![0; count])
    }

    /// Adds a number to one of the sums.
    ///
    /// # Errors
    /// One clause when it, or the sum, has no room in 128 bits.
    pub(crate) fn add(&mut self, at: usize, value: f64) -> Result<()> {
        if value.is_nan() || value.abs() > LARGEST {
            return Err(too_large());
        }
        // A product with a power of two is exact; the conversion then drops what is below one unit.
        self.plus(at, (value * ONE) as i128)
    }

    /// Adds all sums of another list, which is as long.
    ///
    /// # Errors
    /// As [`Exact::add`].
    pub(crate) fn add_all(&mut self, other: &Self) -> Result<()> {
        let mut others = other.0.iter().enumerate();
        others.try_for_each(|(at, more)| self.plus(at, *more))
    }

    fn plus(&mut self, at: usize, units: i128) -> Result<()> {
        self.0[at] = self.0[at].checked_add(units).ok_or_else(too_large)?;
        Ok(())
    }

    /// One of the sums, rounded to 53 bits.
    pub(crate) fn value(&self, at: usize) -> f64 {
        self.0[at] as f64 / ONE
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Their bytes, 16 each, the lowest first.
    pub(crate) fn bytes(&self) -> impl Iterator<Item = [u8; 16]> {
        self.0.iter().map(|sum| sum.to_le_bytes())
    }

    /// The sums that such bytes hold; a rest of less than 16 bytes is left out.
    pub(crate) fn of_bytes(bytes: &[u8]) -> Self {
        let (sums, _) = bytes.as_chunks::<16>();
        Self(sums.iter().map(|sum| i128::from_le_bytes(*sum)).collect())
    }
}

fn too_large() -> Error {
    Error::data(
        "it moves, or is pushed, so far beyond the study's own training records that the sums have no room for it; check its units, \
         or list such a record in study.toml",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_floats_lose_is_kept_in_any_order() {
        let values = [1e9, 1.0 / 3.0, -1e9, 2f64.powi(-60), -1e-3, 7.25];
        let sum = |order: &[usize]| {
            let mut exact = Exact::zeros(1);
            order.iter().for_each(|i| exact.add(0, values[*i]).unwrap());
            exact
        };
        let forwards = sum(&[0, 1, 2, 3, 4, 5]);
        assert_eq!(forwards, sum(&[5, 3, 1, 0, 2, 4]));
        let mut halves = sum(&[2, 4]);
        halves.add_all(&sum(&[0, 5, 1, 3])).unwrap();
        assert_eq!(forwards, halves);
        let truth = 1.0 / 3.0 + 2f64.powi(-60) - 1e-3 + 7.25;
        assert!((forwards.value(0) - truth).abs() < 2.0 * f64::EPSILON * truth);
        let bytes: Vec<u8> = forwards.bytes().flatten().collect();
        assert_eq!(Exact::of_bytes(&bytes), forwards);
    }

    #[test]
    fn what_has_no_room_is_refused() {
        let mut exact = Exact::zeros(2);
        for bad in [f64::NAN, f64::INFINITY, -1e10] {
            assert!(exact.add(1, bad).is_err(), "{bad}");
        }
        assert_eq!(exact, Exact::zeros(2));
        let full = Exact(vec![i128::MAX, 0]);
        assert!(exact.add_all(&full).is_ok() && exact.add_all(&full).is_err());
    }
}
