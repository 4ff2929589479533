//! The on-board chain: raw counts in; states, measured force, predicted force and residual out, in integers.
//!
//! ```text
//! displacement counts ─┬─ delay D ──────── scale ─ u (position)  ┐
//!                      └─ slope FIR ────── scale ─ u (velocity)  ┴─ model ─ predicted ┐
//! acceleration ─────────── delay D ─────── scale ─┬─ measured force ──────────────────┴─ residual ─ low-pass FIR
//! forces ───────────────── delay D − lag ─ scale ─┘
//! ```
//!
//! The derivative filters are linear-phase with an odd number N of taps, so what they give belongs to the sample
//! D = (N − 1)/2 ago. Everything else is delayed by the same D: state, force and residual of one [`Output`] belong to
//! one instant. A force channel that is late waits that much less, and is read between its samples; what it reads of the
//! other axis's force is taken off. The low-pass over the residual adds its own (M − 1)/2 samples.
//!
//! Setting up ([`Chain::new`]) turns SI values into integers once, in `f64`; [`Chain::step`] uses integers only, does
//! not panic and takes the same path whatever the data.

use crate::error::Error;
use crate::filter::{Delay, History, MAX_DELAY, curvature, low_pass, shift_round, slope};
use crate::fixed::round_shift;
use crate::interpolate::{Between, mix};
use crate::model::Model;
use crate::model::axis::Axis;
use crate::model::terms::Memory;
use crate::rig::{MAX_BAND_TAPS, Rig, RigAxis, Taps};
use crate::scale::{Scale, factor};

/// What the sensors of one axis gave at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawAxis {
    /// Encoder counters: far side and near side; the second is 0 on a rig that measures the difference itself.
    pub displacement: [i32; 2],
    /// Encoder counter of the body that carries the inertia, where the rig has one; may be the near side's.
    pub body: i32,
    /// Accelerometer code, where the rig has one.
    pub acceleration: i32,
    /// Force or torque code.
    pub force: i32,
}

/// One instant, both axes; a one-axis rig leaves the second at its default.
pub type RawSample = [RawAxis; 2];

/// What the chain says about the instant D samples ago.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// Normalised states [x, ẋ, φ, φ̇] in Q31, held at the edge of the training range.
    pub state: [i32; 4],
    /// Bit i is set when state i was outside the training range.
    pub outside: u8,
    /// Restoring force from the equation of motion, in the model's force unit per axis.
    pub measured: [i32; 2],
    /// Restoring force from the model, in the same unit.
    pub predicted: [i32; 2],
    /// Measured minus predicted, saturated.
    pub residual: [i32; 2],
    /// The residual in the common band, (M − 1)/2 samples older still; `None` until the low-pass is full.
    pub residual_band: Option<[i32; 2]>,
    /// Bit a is set when a force of axis a ran into a rail of its 32 bits.
    pub saturated: u8,
}

impl Output {
    /// Every bit of the output as words, for a digest: states, flags, forces, residuals, and the residual in the band
    /// (0 while there is none, after a word that says whether there is one).
    pub fn words(&self) -> impl Iterator<Item = i32> {
        let flags = i32::from(self.outside) | i32::from(self.saturated) << 8;
        let in_band = i32::from(self.residual_band.is_some());
        self.state
            .into_iter()
            .chain([flags])
            .chain(self.measured)
            .chain(self.predicted)
            .chain(self.residual)
            .chain([in_band])
            .chain(self.residual_band.unwrap_or_default())
    }
}

/// Where a channel's acceleration comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Acceleration {
    /// The force channel already is the restoring force.
    None,
    /// An accelerometer.
    Logged,
    /// The second derivative of the body's counter, or of the displacement where there is none.
    Derived,
}

/// One axis in machine numbers.
#[derive(Clone, Debug, PartialEq)]
struct AxisChain {
    difference: bool,
    has_body: bool,
    position: Scale,
    velocity: Scale,
    /// Binary exponent between the slope filter's sum and `velocity`'s input.
    velocity_shift: i8,
    acceleration: Acceleration,
    /// Binary exponent between the curvature filter's sum and `inertia`'s input.
    curvature_shift: i8,
    /// Binary exponent between the body's slope sum and `damping`'s input.
    body_velocity_shift: i8,
    /// What acceleration, force, body position, body velocity and the other axis's force contribute to the measured force.
    terms: [Term; 5],
    force: ForceChannel,
}

/// Where a force channel is read: how many samples ago, and between which ones.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceChannel {
    /// Age of the oldest of the four samples.
    oldest: usize,
    weights: [i32; 4],
}

