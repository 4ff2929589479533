//! What the channels contribute to the measured force.

use crate::chain::scale::{MAX_FACTOR, MIN_FACTOR};
use crate::fault::Error;
use crate::scalar::fixed::{round_shift, round_to_i64, saturate};

/// Gains in force units per count as multipliers. Those of one kind have one shift, so that their
/// products are added up as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Terms {
    /// Of a derived acceleration and of the body's velocity, whose sums were shifted to where a
    /// gain is [`DERIVED_GAIN`] at most.
    derived: [i32; 2],
    /// Of codes: the accelerometer's, the own force's, the other axis's force's.
    codes: [i32; 3],
    /// Of the body's position, whose counts are fewer and worth more.
    position: i32,
    /// Down to force units times 2^[`PLACES`], of the codes and of the position.
    shifts: [u8; 2],
}

/// Binary places below the force unit that the sums keep until they are added up.
const PLACES: u8 = 8;
/// The largest gain of what was derived, in force units per count.
pub(super) const DERIVED_GAIN: f64 = 32.0;
/// Their shift: two of the largest gains are then 2³¹ together.
const DERIVED_SHIFT: u8 = 25;
/// The most that the sizes of the multipliers of one kind add up to: their products with any counts
/// stay within 2⁶² together.
const MAX_SIZES: u64 = 1 << 31;

/// The largest shift with which gains fit, and their multipliers: each is then off by less than
/// 2⁻²⁹ of all of them together.
fn fitted<const COUNT: usize>(gains: [f64; COUNT]) -> Result<([i32; COUNT], u8), Error> {
    let sizes: f64 = gains.iter().map(|gain| gain.abs()).sum();
    // Half a unit of each multiplier is left for rounding, and none is 2³¹.
    let most = (MAX_SIZES - 4) as f64;
    let (mut shift, mut unit) = (1, f64::from(2 << PLACES));
    Error::unless_within("force per count", sizes, 0.0, most / unit)?;
    while shift < 62 && sizes * unit * 2.0 <= most {
        (shift, unit) = (shift + 1, unit * 2.0);
    }
    Ok((gains.map(|gain| round_to_i64(gain * unit) as i32), shift))
}

impl Terms {
    /// Of the gains of a derived acceleration and the body's velocity; of accelerometer, own and
    /// other force; of the body's position.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when gains are not finite or too large, and when that of the force is
    /// too small.
    pub(super) fn new(derived: [f64; 2], codes: [f64; 3], position: f64) -> Result<Self, Error> {
        let [_, force, _] = codes.map(f64::abs);
        Error::unless_within("force per count", force, MIN_FACTOR, MAX_FACTOR)?;
        let (codes, of_codes) = fitted(codes)?;
        let ([position], of_position) = fitted([position])?;
        let unit = f64::from(1 << DERIVED_SHIFT);
        Ok(Self {
            derived: derived.map(|gain| round_to_i64(gain * unit) as i32),
            codes,
            position,
            shifts: [of_codes, of_position],
        })
    }

    /// Whether the body's velocity contributes.
    pub(super) fn is_damped(&self) -> bool {
        let [_, damping] = self.derived;
        damping != 0
    }

    /// What the counts contribute together, in force units, saturated.
    #[inline(always)]
    pub(super) fn force(&self, derived: [i32; 2], codes: [i32; 3], position: i32) -> i32 {
        let product = |multiplier: i32, count: i32| i64::from(multiplier) * i64::from(count);
        let ([a, b], [w, x]) = (self.derived, derived);
        let derived = product(a, w) + product(b, x);
        let ([a, b, c], [w, x, y]) = (self.codes, codes);
        let codes = product(a, w) + product(b, x) + product(c, y);
        let [of_codes, of_position] = self.shifts;
        let sum = round_shift(derived, u32::from(DERIVED_SHIFT - PLACES))
            + round_shift(codes, u32::from(of_codes))
            + round_shift(product(self.position, position), u32::from(of_position));
        // Under 2⁶¹ + 2⁶¹ + 2⁴⁵.
        saturate(round_shift(sum, u32::from(PLACES))).0
    }
}
