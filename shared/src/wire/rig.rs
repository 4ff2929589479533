//! The rig as host and device know it: what is wired to what, what one count of each sensor is
//! worth, inertia, filters, and what is normal.
//!
//! All of it is in SI units, and stands in the rig block once ([`crate::wire::rig_block`]).
//! [`Chain::new`](crate::chain::Chain::new) makes the chain's integers from it when a device or a
//! replay starts.

use crate::base::hum::Hum;
use crate::fault::{Checks, Error};
use crate::monitor::limits::Limits;
use crate::scalar::fixed::round_to_i64;
use crate::scalar::zero::plain_zero;
use crate::wire::wiring::Wiring;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// The most taps a derivative may have; odd, so that the delay is a whole number of samples.
pub const MAX_TAPS: usize = 129;
/// The most taps of the low-pass over the residual: a band that is narrow beside the sample rate
/// needs a long filter.
pub const MAX_BAND_TAPS: usize = 257;

/// The most that [`Rig::band_every_log2`] may be: a value at every 64th sample.
pub const MAX_BAND_EVERY_LOG2: u8 = 6;

/// The most samples by which a counter may be late or early: a board's skew is a part of one.
pub const MAX_COUNTER_DELAY: f64 = 2.0;

/// A linear-phase FIR filter with integer taps: `y = Σ taps[i]·x[n−i] · 2^−shift`.
///
/// The number of taps is odd and the same for the velocity and the acceleration filter of one rig,
/// so that both lag by `(taps − 1) / 2` samples. Taps are symmetric (low-pass, second derivative)
/// or antisymmetric (first derivative).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Taps<const MAX: usize = MAX_TAPS> {
    /// The taps, scaled by `2^shift`.
    pub taps: Vec<i32, MAX>,
    /// The binary exponent that turns the integer taps into 1/s (first derivative), 1/s² (second)
    /// or 1 (low-pass).
    pub shift: i8,
}

/// One axis of the rig in SI units. Which of its channels are there, [`Rig::wiring`] says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigAxis {
    /// Metres or radians per count of the displacement encoders.
    #[serde(serialize_with = "plain_zero")]
    pub displacement_step: f64,
    /// Metres or radians per count of the body position; 0 where no counter measures it, and the
    /// displacement stands in for it.
    #[serde(serialize_with = "plain_zero")]
    pub body_step: f64,
    /// m/s² or rad/s² per count of the accelerometers; 0 where none is wired, and the acceleration
    /// is derived from the body position, or from the displacement where there is no body
    /// position.
    #[serde(serialize_with = "plain_zero")]
    pub acceleration_step: f64,
    /// Newtons or newton-metres per count of the force channel.
    #[serde(serialize_with = "plain_zero")]
    pub force_step: f64,
    /// kg or kg·m²; 0 when the force channel already is the restoring force.
    #[serde(serialize_with = "plain_zero")]
    pub inertia: f64,
    /// True for `r = inertia·a − F`, false for `r = F − inertia·a`.
    pub inertia_minus_force: bool,
    /// N/m or N·m/rad of a known spring from the body to ground.
    #[serde(serialize_with = "plain_zero")]
    pub ground_stiffness: f64,
    /// N·s/m or N·m·s/rad of a known damper from the body to ground.
    #[serde(serialize_with = "plain_zero")]
    pub ground_damping: f64,
    /// What this force channel reads per newton or newton-metre on the other axis, and is taken
    /// off; 0 on one axis.
    #[serde(serialize_with = "plain_zero")]
    pub force_cross: f64,
    /// What one count of the input is worth that effects of the axis follow, in its unit; 0 where
    /// none is wired.
    #[serde(serialize_with = "plain_zero")]
    pub input_step: f64,
    /// The input at count 0, in the same unit.
    #[serde(serialize_with = "plain_zero")]
    pub input_zero: f64,
    /// By how many samples the force channel is late; negative when it is early.
    #[serde(serialize_with = "plain_zero")]
    pub force_delay_samples: f64,
    /// By how many samples the other channels are late.
    pub delays: ChannelDelays,
    /// The mains hum in this force channel, which an adaptive notch takes out.
    pub hum: Hum,
}

