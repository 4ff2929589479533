//! One axis of the chain: SI values into machine numbers once, then positions, velocities and the
//! measured force in them.

use super::adaptive_notch::{AdaptiveNotch, Phasor};
use super::channel::{COUNTER_PLACES, Channel, Settling, in_time};
use super::raw::RawAxis;
use super::term::{DERIVED_GAIN, Terms};
use crate::base::axis::{Axis, Input};
use crate::chain::filter::{Delay, shift_round};
use crate::chain::scale::Scale;
use crate::fault::{Checks, Error};
use crate::wire::rig::{Rig, RigAxis};
use crate::wire::wiring::AxisWiring;

/// Where a channel's acceleration comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Acceleration {
    /// The force channel already is the restoring force.
    None,
    /// An accelerometer, where the wiring has one on the axis.
    Logged,
    /// The second derivative of the body's counter, or of the displacement where there is none.
    Derived,
}

/// One axis in machine numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AxisChain {
    pub(super) difference: bool,
    pub(super) has_body: bool,
    pub(super) position: Scale,
    pub(super) velocity: Scale,
    /// Binary exponent between the slope filter's sum and `velocity`'s input.
    pub(super) velocity_shift: i8,
    pub(super) acceleration: Acceleration,
    /// Binary exponent between the curvature filter's sum and `inertia`'s input.
    pub(super) curvature_shift: i8,
    /// Binary exponent between the body's slope sum and `damping`'s input.
    pub(super) body_velocity_shift: i8,
    /// What the channels contribute to the measured force.
    pub(super) terms: Terms,
    pub(super) force: Channel,
    /// What effects of the axis follow, where they follow anything.
    input: Option<FollowedInput>,
    /// The accelerometer, where it is not in time.
    pub(super) late_acceleration: Option<Channel>,
    /// The counters, where they are not in time.
    pub(super) late_displacement: Option<Channel>,
    pub(super) late_body: Option<Channel>,
    /// Takes the mains hum out of the measured force.
    pub(super) notch: AdaptiveNotch,
}

/// Bits by which an intermediate derivative is coarser than the force unit; gives it a range of 2³⁵
/// force units.
const DERIVATIVE_HEADROOM: f64 = DERIVED_GAIN / 2.0;

/// Units of a state at the edge of the training range: Q31.
const FULL_SCALE: f64 = (1_u64 << 31) as f64;

/// Range of the slope before scaling: one training half-range is 2²⁸ to 2²⁹, so a state may be four
/// times outside the training range before its own number saturates.
const VELOCITY_RANGE: f64 = (1_u64 << 29) as f64;

/// Binary exponent `s` with `value·2^−s` just under `wanted`, and the value after it.
fn shift_to(quantity: &'static str, value: f64, wanted: f64) -> Result<(i8, f64), Error> {
    if !(value.is_finite() && value > 0.0) {
        return Err(Error::OutOfRange {
            quantity,
            seen: value,
            least: f64::MIN_POSITIVE,
            most: f64::MAX,
        });
    }
    let (mut shift, mut scaled) = (0_i8, value);
    while scaled > wanted && shift < 62 {
        scaled /= 2.0;
        shift += 1;
    }
    if shift == 0 || scaled > wanted {
        // A filter whose sums are this small has too few bits, one whose sums are this large would
        // overflow.
        return Err(Error::OutOfRange {
            quantity,
            seen: value,
            least: wanted,
            most: wanted * (1_u64 << 62) as f64,
        });
    }
    Ok((shift, scaled))
}

/// How far a derivative's sum is shifted down, and the signed gain it then has: 16 to 32 force
/// units per count.
fn derivative_gain(quantity: &'static str, unit: f64, sign: f64) -> Result<(i8, f64), Error> {
    let (shift, scaled) = shift_to(quantity, DERIVATIVE_HEADROOM / unit, 1.0)?;
    Ok((shift, sign * DERIVATIVE_HEADROOM / scaled))
}

/// `2^shift` as a real number.
fn power_of_two(shift: i8) -> f64 {
    let step = if shift < 0 { 0.5 } else { 2.0 };
    (0..shift.unsigned_abs()).fold(1.0, |power, _| power * step)
}

/// The scale of the velocity, and how far the slope filter's sum is shifted down before it.
fn velocity_scale(axis: &RigAxis, trained: &Axis, rig: &Rig) -> Result<(i8, Scale), Error> {
    let v = &trained.velocity;
    // One unit of the slope filter's sum is this many m/s.
    let slope_unit = axis.displacement_step / power_of_two(rig.velocity.shift);
    let (shift, half_range) = shift_to(
        "velocity resolution against its training range",
        v.half_range / slope_unit,
        VELOCITY_RANGE,
    )?;
    let scale = Scale::new(
        "velocity scale",
        FULL_SCALE / half_range,
        half_range * (v.center / v.half_range),
    )?;
    Ok((shift, scale))
}

