//! The monitor: does the joint still behave like its model, within the range in which the model is
//! valid, and are its sensors well?
//!
//! ```text
//! residual in the band ─┐                     ┌─ error's share of the force ─┐
//! measured force ───────┤                     ├─ part along displacement ────┤
//! predicted force ──────┼─ blocks of samples ─┼─ part along velocity ────────┼─ cumulative sums ─┐
//! state ────────────────┘        │            └─ force that is gone, or is   ┘                   ├─ verdict
//!                                │               not expected                                    │
//!                                ├─ sliding NMSE, share of the time that was judged ─────────────┤
//! outside the range, counts, faults of the sensors ── rates, channels that stand still ──────────┘
//! ```
//!
//! The residual in the band comes at every so many samples, and what is summed up of the others are
//! their values at those instants. Blocks hold only residuals that are free of everything that
//! makes it wrong: a state outside the training range spoils as many residuals as the low-pass has
//! taps, a fault of a sensor as many as the whole chain has. Whether a gross change can be judged
//! follows from the force that should be there as well as from the one that is.
//!
//! *Healthy* holds per axis, and only as long as enough of the recent time was judged
//! ([`AxisHealth`]). `docs/explanation/monitor.md` has the formulas and how the limits are set.
//! Everything is integer, takes no memory beyond [`MonitorState`], and cannot panic; the work at
//! the end of a block is spread over the samples that follow.

mod block;
mod ending;
mod judged;
mod level;
pub mod limits;
mod logarithm;
mod review;
mod sensors;
mod sliding;
mod steps;
mod verdict;

pub use block::{Gross, GrossSums, Statistics, Sums, share_of_change};
pub use judged::RECENT;
pub use level::{MAX_OF_SHARE, least_blocks, most_of_block};
pub use limits::SIDES;
pub use logarithm::{OCTAVE, SHARE};
pub use sensors::Faults;
pub use sliding::Window;
pub use verdict::{CHANNEL_NAMES, Cause, Onset, State, Verdict, Words};

use crate::chain::{Chain, Output, RawSample};
use crate::fault::{Checks, Error};
use crate::wire::rig::MAX_BAND_TAPS;
use block::Waiting;
use judged::{Judged, Reason};
use level::Level;
use limits::{FORCE_CHANNEL, Limits};
use sensors::SensorState;
use sliding::Sliding;
use steps::Ending;

/// The longest wait for the low-pass over the residual and for the sample after it, in samples.
const MAX_WAIT: usize = MAX_BAND_TAPS / 2 + 2;
/// Binary logarithm of the blocks over which the time outside the training range is counted.
const OUTSIDE_MEMORY: u32 = 6;
/// The bits of [`Output::outside`] that are an axis's own: its states and its input.
const OWN_OUTSIDE: [u8; 2] = [0b01_0011, 0b10_1100];
/// A block that has lost more than one in so many of its samples is begun anew.
const MAX_LOST: u32 = 4;

/// The monitor of one model on one rig: what is calibrated, apart from what moves
/// ([`MonitorState`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Monitor {
    limits: Limits,
    /// Binary logarithms of the samples of a block, and of the residuals in the band that come
    /// meanwhile.
    log_block: u32,
    log_values: u32,
    /// Whether there are samples without a residual in the band.
    is_thinned: bool,
    /// Samples by which the residual in the band that is summed up is older than the rest of an
    /// output.
    wait: usize,
    /// Residuals that a state outside the training range spoils.
    after_outside: u16,
    /// Residuals that a wrong count spoils.
    after_fault: u16,
}

/// What the monitor keeps between samples.
#[derive(Clone, Debug, Default)]
pub struct MonitorState {
    waiting: Delayed,
    /// A residual in the band that is summed up with the next sample, where that has none: the
    /// low-pass has enough to do when it comes. With whether a state outside the training
    /// range spoils it.
    held: Option<([i32; 2], bool)>,
    /// Residuals that are still spoilt by a state outside the training range, and by a fault of a
    /// sensor.
    spoilt_outside: u16,
    spoilt_fault: u16,
    /// Whether that fault is samples that were lost.
    is_lost: bool,
    fine: Block<Sums>,
    gross: Block<GrossSums>,
    /// Whether a residual of the gross block was spoilt by a state outside the training range, and
    /// of the one before it.
    gross_outside: [bool; 2],
    /// What kept residuals out of the block, since the last one ended.
    kept_out: Option<Reason>,
    /// Samples that were lost since the block was begun.
    lost: u32,
    levels: [[Level; SIDES]; 2],
    sliding: [[Sliding; 2]; 2],
    sensors: SensorState,
    sensor_state: State,
    /// Samples since the sensors' block began, those that were lost included, and outputs outside
    /// the range among them.
    ticks: u32,
    outside: u16,
    outside_rate: i32,
    ending: Ending,
    axes: [OfAxis; 2],
    verdict: Verdict,
}

/// The last outputs, which wait for the low-pass over the residual.
#[derive(Clone, Debug)]
struct Delayed {
    places: [[Waiting; 2]; MAX_WAIT],
    newest: usize,
}

