//! The rig as the device knows it: what one count of each sensor means, the inertia, and the filters' taps.

use crate::base::hum::Hum;
use crate::fault::{Checks, Error};
use crate::scalar::fixed::round_to_i64;
use heapless::Vec;

/// The most taps a derivative may have; odd, so that the delay is a whole number of samples.
pub const MAX_TAPS: usize = 129;
/// The most taps of the low-pass over the residual: a band that is narrow beside the sample rate needs a long filter.
pub const MAX_BAND_TAPS: usize = 257;

/// The most that [`Rig::band_every_log2`] may be: a value at every 64th sample.
pub const MOST_BAND_EVERY_LOG2: u8 = 6;

/// The most samples by which a counter may be late or early: a board's skew is a part of one.
pub const MAX_COUNTER_DELAY: f64 = 2.0;

/// A linear-phase FIR filter with integer taps: `y = Σ taps[i]·x[n−i] · 2^−shift`.
///
/// The number of taps is odd and the same for the velocity and the acceleration filter of one rig, so that both lag
/// by `(taps − 1) / 2` samples. Taps are symmetric (low-pass, second derivative) or antisymmetric (first derivative).
#[derive(Clone, Debug, PartialEq)]
pub struct Taps<const MOST: usize = MAX_TAPS> {
    /// The taps, scaled by `2^shift`.
    pub taps: Vec<i32, MOST>,
    /// The binary exponent that turns the integer taps into 1/s (first derivative), 1/s² (second) or 1 (low-pass).
    pub shift: i8,
}

/// One axis of the rig in SI units per count.
#[derive(Clone, Debug, PartialEq)]
pub struct RigAxis {
    /// Metres or radians per count of the displacement encoders.
    pub displacement_step: f64,
    /// True when the relative displacement is the difference of two counters, first minus second.
    pub displacement_difference: bool,
    /// Metres or radians per count of the body position; 0 when the rig has none, and the displacement stands in for it.
    pub body_step: f64,
    /// m/s² or rad/s² per count of the accelerometer; 0 when acceleration is derived from the body position, or
    /// from the displacement where there is no body position.
    pub acceleration_step: f64,
    /// Newtons or newton-metres per count of the force channel.
    pub force_step: f64,
    /// kg or kg·m²; 0 when the force channel already is the restoring force.
    pub inertia: f64,
    /// True for `r = inertia·a − F`, false for `r = F − inertia·a`.
    pub inertia_minus_force: bool,
    /// N/m or N·m/rad of a known spring from the body to ground.
    pub ground_stiffness: f64,
    /// N·s/m or N·m·s/rad of a known damper from the body to ground.
    pub ground_damping: f64,
    /// What this force channel reads per newton or newton-metre on the other axis, and is taken off; 0 on one axis.
    pub force_cross: f64,
    /// By how many samples the force channel is late; negative when it is early.
    pub force_delay_samples: f64,
    /// By how many samples the other channels are late.
    pub delays: ChannelDelays,
    /// The line of the mains in this force channel, which is followed and taken out.
    pub hum: Hum,
}

/// By how many samples channels are late because of how the board reads them; negative when they are early.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelDelays {
    /// Both displacement counters, −[`MAX_COUNTER_DELAY`] to [`MAX_COUNTER_DELAY`].
    pub displacement: f64,
    /// The body's counter, in the same range; 0 where the rig has none.
    pub body: f64,
    /// The accelerometer.
    pub acceleration: f64,
}

/// The rig: one or two axes, the sample rate, and the filters that host and device share.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Samples per second, in Hz.
    pub sample_rate_hz: f64,
    /// One or two axes.
    pub axes: Vec<RigAxis, 2>,
    /// First derivative.
    pub velocity: Taps,
    /// Second derivative, of the same length.
    pub acceleration: Taps,
    /// The low-pass through which a residual goes before it is judged.
    pub band: Taps<MAX_BAND_TAPS>,
    /// Binary logarithm of the samples from one residual in the band to the next, 0 to [`MOST_BAND_EVERY_LOG2`]: what lies above the
    /// band is gone, so that fewer values than samples say all that there is to judge.
    pub band_every_log2: u8,
}

/// How a filter's taps lie about its middle.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Antisymmetric,
    Symmetric,
    SymmetricSumZero,
}

/// The taps of a filter, wherever they stand, from either end.
pub(crate) trait TapsFromEitherEnd:
    DoubleEndedIterator<Item = i32> + ExactSizeIterator + Clone
{
}