impl ForceChannel {
    /// The channel that is late by so many samples, in a chain that waits `delay` samples.
    fn new(late: f64, delay: usize) -> Result<Self, Error> {
        let between = Between::at(late);
        let weights = between.integer_weights();
        let most = MAX_DELAY as i64;
        let oldest = delay as i64 + 1 - i64::from(between.whole);
        // A sample with weight 0 need not be there.
        let ages = (0..4).zip(weights).filter(|(_, weight)| *weight != 0);
        let reached = ages.map(|(place, _)| oldest - place);
        if let Some(age) = reached.into_iter().find(|age| !(0..=most).contains(age)) {
            return Err(Error::OutOfRange {
                quantity: "age of the force sample that the delay of its channel asks for",
                seen: age as f64,
                least: 0.0,
                most: most as f64,
            });
        }
        Ok(Self {
            oldest: oldest.clamp(0, most + 1) as usize,
            weights,
        })
    }

    /// The channel's count at the chain's instant.
    fn read(&self, force: &Delay) -> i32 {
        let counts = [0, 1, 2, 3].map(|place| force.delayed(self.oldest.saturating_sub(place)));
        mix(&self.weights, counts)
    }
}

/// A gain in force units per count, as a multiplier of 28 to 29 bits and a shift; no contribution when the multiplier is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Term {
    multiplier: i32,
    shift: i8,
}

/// Binary places below the force unit that terms keep until they are added up.
const TERM_PLACES: i8 = 8;

impl Term {
    fn new(gain: f64) -> Result<Self, Error> {
        if gain == 0.0 {
            return Ok(Self::default());
        }
        let (multiplier, shift) = factor("force per count", gain)?;
        let most = 1_u64 << (28 - TERM_PLACES);
        Error::unless_within("force per count", gain.abs(), 0.0, most as f64)?;
        Ok(Self { multiplier, shift })
    }

    /// The contribution of a count, in force units times 2^[`TERM_PLACES`]; under 2⁶⁰ whatever the count, so that five add up.
    fn of(self, counts: i32) -> i64 {
        let product = i64::from(self.multiplier) * i64::from(counts);
        round_shift(
            product,
            self.shift.saturating_sub(TERM_PLACES).clamp(0, 62) as u32,
        )
    }
}

/// The chain for one rig and one model: what is calibrated, apart from what moves ([`ChainState`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    axes: heapless::Vec<AxisChain, 2>,
    velocity: Taps,
    acceleration: Taps,
    band: Taps<MAX_BAND_TAPS>,
}

/// What moves: the last samples of every channel, and the memory of the model's effects.
#[derive(Clone, Debug, Default)]
pub struct ChainState {
    axes: [AxisState; 2],
    model: Memory,
    samples: usize,
}

#[derive(Clone, Debug, Default)]
struct AxisState {
    displacement: History,
    body: History,
    acceleration: Delay,
    force: Delay,
    residual: History<MAX_BAND_TAPS>,
}

/// Bits by which an intermediate derivative is coarser than the force unit; gives it a range of 2³⁵ force units.
const DERIVATIVE_HEADROOM: f64 = 16.0;

/// Range of the slope before scaling: one training half-range is 2²⁸ to 2²⁹, so a state may be four times outside the
/// training range before its own number saturates.
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
        // A filter whose sums are this small has too few bits, one whose sums are this large would overflow.
        return Err(Error::OutOfRange {
            quantity,
            seen: value,
            least: wanted,
            most: wanted * (1_u64 << 62) as f64,
        });
    }
    Ok((shift, scaled))
}

/// How far a derivative's sum is shifted down, and the signed gain it then has: 16 to 32 force units per count.
fn derivative_gain(quantity: &'static str, unit: f64, sign: f64) -> Result<(i8, f64), Error> {
    let (shift, scaled) = shift_to(quantity, DERIVATIVE_HEADROOM / unit, 1.0)?;
    Ok((shift, sign * DERIVATIVE_HEADROOM / scaled))
}

/// `2^shift` as a real number.
fn power_of_two(shift: i8) -> f64 {
    let step = if shift < 0 { 0.5 } else { 2.0 };
    (0..shift.unsigned_abs()).fold(1.0, |power, _| power * step)
}