impl Default for Delayed {
    fn default() -> Self {
        Self {
            places: [[Waiting::default(); 2]; MAX_WAIT],
            newest: 0,
        }
    }
}

/// The sums of the block that is being filled, and of the last one that was, per axis.
#[derive(Clone, Copy, Debug, Default)]
struct Block<S> {
    filling: [S; 2],
    count: u16,
    full: [S; 2],
    /// Whether the full one is still to be judged.
    is_ready: bool,
    /// Blocks that were filled (wrapping).
    number: u32,
}

impl<S: Default + Copy> Block<S> {
    fn begin(&mut self) {
        (self.filling, self.count) = ([S::default(); 2], 0);
    }

    /// Begins anew, and forgets what is still to be judged.
    fn discard(&mut self) {
        self.begin();
        self.is_ready = false;
    }

    /// Whether the next residual fills it.
    fn is_nearly_full(&self, log_values: u32) -> bool {
        (self.count + 1) >> (log_values & 15) != 0
    }

    /// Counts a residual in; true when the block is full, which is then the last one.
    fn counted(&mut self, log_values: u32) -> bool {
        self.count += 1;
        if self.count >> (log_values & 15) == 0 {
            return false;
        }
        self.full = self.filling;
        (self.is_ready, self.number) = (true, self.number.wrapping_add(1));
        self.begin();
        true
    }
}

/// What is kept of one axis besides its sums.
#[derive(Clone, Copy, Debug, Default)]
struct OfAxis {
    judged: Judged,
    /// Outputs outside the range on this axis since the block began, and their rate.
    outside: u16,
    outside_rate: i32,
    is_outside: bool,
    verdict: Verdict,
}

/// How one axis stands, and how much that says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisHealth {
    /// How it stands, and why.
    pub verdict: Verdict,
    /// The part of the last [`RECENT`] blocks that was judged, in 1/1000.
    pub judged_permille: u16,
    /// Samples since the last judged block ended, or since the start; stays at its largest value.
    pub unjudged_samples: u32,
}

impl Monitor {
    /// The monitor behind one chain.
    ///
    /// # Errors
    /// [`Error`] names the limit that is not usable, or says that the limits are not for as many
    /// axes as the chain has.
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
            wait: chain.band_delay() - chain.delay() + usize::from(chain.band_every() > 1),
            after_outside: band,
            after_fault: derivative + band,
            limits,
        })
    }

    /// Binary logarithm of the residuals in the band that a block sums up: what
    /// [`Sums::statistics`] wants to know.
    pub fn log_values(&self) -> u32 {
        self.log_values
    }

    /// The limits that it judges by.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Takes one sample in: the counts, what the chain made of them, and what was wrong with the
    /// sensors.
    // With what it calls for every output, so that the C library need not put an `Output` together.
    #[inline]
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
        state.ticks = state.ticks.saturating_add(faults.lost).saturating_add(1);
        // After a gap nothing is put off: the next sample may be as far away.
        while self.end(state) && faults.lost != 0 {}
        state.verdict
    }

    /// The faults with those of forces at a rail: bit a of `saturated` for axis a.
    #[inline(never)]
    fn with_saturated(&self, faults: &Faults, saturated: u8) -> Faults {
        let mut faults = *faults;
        for axis in 0..self.limits.axes.len() {
            if saturated & (1 << (axis & 7)) != 0 {
                faults.saturated |= Faults::bit(axis, FORCE_CHANNEL);
            }
        }
        faults
    }

    #[inline(never)]
    fn sense(&self, state: &mut MonitorState, raw: &RawSample, faults: &Faults) {
        state.sensors.sample(&self.limits, raw, faults);
        if faults.any() {
            state.spoilt_fault = self.after_fault;
            state.is_lost = faults.lost != 0;
            state.held = None;
            state.lost = state.lost.saturating_add(faults.lost);
            if state.lost > u32::from(self.limits.block) / MAX_LOST {
                state.fine.begin();
                state.gross.begin();
                state.gross_outside[0] = false;
                state.lost = 0;
            }
        }
    }

    /// Adds an output to the blocks that are being filled where it has a residual in the band,
    /// unless that is spoilt.
    #[inline]
    fn take(&self, state: &mut MonitorState, output: &Output) {
        Self::put(&mut state.waiting, output);
        if output.outside != 0 {
            state.outside = state.outside.saturating_add(1);
            for (axis, own) in state.axes.iter_mut().enumerate() {
                let is_own = output.outside & OWN_OUTSIDE[axis & 1] != 0;
                own.outside = own.outside.saturating_add(u16::from(is_own));
            }
            state.spoilt_outside = self.after_outside;
        }
        let is_outside = state.spoilt_outside > 0;
        state.spoilt_outside = state.spoilt_outside.saturating_sub(1);
        let mut residual = output.residual_band.map(|residual| (residual, is_outside));
        if state.spoilt_fault > 0 {
            state.spoilt_fault -= 1;
            let reasons = [Reason::Sensor, Reason::Lost];
            state.kept_out = Some(reasons[usize::from(state.is_lost)]);
            residual = None;
        }
        if self.is_thinned {
            let comes = residual.is_some();
            residual = core::mem::replace(&mut state.held, residual);
            if comes {
                return;
            }
        }
        if let Some((residual, is_outside)) = residual {
            self.add(state, residual, is_outside);
        }
    }

    /// Puts what of an output has to wait behind those before it.
    #[inline]
    fn put(waiting: &mut Delayed, output: &Output) {
        waiting.newest = if waiting.newest + 1 < MAX_WAIT {
            waiting.newest + 1
        } else {
            0
        };
        if let Some(place) = waiting.places.get_mut(waiting.newest) {
            let ([x, v, phi, omega], [r, s], [p, q]) =
                (output.state, output.measured, output.predicted);
            *place = [
                Waiting::new([x, v], [r, p]),
                Waiting::new([phi, omega], [s, q]),
            ];
        }
    }

    /// Adds a residual in the band, and what belongs to the same instant.
    fn add(&self, state: &mut MonitorState, residual: [i32; 2], is_outside: bool) {
        let waiting = &state.waiting;
        let place = match waiting.newest.checked_sub(self.wait) {
            Some(place) => place,
            None => (waiting.newest + MAX_WAIT).saturating_sub(self.wait),
        };
        let Some(at) = waiting.places.get(place) else {
            return;
        };
        // A block that is being judged stays as it is until that is done: what would fill the next
        // one meanwhile is left out.
        let is_judging = state.ending.is_under_way();
        let takes_gross = !(is_judging && state.gross.is_nearly_full(self.log_values));
        let takes_fine = !(is_outside || is_judging && state.fine.is_nearly_full(self.log_values));
        for (axis, limits) in self.limits.axes.iter().enumerate() {
            let own = axis & 1;
            let sample = at[own].with(residual[own], limits);
            if takes_gross {
                state.gross.filling[own].add(&sample);
            }
            if takes_fine {
                state.fine.filling[own].add(&sample);
            }
        }
        if takes_gross {
            let [of_this, of_last] = &mut state.gross_outside;
            *of_this |= is_outside;
            if state.gross.counted(self.log_values) {
                (*of_last, *of_this) = (*of_this, false);
            }
        }
        if is_outside {
            state.kept_out.get_or_insert(Reason::Outside);
        } else if takes_fine && state.fine.counted(self.log_values) {
            state.lost = 0;
        }
    }
}

