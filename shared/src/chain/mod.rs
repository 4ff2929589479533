//! The on-board chain: raw counts in; states, measured force, predicted force and residual out, in
//! integers.
//!
//! ```text
//! displacement counts ─┬─ delay D ──────── scale ─ u (position)  ┐
//!                      └─ slope FIR ────── scale ─ u (velocity)  ┴─ model ─ predicted ┐
//! acceleration ─────────── delay D ─────── scale ─┬─ measured force ──────────────────┴─ residual ─ low-pass FIR
//! forces ───────────────── delay D − lag ─ scale ─┘ less the mains hum, found in the residual
//! ```
//!
//! The derivative filters are linear-phase with an odd number N of taps, so what they give belongs
//! to the sample D = (N − 1)/2 ago. Everything else is delayed by the same D: state, force and
//! residual of one [`Output`] belong to one instant. A force or acceleration channel that is late
//! waits that much less, and is read between its samples; what a force channel reads of the other
//! axis's force is taken off. Where a counter is late, everything waits for it: the chain then lags
//! by a few samples more, and the count is read between its samples, rounded to a count, before it
//! is differentiated. The low-pass over the residual adds its own (M − 1)/2 samples, and gives a
//! value at the rate that its band needs.
//!
//! Setting up ([`Chain::new`]) turns SI values into integers once, in `f64`; [`Chain::step`] uses
//! integers only, does not panic and takes the same path whatever the data.

mod adaptive_notch;
mod axis;
mod band;
mod channel;
pub mod filter;
pub mod interpolate;
mod raw;
pub mod scale;
mod term;

pub use raw::{RawAxis, RawSample};

use crate::base::Model;
use crate::base::kernels::{Kernels, Portable};
use crate::base::terms::Memory;
use crate::chain::filter::{Counters, MAX_STEPS, derivative, weights_of_steps};
use crate::fault::Error;
use crate::wire::rig::{MAX_BAND_TAPS, Rig, Taps};
use axis::{Acceleration, AxisChain, AxisState, Instant, Seen};
use band::{Band, BandState};
use channel::Settling;

/// What the chain says about the instant D samples ago.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// Normalised states [x, ẋ, φ, φ̇] in Q31, held at the edge of the training range; of one axis
    /// the third is its input, 0 where it follows none.
    pub state: [i32; 4],
    /// Bit i is set when state i was outside the training range, bit 4 + a when the input of axis
    /// a was.
    pub outside: u8,
    /// Restoring force from the equation of motion, in the model's force unit per axis.
    pub measured: [i32; 2],
    /// Restoring force from the model, in the same unit.
    pub predicted: [i32; 2],
    /// Measured minus predicted, saturated.
    pub residual: [i32; 2],
    /// The residual in the common band, (M − 1)/2 samples older still: at every so many samples
    /// ([`Rig::band_every_log2`]), from when the low-pass is full.
    pub residual_band: Option<[i32; 2]>,
    /// Bit a is set when a force of axis a ran into a rail of its 32 bits; [`Output::HELD`] may
    /// stand beside them.
    pub saturated: u8,
}

impl Output {
    /// Bits of [`Output::saturated`] that stand for a force at its rail.
    pub const RAILS: u8 = 0b11;
    /// The bit of [`Output::saturated`] that says that a fault of a sensor is within the filters,
    /// so that mains hum was taken out with its last amplitude and phase.
    pub const HELD: u8 = 0b100;

    /// Every bit of the output as words, for a digest: states, flags, forces, residuals, and the
    /// residual in the band (0 while there is none, after a word that says whether there is
    /// one).
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

/// The chain for one rig and one model: what is calibrated, apart from the state ([`ChainState`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    axes: heapless::Vec<AxisChain, 2>,
    /// What the derivatives make of the counters' steps.
    velocity: heapless::Vec<i32, MAX_STEPS>,
    acceleration: heapless::Vec<i32, MAX_STEPS>,
    band: Band,
    /// Samples by which an output lags; see [`Chain::delay`].
    delay: usize,
    /// Samples with which the filters are full.
    full: usize,
    /// Whether a damper to ground needs the slopes of the bodies.
    damped: bool,
    /// Whether an axis's acceleration is the curvature of its body's position.
    derived: bool,
    /// Whether a force channel holds mains hum.
    humming: bool,
    /// Whether the force of an axis follows an input.
    follows: bool,
}

/// The state: the last samples of every channel, and the memory of the model's effects.
#[derive(Clone, Debug)]
pub struct ChainState {
    axes: [AxisState; 2],
    counters: Counters,
    band: BandState,
    model: Memory,
    samples: usize,
    /// Outputs that a fault still invalidates.
    held: u16,
}

impl ChainState {
    /// Before the first sample; a constant, so that a device need not build these 9 KiB on its
    /// stack.
    pub const NEW: Self = Self {
        axes: [const { AxisState::NEW }; 2],
        counters: Counters::NEW,
        band: BandState::NEW,
        model: Memory::NEW,
        samples: 0,
        held: 0,
    };

