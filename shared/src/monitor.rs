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
//! Blocks hold only samples whose residual is free of everything that makes it wrong: a state outside the training range
//! spoils as many residuals as the low-pass has taps, a fault of a sensor as many as the whole chain has.
//! `docs/monitor.md` has the formulas and how the limits are set. Everything per sample is integer, takes no memory beyond
//! [`MonitorState`], and cannot panic; the work at the end of a block is spread over the samples that follow.

mod block;
mod level;
pub mod limits;
mod logarithm;
mod sensors;
mod sliding;
mod verdict;

pub use block::{Statistics, Sums, share_of_change};
pub use level::{MOST_OF_SHARE, least_blocks, most_of_block};
pub use logarithm::{OCTAVE, SHARE};
pub use sensors::Faults;
pub use sliding::Window;
pub use verdict::{CHANNEL_NAMES, Cause, State, Verdict, Words};

use crate::error::{Checks, Error};
use crate::fixed::in_order;
use crate::pipeline::{Chain, Output, RawSample};
use crate::rig::MAX_BAND_TAPS;
use block::Waiting;
use level::{CAUSES, Level, SIDES, sides, values};
use limits::{CHANNELS, Limits};
use sensors::{SensorState, forget};
use sliding::{FAST, SLOW, Sliding};

/// The longest wait for the low-pass over the residual, in samples.
const MOST_WAIT: usize = MAX_BAND_TAPS / 2 + 1;
/// Binary logarithm of the blocks over which the time outside the training range is counted.
const OUTSIDE_MEMORY: u32 = 6;
/// The rate of faults of a sensor that makes the verdict suspect (0.5 %) and raises the alarm (10 %), in 2⁻¹⁶; half of
/// it ends them.
const FAULT_RATES: [i32; 2] = [328, 6554];

/// The monitor of one model on one rig: what is calibrated, apart from what moves ([`MonitorState`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Monitor {
    limits: Limits,
    log_block: u32,
    /// Samples by which the residual in the band is older than the rest of an output.
    wait: usize,
    /// Residuals that a state outside the training range spoils.
    after_outside: u16,
    /// Residuals that a wrong count spoils.
    after_fault: u16,
}

/// What the monitor keeps between samples.
#[derive(Clone, Debug)]
pub struct MonitorState {
    waiting: [[Waiting; 2]; MOST_WAIT],
    newest: usize,
    /// Residuals that are still spoilt.
    spoilt: u16,
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
    shares: [i32; 2],
    seen: Statistics,
}

/// A verdict that is being come to.
#[derive(Clone, Copy, Debug, Default)]
struct Review {
    verdict: Verdict,
    /// Of the change of the joint that it names: how grave it is, whether it has a direction, whether it was said before, how far it is.
    preference: (State, bool, bool, u16),
}

/// Pieces of the end of the sensors' block: the courses of both axes and the rates, which come before everything else, and then the review
/// of both axes and of the sensors.
const END: u8 = 6;
const REVIEW: u8 = 3;

impl Default for MonitorState {
    fn default() -> Self {
        Self {
            waiting: [[Waiting::default(); 2]; MOST_WAIT],
            newest: 0,
            spoilt: 0,
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
        let (axes, mut checks) = (chain.axes() as i32, Checks::new());
        let quantity = "axes of the monitor's limits, against the rig's";
        checks.whole(quantity, limits.axes.len() as i32, axes, axes);
        checks.done()?;
        let (derivative, band) = (chain.spoilt_by_fault(), chain.band().taps.len() as u16);
        Ok(Self {
            log_block: limits.block.trailing_zeros(),
            wait: chain.band_delay() - chain.delay(),
            after_outside: band,
            after_fault: derivative + band,
            limits,
        })
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
        if let Some(output) = output {
            self.take(state, output);
        }
        // A piece per sample, so that the end of a block does not come all at once.
        state.ticks = state.ticks.saturating_add(1);
        if state.ticks >= self.limits.block {
            (state.ticks, state.to_end) = (0, END);
        }
        if state.to_end > REVIEW {
            self.end_block(state);
        } else if state.judging.axes != 0 {
            self.judge(state);
        } else if state.to_end != 0 {
            self.review(state);
        }
        state.verdict
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
            state.spoilt = self.after_fault;
        }
    }