/// By how many samples channels are late because of how the board reads them; negative when they
/// are early.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChannelDelays {
    /// Both displacement counters, −[`MAX_COUNTER_DELAY`] to [`MAX_COUNTER_DELAY`].
    #[serde(serialize_with = "plain_zero")]
    pub displacement: f64,
    /// The body's counter, in the same range; 0 where the rig has none.
    #[serde(serialize_with = "plain_zero")]
    pub body: f64,
    /// The accelerometer; 0 where none is wired.
    #[serde(serialize_with = "plain_zero")]
    pub acceleration: f64,
    /// The input that effects follow; 0 where none is wired.
    #[serde(serialize_with = "plain_zero")]
    pub input: f64,
}

/// The rig: one or two axes, the sample rate, the filters that host and device share, and what the
/// model on it asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// The checksum of the blob of the model whose corrections of the force channels are in here.
    pub model_checksum: u32,
    /// Samples per second, in Hz.
    pub sample_rate_hz: f64,
    /// Which chip gives which count, and how the chips are set.
    pub wiring: Wiring,
    /// One or two axes, as many as are wired.
    pub axes: Vec<RigAxis, 2>,
    /// Filter that gives the first derivative of the displacement.
    pub velocity: Taps,
    /// Second derivative, of the same length.
    pub acceleration: Taps,
    /// The low-pass through which a residual goes before it is judged.
    pub band: Taps<MAX_BAND_TAPS>,
    /// Binary logarithm of the samples from one residual in the band to the next, 0 to
    /// [`MAX_BAND_EVERY_LOG2`]: what lies above the band is gone, so that fewer values than
    /// samples say all that there is to judge.
    pub band_every_log2: u8,
    /// What is normal; `None` until validation records were evaluated, and the monitor then only
    /// watches the sensors.
    pub limits: Option<Limits>,
}

/// How a filter's taps lie about its middle.
#[derive(Clone, Copy, PartialEq)]
enum Symmetry {
    Antisymmetric,
    Symmetric,
    SymmetricSumZero,
}

