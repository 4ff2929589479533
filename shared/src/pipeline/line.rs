//! A line of the mains in the measured force, followed sample by sample and taken out.
//!
//! The line is looked for in what the model leaves of the measured force, so that no force that the model explains is taken for hum. A
//! pointer (p, q) turns by the line's angle ω from sample to sample; its first part is the line, and what the force still holds beside model
//! and line, e, corrects it:
//!
//! ```text
//! e = measured − p − predicted          p' = (p + g·e)·cos ω − q·sin ω          q' = (p + g·e)·sin ω + q·cos ω
//! ```
//!
//! That is the adaptive canceller with two weights and a reference in quadrature, least mean squares (B. Widrow et al., Adaptive noise
//! cancelling: principles and applications, Proc. IEEE 63 (1975) 1692–1716, pp. 1701–1703), seen from the reference's turning
//! frame: the reference's sine and cosine turn the weights instead of being looked up, and the bits are the same everywhere. From the residual
//! without the canceller to the one with it, it is a notch at ω, as wide as g is large.
//!
//! The gain is 2/n at first, with which the pointer is the mean over the samples so far, and ends at that of [`TIME_CONSTANT_S`].
//! `docs/numerics.md` has what is left of a line, also of one that has another frequency than was thought.

use crate::error::{Checks, Error};
use crate::fixed::{round_shift, round_shift_32, round_to_i64};
use crate::hum::Hum;
use crate::layout::laid_out;
use crate::scalar::Scalar;
use crate::scalar::q::Q;

laid_out! {
/// The line of one axis in machine numbers; all 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Line {
    /// Cosine and sine of the angle from one sample to the next, in Q31.
    turn: [i32; 2],
    /// The gain at the end, in 2⁻³¹.
    gain: i32,
    /// Binary places that the pointer has below the force unit.
    places: u8,
}
}

/// Seconds after which a line that begins, or whose size or phase changes, is followed to 1/e. The notch is 1/(π·2 s) = 0.16 Hz wide. A changed
/// joint has to raise its alarm within as long (2 s where the model is good): were it shaken by the mains' own frequency alone, 1 − 1/e of the
/// change would still show in the mean over that time, and under any other drive, whose lines are further than 0.16 Hz away, all of it.
const TIME_CONSTANT_S: f64 = 2.0;
/// The gain of the first sample, in 2⁻³¹: 2/16, as if sixteen samples had gone before. A mean over fewer follows whatever comes first.
const FIRST: i32 = 1 << 28;
/// The most of either part of the pointer, in its places: four to eight times the amplitude that the host found, which fills
/// [`FILLED`]. What is more is no longer the line that was found, and stays in the residual.
const MOST: i64 = 1 << 29;
/// What the amplitude that the host found is shifted up to, half of it at least.
const FILLED: f64 = (1 << 27) as f64;
/// The most places below the force unit.
const MOST_PLACES: u8 = 24;
/// The most of the angle from sample to sample, in turns: a line closer to half the sample rate has no phase of its own.
const MOST_TURNS: f64 = 0.49;

impl Line {
    /// The line of a channel whose restoring force counts `force_per_lsb`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a frequency that the sample rate does not resolve, or an amplitude that is no small part of the force.
    pub(super) fn new(hum: &Hum, sample_rate_hz: f64, force_per_lsb: f64) -> Result<Self, Error> {
        if hum.is_none() {
            return Ok(Self::default());
        }
        let turns = hum.frequency_hz / sample_rate_hz;
        let quantity = "frequency of a line, as a part of the sample rate";
        Error::unless_within(quantity, turns, 1e-6, MOST_TURNS)?;
        let amplitude = hum.amplitude / force_per_lsb;
        let quantity = "amplitude of a line in force units";
        Error::unless_within(quantity, amplitude, f64::MIN_POSITIVE, 2.0 * FILLED)?;
        let (mut places, mut filled) = (0, amplitude);
        while 2.0 * filled <= FILLED && places < MOST_PLACES {
            filled *= 2.0;
            places += 1;
        }
        // A little short of a whole pointer, by more than either part can be off: it never grows on its own.
        let part = |q: Q| {
            let q31 = q.raw() / 2;
            (q31 - q31 / (1 << 28)) as i32
        };
        let turns = Q::from_f64(turns);
        let samples = TIME_CONSTANT_S * sample_rate_hz;
        let gain = round_to_i64(2.0 * (1_u64 << 31) as f64 / samples);
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

    /// Checks that it is a turn of a pointer that does not grow, and that nothing can overflow.
    pub(crate) fn check(&self, checks: &mut Checks) {
        let [cosine, sine] = self.turn;
        if self.is_none() {
            let wrong = i32::from(*self != Self::default());
            checks.whole("numbers of a line that is not there", wrong, 0, 0);
            return;
        }
        checks.whole("sine of the turn of a line", sine, 1, i32::MAX);
        let square = |part: i32| (i64::from(part) * i64::from(part)) as u64;
        let (length, whole) = (square(cosine) + square(sine), 1 << 62);
        let quantity = "square of the length that a line's turn leaves";
        checks.long(quantity, length, whole - (1 << 37), whole);
        checks.whole("gain of a line", self.gain, 1, FIRST);
        let (places, most) = (i32::from(self.places), i32::from(MOST_PLACES));
        checks.whole("binary places of a line", places, 0, most);
    }

    /// The measured force without the line; the pointer goes on to the next sample, and unless it is `held` learns from this one.
    #[inline(always)]
    pub(super) fn take_out(
        &self,
        pointer: &mut Pointer,
        measured: i32,
        predicted: i32,
        held: bool,
    ) -> i32 {
        let places = u32::from(self.places.min(MOST_PLACES));
        let without = measured.saturating_sub(round_shift_32(pointer.along, places));
        let (mut along, across) = (i64::from(pointer.along), i64::from(pointer.across));
        if !held {
            let left = i64::from(without.saturating_sub(predicted));
            along += round_shift(left * i64::from(pointer.gain), 31 - places);
            // 2/n becomes 2/(n + 1): less half of its square, and a unit, so that roundings do not stop it above the last gain.
            let gain = i64::from(pointer.gain);
            let less = (gain * gain >> 32) as i32 + 1;
            pointer.gain = (pointer.gain - less).max(self.gain);
        }
        let held_to = |part: i64| part.clamp(-MOST, MOST) as i32;
        let (along, across) = (held_to(along), held_to(across));
        let [cosine, sine] = self.turn;
        let product = |a: i32, b: i32| i64::from(a) * i64::from(b);
        // Under 2³⁰, as both parts are at most 2²⁹.
        pointer.along = round_shift(product(along, cosine) - product(across, sine), 31) as i32;
        pointer.across = round_shift(product(along, sine) + product(across, cosine), 31) as i32;
        without
    }
}

/// What moves of a line: the pointer, in force units times 2^places, and the gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pointer {
    along: i32,
    across: i32,
    gain: i32,
}

impl Pointer {
    /// Nothing is known of the line yet.
    pub(super) const NEW: Self = Self {
        along: 0,
        across: 0,
        gain: FIRST,
    };
}
