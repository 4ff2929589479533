//! The adaptive notch: mains hum in the measured force, a line in its spectrum, tracked sample by
//! sample and subtracted.
//!
//! The line is looked for in what the model leaves of the measured force, so that no force that the
//! model explains is taken for hum. A phasor (p, q) turns by the line's angle ω from sample to
//! sample; its first part is the line, and what the force still holds beside model and line, e,
//! corrects it:
//!
//! ```text
//! e = measured − p − predicted          p' = (p + g·e)·cos ω − q·sin ω          q' = (p + g·e)·sin ω + q·cos ω
//! ```
//!
//! That is the adaptive canceller with two weights and a reference in quadrature, least mean
//! squares (B. Widrow et al., Adaptive noise cancelling: principles and applications, Proc. IEEE 63
//! (1975) 1692–1716, pp. 1701–1703), seen from the turning frame: sine and cosine turn the weights
//! instead of being looked up at every sample. From the residual without the canceller to the one
//! with it, it is a notch at ω, as wide as g is large.
//!
//! The gain is 2/n at first, with which the phasor is the mean over the samples so far, and ends at
//! that of [`TIME_CONSTANT_S`]. The mains do not keep their frequency, and a notch that narrow
//! would leave most of a line a tenth of a hertz beside it; so the angle is a little more
//! or less than ω, by what the corrections turn the phasor in the mean: a loop of the second order
//! (F. M. Gardner, Phaselock Techniques, 3rd ed., Wiley 2005, ch. 2).
//! `docs/explanation/numerics.md` has what is left of a line.

use crate::base::hum::Hum;
use crate::fault::Error;
use crate::scalar::fixed::{mul_high_add, round_to_i64, saturate};
use crate::scalar::q::Q;
use crate::scalar::{Number, Scalar};

/// The line of one axis in machine numbers; all 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct AdaptiveNotch {
    /// Cosine and sine of the angle from one sample to the next, in Q31.
    turn: [i32; 2],
    /// The gain at the end, in 2⁻³².
    gain: i32,
    /// Binary places that the phasor has below the force unit.
    places: u8,
}

/// Seconds after which a line whose size or phase changes is followed to 1/e. The notch is 1/(π·2
/// s) = 0.16 Hz wide. A changed joint has to raise its alarm within as long (2 s where the model is
/// good): were it shaken by the mains' own frequency alone, 1 − 1/e of the change would still show
/// in the mean over that time, and under any other drive, whose lines are further than 0.16 Hz
/// away, all of it.
const TIME_CONSTANT_S: f64 = 2.0;
/// The gain of the first sample, in 2⁻³²: 2/16, as if sixteen samples had gone before. A mean over
/// fewer follows whatever comes first.
const FIRST: i32 = 1 << 29;
/// The most that the amplitude which the host found is shifted up to; more than half of it is
/// filled.
const FILLED: f64 = (1 << 26) as f64;
/// The most of either part of the phasor, in its places: four to eight times that amplitude. What
/// is more is no longer the line that was found, and stays in the residual.
const MAX: i32 = 1 << 28;
/// The most of the residual that a correction is made from, in the phasor's places: sixteen to 32
/// times that amplitude. A shock that the model has not does not turn the phasor round.
const MAX_LEFT: i32 = 1 << 30;
/// The most places below the force unit.
const MAX_PLACES: u8 = 24;
/// The most of the angle from sample to sample, in turns: a line closer to half the sample rate has
/// no phase of its own.
const MAX_TURNS: f64 = 0.49;
/// Places that an angle's deviation has below those of the angle. Held to the sine of ω there, it
/// is 1/128 of that at most: 0.4 Hz of 50 Hz.
const FINER: u32 = 7;
/// What turns residual times phasor and the square of the gain into a deviation: κ = γ·A²/2⁵², for
/// g = 2γ, times 2³⁸.
const TO_DEVIATION: u32 = 15;

