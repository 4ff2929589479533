//! The monitor: does the joint still behave like its model, within the range in which the model is valid, and are its sensors well?
//!
//! ```text
//! residual in the band ─┐                     ┌─ error's share of the force ─┐
//! measured force ───────┼─ blocks of samples ─┼─ part along displacement ────┼─ cumulative sums ─┐
//! state ────────────────┘        │            └─ part along velocity ────────┘                   ├─ verdict
//!                                └─ sliding NMSE                                                 │
//! outside the range, counts, faults of the sensors ── rates, channels that stand still ──────────┘
//! ```
//!
//! The residual in the band comes at every so many samples, and what is summed up of the others are their values at those instants.
//! Blocks hold only residuals that are free of everything that makes it wrong: a state outside the training range
//! spoils as many residuals as the low-pass has taps, a fault of a sensor as many as the whole chain has.
//! `docs/explanation/monitor.md` has the formulas and how the limits are set. Everything per sample is integer, takes no memory beyond
//! [`MonitorState`], and cannot panic; the work at the end of a block is spread over the samples that follow.

mod block;
mod level;
pub mod limits;
mod logarithm;
mod review;
mod sensors;
mod sliding;
mod verdict;

pub use block::{Statistics, Sums, share_of_change};
pub use level::{MAX_OF_SHARE, least_blocks, most_of_block};
pub use logarithm::{OCTAVE, SHARE};
pub use sensors::Faults;
pub use sliding::Window;
pub use verdict::{CHANNEL_NAMES, Cause, State, Verdict, Words};

use crate::chain::{Chain, Output, RawSample};
use crate::fault::{Checks, Error};
use crate::scalar::fixed::in_order;
use crate::wire::rig::MAX_BAND_TAPS;
use block::Waiting;
use level::{Level, values};
use limits::{CHANNELS, Limits, SIDES};
use review::Review;
use sensors::{SensorState, forget};
use sliding::{FAST, SLOW, Sliding};

/// The longest wait for the low-pass over the residual and for the sample after it, in samples.
const MAX_WAIT: usize = MAX_BAND_TAPS / 2 + 2;
/// Two pieces at a time are done of a block with fewer samples.
const SHORT_BLOCK: u16 = 64;
/// Binary logarithm of the blocks over which the time outside the training range is counted.
const OUTSIDE_MEMORY: u32 = 6;
/// The monitor of one model on one rig: what is calibrated, apart from what moves ([`MonitorState`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Monitor {
    limits: Limits,
    /// Binary logarithms of the samples of a block, and of the residuals in the band that come meanwhile.
    log_block: u32,
    log_values: u32,
    /// Whether there are samples without a residual in the band, and whether those are more than every other one.
    is_thinned: bool,
    is_sparse: bool,
    /// Samples by which the residual in the band that is summed up is older than the rest of an output.
    wait: usize,
    /// Residuals that a state outside the training range spoils.
    after_outside: u16,
    /// Residuals that a wrong count spoils.
    after_fault: u16,
}

/// What the monitor keeps between samples.
#[derive(Clone, Debug)]
pub struct MonitorState {
    waiting: [[Waiting; 2]; MAX_WAIT],
    newest: usize,
    /// A residual in the band that is summed up with the next sample, where that has none: the low-pass has enough to do when it
    /// comes.
    held: [i32; 2],
    is_held: bool,
    /// Residuals that are still spoilt.
    invalidated: u16,
    /// The block that is being filled and the last one that was, which change places.
    sums: [[Sums; 2]; 2],
    filling: usize,
    count: u16,
    blocks: u32,
    /// What is still to be done about the last block, a piece per sample.
    judging: Judging,
    /// Pieces of the end of the sensors' block that are still to be done.
    to_end: u8,
    review: Review,
    levels: [[Level; SIDES]; 2],
    sliding: [[Sliding; 2]; 2],
    sensors: SensorState,
    sensor_state: State,
    /// Samples since the sensors' block began, and outputs outside the range among them.
    ticks: u16,
    outside: u16,
    outside_rate: i32,
    outside_state: State,
    moved: bool,
    verdict: Verdict,
}

/// How far the judgement of a block has come.
#[derive(Clone, Copy, Debug, Default)]
struct Judging {
    /// Axes that are still to be judged, and pieces that were done of the first of them.
    axes: usize,
    done: u8,
    log_force: i32,
    shares: [i32; 2],
    seen: Statistics,
}

/// Pieces of the end of the sensors' block: the courses of both axes and the rates, which come before everything else, and then the review
/// of both axes and of the sensors.
const END: u8 = 6;
const REVIEW: u8 = 3;

impl Default for MonitorState {
    fn default() -> Self {
        Self {
            waiting: [[Waiting::default(); 2]; MAX_WAIT],
            newest: 0,
            held: [0; 2],
            is_held: false,
            invalidated: 0,
            sums: [[Sums::default(); 2]; 2],
            filling: 0,
            count: 0,
            blocks: 0,
            judging: Judging::default(),
            to_end: 0,
            review: Review::default(),
            levels: [[Level::default(); SIDES]; 2],
            sliding: [[Sliding::default(); 2]; 2],
            sensors: SensorState::default(),
            sensor_state: State::Healthy,
            ticks: 0,
            outside: 0,
            outside_rate: 0,
            outside_state: State::Healthy,
            moved: false,
            verdict: Verdict::default(),
        }
    }
}