impl Acceleration {
    fn of(axis: &RigAxis, wired: &AxisWiring) -> Self {
        if axis.inertia == 0.0 {
            Self::None
        } else if wired.acceleration.iter().any(Option::is_some) {
            Self::Logged
        } else {
            Self::Derived
        }
    }
}

/// The measured force as a sum over channels, and how far the sums of derivatives are shifted down
/// before it.
struct MeasuredForce {
    terms: Terms,
    curvature_shift: i8,
    body_velocity_shift: i8,
}

impl MeasuredForce {
    fn new(
        axis: &RigAxis,
        wired: &AxisWiring,
        other: Option<&RigAxis>,
        force_per_lsb: f64,
        rig: &Rig,
    ) -> Result<Self, Error> {
        let sign = if axis.inertia_minus_force { -1.0 } else { 1.0 };
        let body_step = if wired.body.is_some() {
            axis.body_step
        } else {
            axis.displacement_step
        };
        let (mut derived, mut codes) = ([0.0; 2], [0.0; 3]);
        let (mut curvature_shift, mut body_velocity_shift) = (1, 1);
        match Acceleration::of(axis, wired) {
            Acceleration::None => {}
            Acceleration::Logged => {
                codes[0] = -sign * axis.inertia * axis.acceleration_step / force_per_lsb
            }
            Acceleration::Derived => {
                let unit = axis.inertia * body_step / power_of_two(rig.acceleration.shift);
                (curvature_shift, derived[0]) = derivative_gain(
                    "inertia force per unit of curvature",
                    unit / force_per_lsb,
                    -sign,
                )?;
            }
        }
        codes[1] = sign * axis.force_step / force_per_lsb;
        let of_position = -sign * axis.ground_stiffness * body_step / force_per_lsb;
        if axis.ground_damping > 0.0 {
            let unit = axis.ground_damping * body_step / power_of_two(rig.velocity.shift);
            (body_velocity_shift, derived[1]) = derivative_gain(
                "ground damping per unit of slope",
                unit / force_per_lsb,
                -sign,
            )?;
        }
        let cross = other.map_or(0.0, |other| axis.force_cross * other.force_step);
        codes[2] = -sign * cross / force_per_lsb;
        Ok(Self {
            terms: Terms::new(derived, codes, of_position)?,
            curvature_shift,
            body_velocity_shift,
        })
    }
}

/// How the input that effects of the axis follow is read.
#[derive(Clone, Debug, PartialEq)]
struct FollowedInput {
    channel: Channel,
    scale: Scale,
}

impl FollowedInput {
    fn new(
        axis: &RigAxis,
        wired: &AxisWiring,
        trained: &Input,
        delay: usize,
    ) -> Result<Self, Error> {
        let mut checks = Checks::new();
        let is_wired = i32::from(wired.input.is_some());
        checks.whole("input channels that the model follows", is_wired, 1, 1);
        checks.done()?;
        let range = &trained.range;
        Ok(Self {
            channel: Channel::filtered(
                "age of the input's sample that the delay of its channel asks for",
                axis.delays.input,
                delay,
            )?,
            scale: Scale::new(
                "input counts per training range",
                FULL_SCALE * axis.input_step / range.half_range,
                (range.center - axis.input_zero) / axis.input_step,
            )?,
        })
    }

    /// The input in Q31, and whether it is outside its training range.
    fn read(&self, values: &Delay) -> (i32, bool) {
        self.scale.apply(self.channel.read(values))
    }
}

impl AxisChain {
    pub(super) fn new(
        axis: &RigAxis,
        wired: &AxisWiring,
        other: Option<&RigAxis>,
        trained: &Axis,
        force_per_lsb: f64,
        rig: &Rig,
    ) -> Result<Self, Error> {
        let x = &trained.displacement;
        let position = Scale::new(
            "displacement counts per training range",
            FULL_SCALE * axis.displacement_step / x.half_range,
            x.center / axis.displacement_step,
        )?;
        let (velocity_shift, velocity) = velocity_scale(axis, trained, rig)?;
        let force = MeasuredForce::new(axis, wired, other, force_per_lsb, rig)?;
        let wait = Settling::of(rig).wait;
        let delay = rig.velocity.taps.len() / 2 + wait;
        let acceleration = Acceleration::of(axis, wired);
        // Also where it is in time: the filters may wait for longer than samples are kept.
        let accelerometer = match acceleration {
            Acceleration::Logged => Some(Channel::filtered(
                "age of the acceleration sample that the delay of its channel asks for",
                axis.delays.acceleration,
                delay,
            )?),
            Acceleration::None | Acceleration::Derived => None,
        };
        Ok(Self {
            difference: wired.near.is_some(),
            has_body: wired.body.is_some(),
            position,
            velocity,
            velocity_shift,
            acceleration,
            curvature_shift: force.curvature_shift,
            body_velocity_shift: force.body_velocity_shift,
            terms: force.terms,
            force: Channel::filtered(
                "age of the force sample that the delay of its channel asks for",
                axis.force_delay_samples,
                delay,
            )?,
            late_acceleration: accelerometer.filter(|_| axis.delays.acceleration != 0.0),
            input: match &trained.input {
                None => None,
                Some(input) => Some(FollowedInput::new(axis, wired, input, delay)?),
            },
            late_displacement: Channel::counter(axis.delays.displacement, wait)?,
            late_body: Channel::counter(axis.delays.body, wait)?,
            notch: AdaptiveNotch::new(&axis.hum, rig.sample_rate_hz, force_per_lsb)?,
        })
    }