impl AxisChain {
    fn new(
        axis: &RigAxis,
        other: Option<&RigAxis>,
        learnt: &Axis,
        force_per_lsb: f64,
        rig: &Rig,
    ) -> Result<Self, Error> {
        let (x, v) = (&learnt.displacement, &learnt.velocity);
        let full_scale = (1_u64 << 31) as f64;
        let position = Scale::new(
            "displacement counts per training range",
            full_scale * axis.displacement_step / x.half_range,
            x.center / axis.displacement_step,
        )?;

        // One unit of the slope filter's sum is this many m/s.
        let slope_unit = axis.displacement_step / power_of_two(rig.velocity.shift);
        let (velocity_shift, half_range) = shift_to(
            "velocity resolution against its training range",
            v.half_range / slope_unit,
            VELOCITY_RANGE,
        )?;
        let velocity = Scale::new(
            "velocity scale",
            full_scale / half_range,
            half_range * (v.center / v.half_range),
        )?;

        let sign = if axis.inertia_minus_force { -1.0 } else { 1.0 };
        let acceleration = if axis.inertia == 0.0 {
            Acceleration::None
        } else if axis.acceleration_step > 0.0 {
            Acceleration::Logged
        } else {
            Acceleration::Derived
        };
        let has_body = axis.body_step > 0.0;
        let body_step = if has_body {
            axis.body_step
        } else {
            axis.displacement_step
        };
        let mut gains = [0.0; 5];
        let mut curvature_shift = 1;
        match acceleration {
            Acceleration::None => {}
            Acceleration::Logged => {
                gains[0] = -sign * axis.inertia * axis.acceleration_step / force_per_lsb
            }
            Acceleration::Derived => {
                let unit = axis.inertia * body_step / power_of_two(rig.acceleration.shift);
                (curvature_shift, gains[0]) = derivative_gain(
                    "inertia force per unit of curvature",
                    unit / force_per_lsb,
                    -sign,
                )?;
            }
        }
        gains[1] = sign * axis.force_step / force_per_lsb;
        gains[2] = -sign * axis.ground_stiffness * body_step / force_per_lsb;
        let mut body_velocity_shift = 1;
        if axis.ground_damping > 0.0 {
            let unit = axis.ground_damping * body_step / power_of_two(rig.velocity.shift);
            (body_velocity_shift, gains[3]) = derivative_gain(
                "ground damping per unit of slope",
                unit / force_per_lsb,
                -sign,
            )?;
        }
        let cross = other.map_or(0.0, |other| axis.force_cross * other.force_step);
        gains[4] = -sign * cross / force_per_lsb;
        let [inertia, force, stiffness, damping, cross] = gains.map(Term::new);
        Ok(Self {
            difference: axis.displacement_difference,
            has_body,
            position,
            velocity,
            velocity_shift,
            acceleration,
            curvature_shift,
            body_velocity_shift,
            terms: [inertia?, force?, stiffness?, damping?, cross?],
            force: ForceChannel::new(axis.force_delay_samples, rig.velocity.taps.len() / 2)?,
        })
    }

    /// Position and velocity in Q31, and whether each was outside the training range.
    fn state(&self, state: &AxisState, delay: usize, velocity: &Taps) -> [(i32, bool); 2] {
        let slope = shift_round(slope(velocity, &state.displacement), self.velocity_shift);
        [
            self.position.apply(state.displacement.delayed(delay)),
            self.velocity.apply(slope),
        ]
    }

    /// The restoring force from the equation of motion, in force units times 2^[`TERM_PLACES`], before saturation.
    fn measured(
        &self,
        state: &AxisState,
        [own_force, other_force]: [i32; 2],
        delay: usize,
        velocity: &Taps,
        acceleration: &Taps,
    ) -> i64 {
        let a = match self.acceleration {
            Acceleration::None => 0,
            Acceleration::Logged => state.acceleration.delayed(delay),
            Acceleration::Derived => {
                shift_round(curvature(acceleration, &state.body), self.curvature_shift)
            }
        };
        let [inertia, force, stiffness, damping, cross] = self.terms;
        let damper = if damping.multiplier == 0 {
            0
        } else {
            shift_round(slope(velocity, &state.body), self.body_velocity_shift)
        };
        inertia.of(a)
            + force.of(own_force)
            + stiffness.of(state.body.delayed(delay))
            + damping.of(damper)
            + cross.of(other_force)
    }
}