impl Monitor {
    /// The monitor behind one chain.
    ///
    /// # Errors
    /// [`Error`] names the limit that is not usable, or says that the limits are not for as many axes as the chain has.
    pub fn new(limits: Limits, chain: &Chain) -> Result<Self, Error> {
        limits.check()?;
        let mut checks = Checks::new();
        let every_log2 = chain.band_every().trailing_zeros();
        limits.check_for(chain.axes(), every_log2, &mut checks);
        checks.done()?;
        let (derivative, band) = (chain.invalidated_by_fault(), chain.band().taps.len() as u16);
        Ok(Self {
            log_block: limits.block.trailing_zeros(),
            log_values: limits.values(every_log2).trailing_zeros(),
            is_thinned: chain.band_every() > 1,
            is_sparse: chain.band_every() > 2,
            wait: chain.band_delay() - chain.delay() + usize::from(chain.band_every() > 1),
            after_outside: band,
            after_fault: derivative + band,
            limits,
        })
    }

    /// Binary logarithm of the residuals in the band that a block sums up: what [`Sums::statistics`] wants to know.
    pub fn log_values(&self) -> u32 {
        self.log_values
    }

    /// Its limits.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Takes one sample in: the counts, what the chain made of them, and what was wrong with the sensors.
    pub fn update(
        &self,
        state: &mut MonitorState,
        raw: &RawSample,
        output: Option<&Output>,
        faults: &Faults,
    ) -> Verdict {
        match output {
            Some(output) if output.saturated != 0 => {
                let faults = self.with_saturated(faults, output.saturated);
                self.sense(state, raw, &faults);
            }
            _ => self.sense(state, raw, faults),
        }
        let mut busy = false;
        if let Some(output) = output {
            busy = self.take(state, output);
            busy |= self.is_sparse && output.residual_band.is_some();
        }
        state.ticks = state.ticks.saturating_add(1);
        if state.ticks >= self.limits.block {
            (state.ticks, state.to_end) = (0, END);
        }
        // A piece at a time, so that the end of a block does not come all at once, nor together with the sums and the low-pass's
        // values where there are samples without any. Half of a block's are, so that all of the 18 pieces are done before the next end.
        if !(busy && self.is_thinned) {
            self.go_on(state);
            if self.limits.block < SHORT_BLOCK {
                self.go_on(state);
            }
        }
        state.verdict
    }

    /// Does the next piece, if there is one.
    #[inline(never)]
    fn go_on(&self, state: &mut MonitorState) {
        if state.to_end > REVIEW {
            self.end_block(state);
        } else if state.judging.axes != 0 {
            self.judge(state);
        } else if state.to_end != 0 {
            self.review(state);
        }
    }

    /// The faults with those of forces at a rail: bit a of `saturated` for axis a.
    #[inline(never)]
    fn with_saturated(&self, faults: &Faults, saturated: u8) -> Faults {
        let mut faults = *faults;
        for axis in 0..self.limits.axes.len() {
            if saturated & (1 << (axis & 7)) != 0 {
                faults.saturated |= Faults::bit(axis, CHANNELS - 1);
            }
        }
        faults
    }

    #[inline(never)]
    fn sense(&self, state: &mut MonitorState, raw: &RawSample, faults: &Faults) {
        state.sensors.sample(&self.limits, raw, faults);
        if faults.any() {
            state.invalidated = self.after_fault;
        }
    }

    /// Adds an output to the block that is being filled where it has a residual in the band, unless that is spoilt; whether it did.
    fn take(&self, state: &mut MonitorState, output: &Output) -> bool {
        state.newest = if state.newest + 1 < MAX_WAIT {
            state.newest + 1
        } else {
            0
        };
        if let Some(place) = state.waiting.get_mut(state.newest) {
            for (axis, limits) in self.limits.axes.iter().enumerate() {
                // Two axes at most.
                let own = axis & 1;
                let states = [output.state[2 * own], output.state[2 * own + 1]];
                place[own] = Waiting::new(states, output.measured[own], limits);
            }
        }
        if output.outside != 0 {
            state.outside = state.outside.saturating_add(1);
            state.invalidated = state.invalidated.max(self.after_outside);
        }
        let mut residual = output.residual_band;
        if state.invalidated > 0 {
            state.invalidated -= 1;
            residual = None;
        }
        let residual = match residual {
            Some(residual) if self.is_thinned => {
                (state.held, state.is_held) = (residual, true);
                return false;
            }
            Some(residual) => residual,
            None if state.is_held => {
                state.is_held = false;
                state.held
            }
            None => return false,
        };
        let place = match state.newest.checked_sub(self.wait) {
            Some(place) => place,
            None => (state.newest + MAX_WAIT).saturating_sub(self.wait),
        };
        let Some(at) = state.waiting.get(place) else {
            return false;
        };
        let sums = &mut state.sums[state.filling & 1];
        for (axis, limits) in self.limits.axes.iter().enumerate() {
            let own = axis & 1;
            sums[own].add(limits, &at[own], residual[own]);
        }
        state.count += 1;
        if state.count >> (self.log_values & 15) != 0 {
            state.blocks = state.blocks.wrapping_add(1);
            state.judging.axes = self.limits.axes.len();
            state.judging.done = 0;
            state.filling ^= 1;
            state.begin_block();
        }
        true
    }