    /// Takes what the sensors of the axis gave; gives the counts of displacement and body, in time
    /// with each other.
    #[inline(always)]
    pub(super) fn take(&self, state: &mut AxisState, raw: &RawAxis) -> [i32; 2] {
        let [first, second] = raw.displacement;
        let relative = if self.difference {
            first.wrapping_sub(second)
        } else {
            first
        };
        let late = &mut state.late_displacement;
        let displacement = in_time(self.late_displacement.as_ref(), late, relative);
        // On a rig whose displacement is measured from ground, the far side is the body.
        let body = if self.has_body {
            in_time(self.late_body.as_ref(), &mut state.late_body, raw.body)
        } else {
            displacement
        };
        state.acceleration.push(raw.acceleration);
        state.force.push(raw.force);
        [displacement, body]
    }

    /// The axis in machine numbers, from the sums of its filters and the forces of its own and the
    /// other channel. The accelerometer is read `delay` samples ago unless it is late.
    #[inline(always)]
    pub(super) fn see(
        &self,
        at: Instant,
        state: &AxisState,
        delay: usize,
        [own, other]: [i32; 2],
    ) -> Seen {
        let (x, x_outside) = self.position.apply(at.position);
        let slope = shift_round(at.slope, self.velocity_shift);
        let (v, v_outside) = self.velocity.apply(slope);
        let acceleration = match (self.acceleration, &self.late_acceleration) {
            (Acceleration::None | Acceleration::Derived, _) => 0,
            (Acceleration::Logged, None) => state.acceleration.delayed(delay),
            (Acceleration::Logged, Some(late)) => late.read(&state.acceleration),
        };
        let derived = [
            shift_round(at.curvature, self.curvature_shift),
            shift_round(at.body_slope, self.body_velocity_shift),
        ];
        let codes = [acceleration, own, other];
        Seen {
            states: [x, v],
            outside: u8::from(x_outside) | u8::from(v_outside) << 1,
            force: self.terms.force(derived, codes, at.body),
        }
    }

    /// Whether effects of the axis follow an input.
    pub(super) fn follows(&self) -> bool {
        self.input.is_some()
    }

    /// What effects of the axis follow at the chain's instant, in Q31, and whether it is outside
    /// the training range; takes the newest code.
    pub(super) fn follow(&self, state: &mut AxisState, raw: &RawAxis) -> (i32, bool) {
        let Some(input) = &self.input else {
            return (0, false);
        };
        state.input.push(raw.input);
        input.read(&state.input)
    }

    /// Whether a damper to ground needs the body's slope.
    pub(super) fn is_damped(&self) -> bool {
        self.terms.is_damped()
    }
}

/// The state of an axis: its channels that are not filtered, and counters that have to wait for
/// another one.
#[derive(Clone, Debug)]
pub(super) struct AxisState {
    late_displacement: Delay<COUNTER_PLACES>,
    late_body: Delay<COUNTER_PLACES>,
    acceleration: Delay,
    pub(super) force: Delay,
    input: Delay,
    pub(super) phasor: Phasor,
}

impl AxisState {
    /// Nothing has moved yet.
    pub(super) const NEW: Self = Self {
        late_displacement: Delay::NEW,
        late_body: Delay::NEW,
        acceleration: Delay::NEW,
        force: Delay::NEW,
        input: Delay::NEW,
        phasor: Phasor::NEW,
    };
}

/// An axis in the middle of the derivatives' window, in counts and sums of filters.
pub(super) struct Instant {
    /// Relative displacement, and its slope.
    pub(super) position: i32,
    pub(super) slope: i64,
    /// Position of the body that carries the inertia, its slope and its curvature where they are
    /// wanted.
    pub(super) body: i32,
    pub(super) body_slope: i64,
    pub(super) curvature: i64,
}

/// An axis in machine numbers: states in Q31, which of them were outside the training range, and
/// the restoring force from the equation of motion.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    pub(super) states: [i32; 2],
    pub(super) outside: u8,
    pub(super) force: i32,
}