impl Chain {
    /// Builds the chain from SI values.
    ///
    /// # Errors
    /// [`Error`] names the quantity that the integers cannot hold, or the part of the rig that does not fit the model.
    pub fn new(model: &Model, rig: &Rig) -> Result<Self, Error> {
        rig.check()?;
        if rig.axes.len() != model.axes() {
            return Err(Error::OutOfRange {
                quantity: "axes of the rig",
                seen: rig.axes.len() as f64,
                least: model.axes() as f64,
                most: model.axes() as f64,
            });
        }
        let mut axes = heapless::Vec::new();
        // From the first axis the other one is the second, from the second the first.
        let others = rig.axes.get(1).into_iter().chain(rig.axes.first());
        let mut others = others.map(Some).chain([None]);
        for (axis, (learnt, output)) in rig
            .axes
            .iter()
            .zip(model.header().axes.iter().zip(model.outputs()))
        {
            let other = others.next().flatten().filter(|_| rig.axes.len() == 2);
            // Two axes at most, as the rig's own list.
            let _ = axes.push(AxisChain::new(
                axis,
                other,
                learnt,
                output.force_per_lsb,
                rig,
            )?);
        }
        Ok(Self {
            axes,
            velocity: rig.velocity.clone(),
            acceleration: rig.acceleration.clone(),
            band: rig.band.clone(),
        })
    }

    /// One or two.
    pub fn axes(&self) -> usize {
        self.axes.len()
    }

    /// D: by how many samples an [`Output`] lags behind the newest sample.
    pub fn delay(&self) -> usize {
        self.velocity.taps.len() / 2
    }

    /// By how many samples the residual in the common band lags behind the newest sample.
    pub fn band_delay(&self) -> usize {
        self.delay() + self.band.taps.len() / 2
    }

    /// The taps of the low-pass over the residual.
    pub fn band(&self) -> &Taps<MAX_BAND_TAPS> {
        &self.band
    }

    /// Takes one sample in; gives an output as soon as the filters are full.
    pub fn step(&self, state: &mut ChainState, model: &Model, raw: &RawSample) -> Option<Output> {
        for ((axis, moving), raw) in self.axes.iter().zip(&mut state.axes).zip(raw) {
            let [first, second] = raw.displacement;
            let relative = if axis.difference {
                first.wrapping_sub(second)
            } else {
                first
            };
            moving.displacement.push(relative);
            // On a rig whose displacement is measured from ground, the far side is the body.
            moving
                .body
                .push(if axis.has_body { raw.body } else { relative });
            moving.acceleration.push(raw.acceleration);
            moving.force.push(raw.force);
        }
        state.samples = state.samples.saturating_add(1);
        if state.samples < self.velocity.taps.len() {
            return None;
        }

        let delay = self.delay();
        let mut output = Output::default();
        let mut forces = [0; 2];
        for (force, (axis, moving)) in forces.iter_mut().zip(self.axes.iter().zip(&state.axes)) {
            *force = axis.force.read(&moving.force);
        }
        for (index, (axis, moving)) in self.axes.iter().zip(&state.axes).enumerate() {
            let states = axis.state(moving, delay, &self.velocity);
            for (offset, (value, outside)) in states.into_iter().enumerate() {
                let input = 2 * index + offset;
                if let Some(slot) = output.state.get_mut(input) {
                    *slot = value;
                }
                output.outside |= u8::from(outside) << (input & 7);
            }
            let measured = axis.measured(moving, forces, delay, &self.velocity, &self.acceleration);
            let [own, other] = forces;
            forces = [other, own];
            let measured = shift_round(measured, TERM_PLACES);
            output.saturated |= at_rail(measured) << (index & 7);
            if let Some(slot) = output.measured.get_mut(index) {
                *slot = measured;
            }
        }
        output.predicted = model.step(&mut state.model, &output.state);

        let band_full = state.samples >= self.velocity.taps.len() + self.band.taps.len() - 1;
        let mut in_band = [0; 2];
        let residuals = output
            .residual
            .iter_mut()
            .zip(output.measured.iter().zip(&output.predicted));
        for (index, ((residual, (measured, predicted)), (moving, slot))) in residuals
            .zip(state.axes.iter_mut().zip(&mut in_band))
            .enumerate()
            .take(self.axes.len())
        {
            *residual = measured.saturating_sub(*predicted);
            output.saturated |= at_rail(*residual) << (index & 7);
            moving.residual.push(*residual);
            if band_full {
                *slot = low_pass(&self.band, &moving.residual);
            }
        }
        output.residual_band = band_full.then_some(in_band);
        Some(output)
    }
}

/// 1 when the value stands at one of its rails.
fn at_rail(value: i32) -> u8 {
    u8::from(value == i32::MAX || value == i32::MIN)
}