    /// Adaptive notches do not adapt over so many samples, the next one and those after it.
    pub fn hold_notches(&mut self, samples: u16) {
        self.held = self.held.max(samples);
    }
}

impl Default for ChainState {
    fn default() -> Self {
        Self::NEW
    }
}

impl Chain {
    /// Builds the chain from SI values.
    ///
    /// # Errors
    /// [`Error`] names the quantity that the integers cannot hold, or the part of the rig that does
    /// not fit the model.
    pub fn new(model: &Model, rig: &Rig) -> Result<Self, Error> {
        rig.check_chain()?;
        if rig.axes.len() != model.axes() {
            return Err(Error::OutOfRange {
                quantity: "axes of the rig",
                seen: rig.axes.len() as f64,
                least: model.axes() as f64,
                most: model.axes() as f64,
            });
        }
        let mut axes: heapless::Vec<AxisChain, 2> = heapless::Vec::new();
        // From the first axis the other one is the second, from the second the first.
        let others = rig.axes.get(1).into_iter().chain(rig.axes.first());
        let mut others = others.map(Some).chain([None]);
        for ((axis, wired), (trained, output)) in rig
            .axes
            .iter()
            .zip(&rig.wiring.axes)
            .zip(model.header().axes.iter().zip(model.outputs()))
        {
            let other = others.next().flatten().filter(|_| rig.axes.len() == 2);
            // Two axes at most, as the rig's own list.
            let _ = axes.push(AxisChain::new(
                axis,
                wired,
                other,
                trained,
                output.force_per_lsb,
                rig,
            )?);
        }
        let [damped, derived] = slopes(&axes);
        let Settling { wait, before } = Settling::of(rig);
        Ok(Self {
            damped,
            derived,
            humming: axes.iter().any(|axis| !axis.notch.is_none()),
            follows: axes.iter().any(AxisChain::follows),
            axes,
            velocity: weights_of_steps(rig.velocity.taps.iter().copied()),
            acceleration: weights_of_steps(rig.acceleration.taps.iter().copied()),
            band: Band {
                taps: rig.band.clone(),
                every_log2: rig.band_every_log2,
            },
            delay: rig.velocity.taps.len() / 2 + wait,
            full: rig.velocity.taps.len() + wait + before,
        })
    }

    /// Axes of the rig: 1 or 2.
    pub fn axes(&self) -> usize {
        self.axes.len()
    }

    /// By how many samples an [`Output`] lags behind the newest sample: D, and what a late counter
    /// costs.
    pub fn delay(&self) -> usize {
        self.delay
    }

    /// The sample, counted from 0, that the first output describes.
    pub fn first_row(&self) -> usize {
        // The first output comes with the sample that fills the filters.
        self.full - 1 - self.delay()
    }

    /// By how many samples the derivatives lag: D.
    fn filter_delay(&self) -> usize {
        self.velocity.len() / 2
    }

    /// By how many samples the residual in the common band lags behind the newest sample.
    pub fn band_delay(&self) -> usize {
        self.delay() + self.band().taps.len() / 2
    }

    /// Outputs that a wrong count invalidates, from the one that comes with it on.
    pub fn invalidated_by_fault(&self) -> u16 {
        // The filters have 129 taps at most, and counters wait for 3 samples at most.
        (2 * self.delay() + 1) as u16
    }

    /// Whether it takes mains hum out of a measured force.
    pub fn tracks_hum(&self) -> bool {
        self.humming
    }

    /// The taps of the low-pass over the residual.
    pub fn band(&self) -> &Taps<MAX_BAND_TAPS> {
        &self.band.taps
    }

    /// Samples from one residual in the band to the next; a power of two.
    pub fn band_every(&self) -> usize {
        self.band.every()
    }

    /// Takes one sample in; gives an output as soon as the filters are full.
    pub fn step(&self, state: &mut ChainState, model: &Model, raw: &RawSample) -> Option<Output> {
        self.step_by::<Portable>(state, model, raw)
    }

    /// [`Self::step`] with a board's kernels.
    pub fn step_by<K: Kernels>(
        &self,
        state: &mut ChainState,
        model: &Model,
        raw: &RawSample,
    ) -> Option<Output> {
        self.take(state, raw);
        let (mut outside, mut input) = (0, 0);
        if self.follows {
            (outside, input) = self.follow(state, raw);
        }
        state.samples = state.samples.saturating_add(1);
        if state.samples < self.full {
            state.band.begin(&self.band);
            return None;
        }
        let mut seen = self.see::<K>(state);
        let ([a, b], [c, d]) = (seen[0].states, seen[1].states);
        // Of one axis the second one's states are 0, of two the input.
        let states = [a, b, c | input, d];
        let predicted = model.step_by::<K>(&mut state.model, &states);
        outside |= seen[0].outside | seen[1].outside << 2;
        let mut saturated = 0;
        if self.humming {
            saturated = self.take_hum_out(state, &mut seen, &predicted, outside);
        }
        let [x, phi] = seen;
        let ([r, s], measured) = (predicted, [x.force, phi.force]);
        // What a rig of one axis has not is 0 in both.
        let residual = [x.force.saturating_sub(r), phi.force.saturating_sub(s)];
        let [e, f] = residual;
        saturated |= at_rail(x.force) | at_rail(e) | (at_rail(phi.force) | at_rail(f)) << 1;
        Some(Output {
            state: states,
            outside,
            measured,
            predicted,
            residual,
            residual_band: self.band.step::<K>(&mut state.band, residual),
            saturated,
        })
    }