/// 1/1000 of a rate in 2⁻¹⁶.
fn permille_of(rate: i32) -> u16 {
    ((rate.clamp(0, 1 << 16) * 1000 + (1 << 15)) >> 16) as u16
}

impl MonitorState {
    /// Whether the next sample does a step of the end of a block.
    pub fn is_ending(&self) -> bool {
        self.ending.is_under_way()
    }

    /// What the last [`Monitor::update`] said of the joint.
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// 100·Σe²/(N·var r) over a sliding window, in 1/1000 %, of the residual in the common band
    /// against the measured force at the same instants; none while the force does not vary.
    ///
    /// Recursive over blocks: each new one counts 1/16 or 1/1024. One long division: for telemetry,
    /// not for every sample.
    pub fn nmse(&self, monitor: &Monitor, axis: usize, window: Window) -> Option<u32> {
        let windows = self.sliding.get(axis)?;
        let sliding = windows.get(usize::from(window == Window::Slow))?;
        sliding.nmse(monitor.log_values)
    }

    /// The part of the time outside the training range, in 1/1000, over the last 64 blocks or so.
    pub fn outside_permille(&self) -> u16 {
        permille_of(self.outside_rate)
    }

    /// How an axis stands, and how much that says.
    pub fn axis(&self, monitor: &Monitor, axis: usize) -> AxisHealth {
        let Some(own) = self.axes.get(axis) else {
            return AxisHealth::default();
        };
        let most = u32::MAX >> (monitor.log_block & 31);
        AxisHealth {
            // Two axes at most; before the first block has ended, too.
            verdict: Verdict {
                axis: axis as u8,
                ..own.verdict
            },
            judged_permille: own.judged.permille(),
            unjudged_samples: own.judged.since().min(most) << (monitor.log_block & 31),
        }
    }

    /// How far each cumulative sum of an axis is, in 1/1000 of its threshold: error, stiffer,
    /// softer, more friction, less, a force that is gone and one that nobody expects.
    pub fn levels(&self, monitor: &Monitor, axis: usize) -> [u16; SIDES] {
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

    /// How many blocks were finished so far (wrapping), and the sums of the last one: what the
    /// limits are made from.
    pub fn last_block(&self) -> (u32, &[Sums; 2]) {
        (self.fine.number, &self.fine.full)
    }

    /// The same of the blocks by which a gross change is found, and whether a state was outside the
    /// training range.
    pub fn last_gross_block(&self) -> (u32, &[GrossSums; 2], bool) {
        let [_, outside] = self.gross_outside;
        (self.gross.number, &self.gross.full, outside)
    }
}