/// What the arithmetic of the filters relies on, of taps of at most so many; `wrong` names length
/// and shape.
fn check_taps(
    taps: &[i32],
    most: usize,
    symmetry: Symmetry,
    [wrong_length, wrong_shape]: [&'static str; 2],
    checks: &mut Checks,
) {
    let length = taps.len();
    let least = if length.is_multiple_of(2) {
        length + 1
    } else {
        1
    };
    checks.whole(wrong_length, length as i32, least as i32, most as i32);
    let sign = match symmetry {
        Symmetry::Antisymmetric => -1,
        _ => 1,
    };
    let mut mirrored = taps.iter().zip(taps.iter().rev());
    let is_symmetric = mirrored.all(|(&a, &b)| i64::from(a) == sign * i64::from(b));
    let sum: i64 = taps.iter().map(|&tap| i64::from(tap)).sum();
    let of_shape = is_symmetric && (symmetry != Symmetry::SymmetricSumZero || sum == 0);
    checks.whole(wrong_shape, i32::from(!of_shape), 0, 0);
    let sizes: u64 = taps.iter().map(|tap| u64::from(tap.unsigned_abs())).sum();
    // A sum over taps times 32-bit values must stay under 2⁶³.
    let quantity = "sum of the sizes of a filter's taps";
    checks.long(quantity, sizes, 1, u64::from(u32::MAX));
}

impl Rig {
    /// The sample rate in 10⁻⁶ Hz, as the device computes with it.
    pub fn sample_rate_uhz(&self) -> u64 {
        round_to_i64(1e6 * self.sample_rate_hz).unsigned_abs()
    }

    /// Checks every quantity: what the arithmetic of the chain relies on, what the chips can be set
    /// to, and the monitor's limits.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        self.check_chain()?;
        self.wiring.check()?;
        let Some(limits) = &self.limits else {
            return Ok(());
        };
        limits.check()?;
        let mut checks = Checks::new();
        let every_log2 = u32::from(self.band_every_log2);
        limits.check_for(self.axes.len(), every_log2, &mut checks);
        checks.done()
    }

    /// Checks what the arithmetic of the chain relies on. Whether a board has the chips that are
    /// wired does not matter to it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check_chain(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.within("sample rate in Hz", self.sample_rate_hz, 1.0, 1e6);
        self.check_filters(&mut checks);
        let axes = self.axes.len() as i32;
        checks.whole("axes of the rig", axes, 1, 2);
        let wired = self.wiring.axes.len() as i32;
        checks.whole("axes of the wiring", wired, axes, axes);
        for number in 0..self.axes.len() {
            self.check_axis(number, &mut checks);
        }
        checks.done()
    }

    fn check_filters(&self, checks: &mut Checks) {
        let (velocity, acceleration) = (&self.velocity.taps, &self.acceleration.taps);
        let (wanted, seen) = (velocity.len() as i32, acceleration.len() as i32);
        let quantity = "taps of the acceleration filter, against the velocity filter";
        checks.whole(quantity, seen, wanted, wanted);
        let of_velocity = [
            "taps of the velocity filter (an odd number)",
            "asymmetry of the velocity filter",
        ];
        let symmetry = Symmetry::Antisymmetric;
        check_taps(velocity, MAX_TAPS, symmetry, of_velocity, checks);
        let of_acceleration = [
            "taps of the acceleration filter (an odd number)",
            "asymmetry or sum of the acceleration filter",
        ];
        let symmetry = Symmetry::SymmetricSumZero;
        check_taps(acceleration, MAX_TAPS, symmetry, of_acceleration, checks);
        let of_band = [
            "taps of the band filter (an odd number)",
            "asymmetry of the band filter",
        ];
        let symmetry = Symmetry::Symmetric;
        check_taps(&self.band.taps, MAX_BAND_TAPS, symmetry, of_band, checks);
        let shift = i32::from(self.band.shift);
        checks.whole("shift of the band filter", shift, 1, 62);
        let quantity = "binary logarithm of the samples from one residual in the band to the next";
        let most = i32::from(MAX_BAND_EVERY_LOG2);
        checks.whole(quantity, i32::from(self.band_every_log2), 0, most);
    }

    fn check_axis(&self, number: usize, checks: &mut Checks) {
        let (Some(axis), Some(wired)) = (self.axes.get(number), self.wiring.axes.get(number))
        else {
            return;
        };
        // What a count is worth: above 0 where a channel is wired, 0 where it is not.
        let mut step = |quantity, value: f64, wired: bool| {
            let [least, most] = if wired {
                [f64::MIN_POSITIVE, 1e60]
            } else {
                [0.0; 2]
            };
            checks.within(quantity, value, least, most);
        };
        step("displacement step", axis.displacement_step, true);
        step("force per count", axis.force_step, true);
        step("body step", axis.body_step, wired.body.is_some());
        step("input step", axis.input_step, wired.input.is_some());
        let measured = wired.acceleration.iter().any(Option::is_some);
        step("acceleration step", axis.acceleration_step, measured);
        checks.within("inertia", axis.inertia, 0.0, 1e60);
        checks.within("ground stiffness", axis.ground_stiffness, 0.0, 1e60);
        checks.within("ground damping", axis.ground_damping, 0.0, 1e60);
        let most = if self.axes.len() == 2 { 1e60 } else { 0.0 };
        let quantity = "cross-talk of the force channel";
        checks.within(quantity, axis.force_cross, -most, most);
        // The chain says by how much it can make up for with its filters.
        let most = MAX_TAPS as f64;
        let late = axis.force_delay_samples;
        checks.within("force delay in samples", late, -most, most);
        let late = axis.delays.acceleration;
        checks.within("acceleration delay in samples", late, -most, most);
        let most = MAX_COUNTER_DELAY;
        let late = axis.delays.displacement;
        checks.within("displacement delay in samples", late, -most, most);
        let most = if wired.body.is_some() { most } else { 0.0 };
        let late = axis.delays.body;
        checks.within("body delay in samples", late, -most, most);
        let most = if wired.input.is_some() { 1e60 } else { 0.0 };
        checks.within("input at count 0", axis.input_zero, -most, most);
        let most = most.min(MAX_TAPS as f64);
        checks.within("input delay in samples", axis.delays.input, -most, most);
        let hum = &axis.hum;
        let (most, quantity) = (0.5 * self.sample_rate_hz, "frequency of a line in Hz");
        checks.within(quantity, hum.frequency_hz, 0.0, most);
        let [least, most] = if hum.is_none() {
            [0.0; 2]
        } else {
            [1e-60, 1e60]
        };
        checks.within("amplitude of a line", hum.amplitude, least, most);
    }
}