    /// Adds an output to the block that is being filled, unless its residual is spoilt.
    fn take(&self, state: &mut MonitorState, output: &Output) {
        state.newest = if state.newest + 1 < MOST_WAIT {
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
            state.spoilt = state.spoilt.max(self.after_outside);
        }
        if state.spoilt > 0 {
            state.spoilt -= 1;
            return;
        }
        let Some(residual) = output.residual_band else {
            return;
        };
        let place = match state.newest.checked_sub(self.wait) {
            Some(place) => place,
            None => (state.newest + MOST_WAIT).saturating_sub(self.wait),
        };
        let Some(at) = state.waiting.get(place) else {
            return;
        };
        let sums = &mut state.sums[state.filling & 1];
        for (axis, limits) in self.limits.axes.iter().enumerate() {
            let own = axis & 1;
            sums[own].add(limits, &at[own], residual[own]);
        }
        state.count += 1;
        if state.count >= self.limits.block {
            state.blocks = state.blocks.wrapping_add(1);
            state.judging.axes = self.limits.axes.len();
            state.judging.done = 0;
            state.filling ^= 1;
            state.begin_block();
        }
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
            state.spoilt = self.after_fault;
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
            }
            done @ 1..=2 => {
                let input = usize::from(done - 1) & 1;
                judging.shares[input] = sums.share(limits, self.log_block, input);
            }
            3 => judging.seen = sums.judged(limits, self.log_block, judging.shares),
            _ => {
                if judging.seen.moves {
                    state.moved = true;
                    let levels = levels.iter_mut().zip(values(&judging.seen));
                    for (number, ((level, value), side)) in levels.zip(sides(limits)).enumerate() {
                        level.add(value, side, most_of_block(number, side.threshold));
                    }
                }
                (judging.axes, judging.done) = (judging.axes - 1, 0);
                return;
            }
        }
        judging.done += 1;
    }

    /// A piece of the state machine.
    fn review(&self, state: &mut MonitorState) {
        let axis = REVIEW.saturating_sub(state.to_end);
        state.to_end -= 1;
        if axis == 0 {
            self.review_range(state);
        }
        if axis < 2 {
            self.review_joint(state, axis);
        } else {
            review_sensors(state);
            state.verdict = state.review.verdict;
        }
    }

    /// What is to be said where neither joint nor sensors are ill.
    fn review_range(&self, state: &mut MonitorState) {
        let mut verdict = Verdict {
            state: State::Healthy,
            cause: Cause::AsExpected,
            ..Verdict::default()
        };
        if !state.moved {
            verdict.state = State::Unjudged;
            verdict.cause = if state.blocks == 0 {
                Cause::Starting
            } else {
                Cause::TooGentle
            };
        }
        let limit = i32::from(self.limits.outside_permille) * 65;
        state.outside_state = match state.outside_rate {
            rate if rate >= limit => State::Suspect,
            rate if state.outside_state == State::Suspect && rate >= limit / 2 => State::Suspect,
            _ => State::Healthy,
        };
        if state.outside_state == State::Suspect {
            verdict = Verdict {
                state: State::Suspect,
                cause: Cause::OutsideRange,
                permille: permille_of(state.outside_rate),
                ..Verdict::default()
            };
        }
        state.review = Review {
            verdict,
            preference: (State::Suspect, false, false, 0),
        };
    }

    /// Puts a change of the joint on one axis into the verdict where that is as grave as what stands there: a stiffness or a friction
    /// rather than an error that grew, and what was said before rather than something else.
    fn review_joint(&self, state: &mut MonitorState, axis: u8) {
        let (before, number) = (state.verdict, usize::from(axis));
        let Review {
            verdict,
            preference,
        } = &mut state.review;
        let (Some(levels), Some(limits)) =
            (state.levels.get_mut(number), self.limits.axes.get(number))
        else {
            return;
        };
        for ((level, cause), side) in levels.iter_mut().zip(CAUSES).zip(sides(limits)) {
            level.state = level.next(side);
            if level.state < State::Suspect {
                continue;
            }
            let permille = level.permille(side);
            let told = before.cause == cause && before.axis == axis;
            let own = (level.state, cause != Cause::ErrorGrew, told, permille);
            if own > *preference && level.state >= verdict.state {
                *preference = own;
                *verdict = Verdict {
                    state: level.state,
                    cause,
                    axis,
                    channel: 0,
                    permille,
                };
            }
        }
    }
}

/// Puts a fault of a sensor into the verdict where that is as grave as what stands there.
fn review_sensors(state: &mut MonitorState) {
    let (verdict, worst) = (&mut state.review.verdict, state.sensors.worst());
    let [suspect, alarm] = FAULT_RATES;
    let over = |limit: i32, was: bool| worst.rate >= if was { limit / 2 } else { limit };
    state.sensor_state = if over(alarm, state.sensor_state == State::Alarm) {
        State::Alarm
    } else if over(suspect, state.sensor_state >= State::Suspect) {
        State::Suspect
    } else {
        State::Healthy
    };
    if state.sensor_state >= State::Suspect && state.sensor_state >= verdict.state {
        let bit = worst.channels.trailing_zeros() as u8;
        let (axis, channel) = if bit < CHANNELS as u8 {
            (0, bit)
        } else {
            (1, (bit - CHANNELS as u8).min(CHANNELS as u8 - 1))
        };
        *verdict = Verdict {
            state: state.sensor_state,
            cause: worst.cause,
            axis,
            channel,
            permille: permille_of(worst.rate),
        };
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
        sliding.nmse(monitor.log_block)
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
        for (place, (level, side)) in all.iter_mut().zip(levels.iter().zip(sides(limits))) {
            *place = level.permille(side);
        }
        all
    }

    /// How many blocks were finished so far (wrapping), and the sums of the last one: what the limits are made from.
    pub fn last_block(&self) -> (u32, &[Sums; 2]) {
        (self.blocks, &self.sums[(self.filling & 1) ^ 1])
    }
}