    /// Takes the mains hum out of the measured forces, and adapts to it unless a state is outside
    /// the training range, a force at its rail or a fault within the filters. The bits of
    /// [`Output::saturated`] that follow: what was at a rail was so before.
    fn take_hum_out(
        &self,
        state: &mut ChainState,
        seen: &mut [Seen; 2],
        predicted: &[i32; 2],
        outside: u8,
    ) -> u8 {
        let [x, phi] = seen;
        let mut saturated = at_rail(x.force) | at_rail(phi.force) << 1;
        let mut held = saturated | outside;
        if state.held != 0 {
            state.held -= 1;
            held = 1;
            saturated |= Output::HELD;
        }
        for (number, axis) in self.axes.iter().enumerate() {
            let own = number & 1;
            let (notch, phasor, force) = (
                &axis.notch,
                &mut state.axes[own].phasor,
                &mut seen[own].force,
            );
            if !notch.is_none() {
                *force = notch.take_out(phasor, *force, predicted[own], held != 0);
            }
        }
        saturated
    }

    /// Tells the model's memory what effects of each axis follow at the chain's instant; gives the
    /// bits of [`Output::outside`] that are its own, and the input of a rig of one axis.
    #[inline(never)]
    fn follow(&self, state: &mut ChainState, raw: &RawSample) -> (u8, i32) {
        let (mut followed, mut outside) = ([0; 2], 0);
        for (number, axis) in self.axes.iter().enumerate() {
            // Two axes at most.
            let own = number & 1;
            let (input, is_outside) = axis.follow(&mut state.axes[own], &raw[own]);
            followed[own] = input;
            outside |= u8::from(is_outside) << (4 + own);
        }
        state.model.follow(followed);
        let [first, _] = followed;
        (outside, if self.axes.len() == 1 { first } else { 0 })
    }

    /// Puts a sample behind those before it.
    #[inline(always)]
    fn take(&self, state: &mut ChainState, raw: &RawSample) {
        let mut counts = [[0; 2]; 2];
        for (number, axis) in self.axes.iter().enumerate() {
            // Two axes at most.
            let own = number & 1;
            [counts[0][own], counts[1][own]] = axis.take(&mut state.axes[own], &raw[own]);
        }
        if state.samples == 0 {
            state.counters.begin(counts);
        }
        state.counters.push(counts, self.filter_delay());
    }

    /// Both axes in the middle of the derivatives' window; of one that is not there all 0.
    #[inline(always)]
    fn see<K: Kernels>(&self, state: &ChainState) -> [Seen; 2] {
        let [positions, bodies] = state.counters.middle();
        // Both derivatives have as many taps.
        let [steps, body_steps] = state.counters.steps(self.velocity.len());
        let slopes = derivative::<K>(&self.velocity, steps);
        let (mut body_slopes, mut curvatures) = ([0; 2], [0; 2]);
        if self.damped {
            body_slopes = derivative::<K>(&self.velocity, body_steps);
        }
        if self.derived {
            curvatures = derivative::<K>(&self.acceleration, body_steps);
        }
        let mut forces = [0; 2];
        for (number, axis) in self.axes.iter().enumerate() {
            let own = number & 1;
            forces[own] = axis.force.read(&state.axes[own].force);
        }
        let (mut seen, delay) = ([Seen::default(); 2], self.delay());
        for (number, axis) in self.axes.iter().enumerate() {
            let (own, other) = (number & 1, (number & 1) ^ 1);
            let at = Instant {
                position: positions[own],
                slope: slopes[own],
                body: bodies[own],
                body_slope: body_slopes[own],
                curvature: curvatures[own],
            };
            let forces = [forces[own], forces[other]];
            seen[own] = axis.see(at, &state.axes[own], delay, forces);
        }
        seen
    }
}

/// Which derivatives of the bodies axes ask for: the slope, for a damper, and the curvature.
fn slopes(axes: &[AxisChain]) -> [bool; 2] {
    let mut kinds = axes.iter().map(|axis| axis.acceleration);
    [
        axes.iter().any(AxisChain::is_damped),
        kinds.any(|kind| kind == Acceleration::Derived),
    ]
}

/// 1 when the value stands at one of its rails.
fn at_rail(value: i32) -> u8 {
    u8::from(value == i32::MAX || value == i32::MIN)
}