impl AdaptiveNotch {
    /// The line of a channel whose restoring force counts `force_per_lsb`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a frequency that the sample rate does not resolve, or an amplitude
    /// that is no small part of the force.
    pub(super) fn new(hum: &Hum, sample_rate_hz: f64, force_per_lsb: f64) -> Result<Self, Error> {
        if hum.is_none() {
            return Ok(Self::default());
        }
        let turns = hum.frequency_hz / sample_rate_hz;
        let quantity = "frequency of a line, as a part of the sample rate";
        Error::unless_within(quantity, turns, 1e-6, MAX_TURNS)?;
        let amplitude = hum.amplitude / force_per_lsb;
        let quantity = "amplitude of a line in force units";
        Error::unless_within(quantity, amplitude, 1e-6, 2.0 * FILLED)?;
        let (mut places, mut filled) = (0, amplitude);
        while 2.0 * filled <= FILLED && places < MAX_PLACES {
            filled *= 2.0;
            places += 1;
        }
        // A little short of a whole phasor, by more than either part can be off: it never grows on
        // its own.
        let part = |q: Q| {
            let q31 = q.raw() / 2;
            (q31 - q31 / (1 << 28)) as i32
        };
        let turns = Q::from_f64(turns);
        let samples = TIME_CONSTANT_S * sample_rate_hz;
        let gain = round_to_i64(2.0 * (1_u64 << 32) as f64 / samples);
        Ok(Self {
            turn: [part((turns + Q::ratio(1, 4)).sine()), part(turns.sine())],
            gain: gain.clamp(1, i64::from(FIRST)) as i32,
            places,
        })
    }

    /// Whether there is none.
    pub(crate) fn is_none(&self) -> bool {
        self.gain == 0
    }

    /// The measured force without the line; the phasor goes on to the next sample, and unless it is
    /// `held` learns from this one.
    #[inline(always)]
    pub(super) fn take_out(
        &self,
        phasor: &mut Phasor,
        measured: i32,
        predicted: i32,
        held: bool,
    ) -> i32 {
        let places = u32::from(self.places & 31);
        let without = measured.saturating_sub(phasor.along >> places);
        let (mut along, across) = (phasor.along, phasor.across);
        let [cosine, sine] = self.turn;
        if !held {
            let most = MAX_LEFT >> places;
            let left = without.saturating_sub(predicted).min(most).max(-most) << places;
            let gain = FIRST.saturating_sub(phasor.fallen).max(self.gain);
            // Under 2³⁰ and under 2²⁷.
            along = mul_high_add(left, gain, along);
            // 2/n becomes 2/(n + 1): less half of its square, and a unit, so that roundings do not
            // stop it above the last gain.
            let less = (mul_high_add(gain, gain, 0) >> 1) + 1;
            phasor.fallen = FIRST.saturating_sub(gain).saturating_add(less);
            let round = mul_high_add(left, across, 0);
            let by = i64::from(round) * i64::from(mul_high_add(self.gain, self.gain, 0));
            let by = saturate(by >> TO_DEVIATION).0;
            let deviation = phasor.deviation.saturating_sub(by);
            phasor.deviation = deviation.min(sine).max(-sine);
        }
        // Twice what is at most 2²⁸, so that the upper word of a product with Q31 is the product.
        let twice = |part: i32| 2 * part.clamp(-MAX, MAX - 1);
        let (p, q) = (twice(along), twice(across));
        let along = mul_high_add(q, -sine, mul_high_add(p, cosine, 0));
        let across = mul_high_add(q, cosine, mul_high_add(p, sine, 0));
        // One part after the other, which keeps the phasor's length over a turn for any small
        // angle.
        let deviation = phasor.deviation >> FINER;
        phasor.along = mul_high_add(2 * across, -deviation, along);
        phasor.across = mul_high_add(2 * phasor.along, deviation, across);
        without
    }
}

/// The state of a notch. All zeros at first, as the rest of the state: a device has no first values
/// of it in its flash.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phasor {
    /// Both parts, in force units times 2^places.
    along: i32,
    across: i32,
    /// By how much the gain is less than [`FIRST`].
    fallen: i32,
    /// By how much the angle is more than ω, in 2⁻³⁸.
    deviation: i32,
}

impl Phasor {
    /// Nothing is known of the line yet.
    pub(super) const NEW: Self = Self {
        along: 0,
        across: 0,
        fallen: 0,
        deviation: 0,
    };
}

#[cfg(test)]
mod tests;
