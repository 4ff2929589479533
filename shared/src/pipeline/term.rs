//! What one channel contributes to the measured force.

use crate::error::{Checks, Error};
use crate::fixed::round_shift;
use crate::layout::laid_out;
use crate::scale::factor;

laid_out! {
/// A gain in force units per count, as a multiplier of 28 to 29 bits and a shift; no contribution when the multiplier is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Term {
    multiplier: i32,
    /// Down to force units times 2^[`TERM_PLACES`].
    shift: u8,
}
}

/// Binary places below the force unit that terms keep until they are added up.
pub(super) const TERM_PLACES: i8 = 8;

impl Term {
    pub(super) fn new(gain: f64) -> Result<Self, Error> {
        if gain == 0.0 {
            return Ok(Self::default());
        }
        let (multiplier, shift) = factor("force per count", gain)?;
        let most = 1_u64 << (28 - TERM_PLACES);
        Error::unless_within("force per count", gain.abs(), 0.0, most as f64)?;
        let shift = (shift - TERM_PLACES).clamp(0, 62) as u8;
        Ok(Self { multiplier, shift })
    }

    /// Checks that no count can make it overflow, and that nothing is written in one way.
    pub(super) fn check(self, checks: &mut Checks) {
        let most = 1 << 29;
        checks.whole("multiplier of a force", self.multiplier, -most, most);
        let most = if self.is_none() { 0 } else { 62 };
        checks.whole("shift of a force", i32::from(self.shift), 0, most);
    }

    /// Whether it contributes nothing.
    pub(super) fn is_none(self) -> bool {
        self.multiplier == 0
    }

    /// The contribution of a count, in force units times 2^[`TERM_PLACES`]; under 2⁶⁰ whatever the count, so that five add up.
    #[inline(always)]
    pub(super) fn of(self, counts: i32) -> i64 {
        let product = i64::from(self.multiplier) * i64::from(counts);
        round_shift(product, u32::from(self.shift))
    }
}