impl<I: DoubleEndedIterator<Item = i32> + ExactSizeIterator + Clone> TapsFromEitherEnd for I {}

/// What the arithmetic of the filters relies on, of taps of at most so many; `wrong` names length and shape.
#[inline(never)]
fn check_taps(
    taps: impl TapsFromEitherEnd,
    most: usize,
    shape: Shape,
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
    let sign = if shape == Shape::Antisymmetric { -1 } else { 1 };
    let (mut skewed, mut sum, mut sizes) = (0_i64, 0_i64, 0_u64);
    for (a, b) in taps.clone().zip(taps.rev()) {
        skewed |= i64::from(a) - sign * i64::from(b);
        sum += i64::from(a);
        sizes += u64::from(a.unsigned_abs());
    }
    let of_shape = skewed == 0 && (shape != Shape::SymmetricSumZero || sum == 0);
    checks.whole(wrong_shape, i32::from(!of_shape), 0, 0);
    // A sum over taps times 32-bit values must stay under 2⁶³.
    let quantity = "sum of the sizes of a filter's taps";
    checks.long(quantity, sizes, 1, u64::from(u32::MAX));
}

/// The three filters together: both derivatives and the low-pass, with its shift and the binary logarithm of the samples between its values.
pub(crate) fn check_filters<T: TapsFromEitherEnd>(
    [velocity, acceleration, band]: [T; 3],
    [band_shift, band_every_log2]: [i8; 2],
    checks: &mut Checks,
) {
    let (wanted, seen) = (velocity.len() as i32, acceleration.len() as i32);
    let quantity = "taps of the acceleration filter, against the velocity filter";
    checks.whole(quantity, seen, wanted, wanted);
    let of_velocity = [
        "taps of the velocity filter (an odd number)",
        "asymmetry of the velocity filter",
    ];
    check_taps(
        velocity,
        MAX_TAPS,
        Shape::Antisymmetric,
        of_velocity,
        checks,
    );
    let of_acceleration = [
        "taps of the acceleration filter (an odd number)",
        "asymmetry or sum of the acceleration filter",
    ];
    let shape = Shape::SymmetricSumZero;
    check_taps(acceleration, MAX_TAPS, shape, of_acceleration, checks);
    let of_band = [
        "taps of the band filter (an odd number)",
        "asymmetry of the band filter",
    ];
    check_taps(band, MAX_BAND_TAPS, Shape::Symmetric, of_band, checks);
    checks.whole("shift of the band filter", i32::from(band_shift), 1, 62);
    let quantity = "binary logarithm of the samples from one residual in the band to the next";
    let most = i32::from(MOST_BAND_EVERY_LOG2);
    checks.whole(quantity, i32::from(band_every_log2), 0, most);
}

impl Rig {
    /// The sample rate in 10⁻⁶ Hz, as the device computes with it.
    pub fn sample_rate_uhz(&self) -> u64 {
        round_to_i64(1e6 * self.sample_rate_hz).unsigned_abs()
    }

    /// Checks what the arithmetic of the chain relies on.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first quantity that is not usable.
    pub fn check(&self) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.within("sample rate in Hz", self.sample_rate_hz, 1.0, 1e6);
        let filters: [&[i32]; 3] = [
            &self.velocity.taps,
            &self.acceleration.taps,
            &self.band.taps,
        ];
        let filters = filters.map(|taps| taps.iter().copied());
        // What is above 127 turns negative, and is refused all the same.
        let band = [self.band.shift, self.band_every_log2.cast_signed()];
        check_filters(filters, band, &mut checks);
        checks.whole("axes of the rig", self.axes.len() as i32, 1, 2);
        for axis in &self.axes {
            self.check_axis(axis, &mut checks);
        }
        checks.done()
    }

    fn check_axis(&self, axis: &RigAxis, checks: &mut Checks) {
        let (step, force) = (axis.displacement_step, axis.force_step);
        checks.within("displacement step", step, f64::MIN_POSITIVE, 1e60);
        checks.within("force per count", force, f64::MIN_POSITIVE, 1e60);
        checks.within("body step", axis.body_step, 0.0, 1e60);
        checks.within("acceleration step", axis.acceleration_step, 0.0, 1e60);
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
        let most = if axis.body_step > 0.0 { most } else { 0.0 };
        let late = axis.delays.body;
        checks.within("body delay in samples", late, -most, most);
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