    /// A piece of the sensors' figures once per block, whether its residuals were good or not.
    fn end_block(&self, state: &mut MonitorState) {
        let axis = END - state.to_end;
        state.to_end -= 1;
        if axis < 2 {
            state.sensors.end_courses(&self.limits, axis.into());
            return;
        }
        if state.sensors.end_rates(self.log_block) {
            // A channel stands still: what was summed up meanwhile says nothing about the joint.
            state.begin_block();
            state.judging.axes = 0;
            (state.invalidated, state.is_held) = (self.after_fault, false);
        }
        forget(
            &mut state.outside_rate,
            state.outside,
            self.log_block,
            OUTSIDE_MEMORY,
        );
        state.outside = 0;
    }

    /// A piece of what the last block says about each axis, where the joint moved enough.
    fn judge(&self, state: &mut MonitorState) {
        let judging = &mut state.judging;
        let axis = self.limits.axes.len().saturating_sub(judging.axes);
        let sums = &state.sums[(state.filling & 1) ^ 1];
        let (Some(limits), Some(sums), Some(levels), Some(sliding)) = (
            self.limits.axes.get(axis),
            sums.get(axis),
            state.levels.get_mut(axis),
            state.sliding.get_mut(axis),
        ) else {
            judging.axes = 0;
            return;
        };
        match judging.done {
            0 => {
                let [fast, slow] = sliding;
                fast.add::<FAST>(sums);
                slow.add::<SLOW>(sums);
                judging.log_force = sums.log_force(limits, self.log_values);
            }
            done @ 1..=2 => {
                let input = usize::from(done - 1) & 1;
                judging.shares[input] =
                    sums.share(limits, self.log_values, judging.log_force, input);
            }
            3 => {
                let (force, shares) = (judging.log_force, judging.shares);
                judging.seen = sums.judged(limits, self.log_values, force, shares);
                state.moved |= judging.seen.moves;
            }
            done => {
                // The first two sums, then the other three.
                let (from, to) = if done == 4 { (0, 2) } else { (2, SIDES) };
                if judging.seen.moves {
                    let (values, sides) = (values(&judging.seen), limits.sides());
                    for number in from..to {
                        // As many of each as there are sides.
                        if let (Some(level), Some(&value), Some(&side)) = (
                            levels.get_mut(number),
                            values.get(number),
                            sides.get(number),
                        ) {
                            level.add(value, side, most_of_block(number, side.threshold));
                        }
                    }
                }
                if to == SIDES {
                    (judging.axes, judging.done) = (judging.axes - 1, 0);
                    return;
                }
            }
        }
        judging.done += 1;
    }
}

/// 1/1000 of a rate in 2⁻¹⁶.
fn permille_of(rate: i32) -> u16 {
    ((rate.clamp(0, 1 << 16) * 1000 + (1 << 15)) >> 16) as u16
}

impl MonitorState {
    /// Begins the block that is to be filled.
    fn begin_block(&mut self) {
        let [first, second] = &mut self.sums[self.filling & 1];
        first.clear();
        in_order();
        second.clear();
        self.count = 0;
    }

    /// The last verdict.
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// 100·Σe²/(N·var r) over a sliding window, in 1/1000 %, of the residual in the common band against the measured force at the
    /// same instants; none while the force does not vary.
    ///
    /// Recursive over blocks: each new one counts 1/16 or 1/1024. One long division: for telemetry, not for every sample.
    pub fn nmse(&self, monitor: &Monitor, axis: usize, window: Window) -> Option<u32> {
        let windows = self.sliding.get(axis)?;
        let sliding = windows.get(usize::from(window == Window::Slow))?;
        sliding.nmse(monitor.log_values)
    }

    /// The part of the time outside the training range, in 1/1000, over the last 64 blocks or so.
    pub fn outside_permille(&self) -> u16 {
        permille_of(self.outside_rate)
    }

    /// How far each cumulative sum of an axis is, in 1/1000 of its threshold: error, stiffer, softer, more friction, less.
    pub fn levels(&self, monitor: &Monitor, axis: usize) -> [u16; 5] {
        let (Some(levels), Some(limits)) = (self.levels.get(axis), monitor.limits.axes.get(axis))
        else {
            return [0; SIDES];
        };
        let mut all = [0; SIDES];
        for (place, (level, side)) in all.iter_mut().zip(levels.iter().zip(limits.sides())) {
            *place = level.permille(side);
        }
        all
    }

    /// How many blocks were finished so far (wrapping), and the sums of the last one: what the limits are made from.
    pub fn last_block(&self) -> (u32, &[Sums; 2]) {
        (self.blocks, &self.sums[(self.filling & 1) ^ 1])
    }
}
