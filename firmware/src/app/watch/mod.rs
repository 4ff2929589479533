//! The third step of a sample: the monitor, and what it has to tell.

mod told;

pub use told::Streamed;

use super::channels::Places;
use super::evaluation::Evaluated;
use crate::clock::Rate;
use crate::sensor::acquire::CHIPS;
use crate::sensor::presence::ChipState;
use crate::store::{Ended, Trial};
use heapless::Deque;
use jointwatch_shared::chain::Output;
use jointwatch_shared::monitor::{Cause, Faults, Monitor, MonitorState, State, Verdict as Said};
use jointwatch_shared::wire::capture::{Capture, Chunk, NoPiece};
use jointwatch_shared::wire::snapshot::Recorder;
use jointwatch_shared::wire::telemetry::{
    Alarm, Answered, CapturePiece, Counters, Event, KeptAlarm, STATUS_HZ, Slot,
};

/// Samples in a row without a usable code after which a chip is told to be missing: longer than it
/// takes to start.
const MISSING_AFTER: u8 = 64;
/// Fitted chips that may be unusable in a sample that counts for a trial: a chip that died is not
/// the new model's fault.
const DEAD_IN_TRIAL: u8 = 1;
/// Seconds of an hour, which erasures are counted by.
const HOUR_S: u32 = 3600;
/// Events that wait for the line.
const EVENTS: usize = 16;
/// The model that is on trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnTrial {
    pub(super) slot: Slot,
    /// It has a rig block, so that samples without an output prove nothing.
    pub(super) evaluates: bool,
    /// There is another model to go back to.
    pub(super) fallback: bool,
}

/// What is kept of one chip.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    bus_errors: u32,
    crc_errors: u32,
    /// Samples in a row without a usable code.
    silent: u8,
}

/// The monitor and everything that is told of it.
#[derive(Debug)]
pub struct Watch {
    monitor: Result<Monitor, Cause>,
    state: MonitorState,
    verdict: Said,
    counters: Counters,
    chips: [Tally; CHIPS],
    /// What was wrong with the channels since the last status report.
    faults: Faults,
    places: Places,
    events: Deque<Event, EVENTS>,
    recorder: Recorder,
    capture: Capture,
    samples: u64,
    status_every: u32,
    status_left: u32,
    /// A status was told, and how the axes stand is still to be; then what outlasts a loss of
    /// power, and the alarm that stands.
    health_due: bool,
    upkeep_due: bool,
    alarm_due: bool,
    /// The first alarm since the last one was acknowledged.
    alarm: Option<Alarm>,
    /// It is to be written into flash; and it could not be, so that it is tried again after an
    /// hour.
    keep_due: bool,
    not_kept: bool,
    /// The alarm of an earlier run.
    kept: Option<KeptAlarm>,
    development_key: bool,
    /// Sampling instants until an hour is over.
    hour_left: u32,
    hour_over: bool,
    stream_every: u16,
    stream_left: u16,
    rate_hz: u32,
    trial: Trial,
    on_trial: Option<OnTrial>,
    proven: bool,
    /// Samples until the device restarts with a new model.
    restart_in: Option<u32>,
}

impl Watch {
    /// With a monitor, or with the reason why there is none.
    pub(super) fn new(monitor: Result<Monitor, Cause>) -> Self {
        let mut watch = Self {
            monitor: Err(Cause::Starting),
            state: MonitorState::default(),
            verdict: Said::default(),
            counters: Counters::default(),
            chips: [Tally::default(); CHIPS],
            faults: Faults::default(),
            places: Places::default(),
            events: Deque::new(),
            recorder: Recorder::new(1),
            capture: Capture::new(&mut []),
            samples: 0,
            status_every: 1,
            status_left: 0,
            health_due: false,
            upkeep_due: false,
            alarm_due: false,
            alarm: None,
            keep_due: false,
            not_kept: false,
            kept: None,
            development_key: false,
            hour_left: 0,
            hour_over: false,
            stream_every: 0,
            stream_left: 0,
            rate_hz: 1,
            trial: Trial::none(),
            on_trial: None,
            proven: false,
            restart_in: None,
        };
        watch.judge(monitor);
        watch
    }

    /// Judges with this monitor from now on, or says why nothing is judged.
    pub(super) fn judge(&mut self, monitor: Result<Monitor, Cause>) {
        self.verdict = match &monitor {
            Ok(_) => Said::default(),
            Err(cause) => Said::without(*cause),
        };
        self.monitor = monitor;
    }

    /// Sets what follows from the sample rate and the wiring, and takes over what the start has to
    /// tell.
    pub(super) fn start(
        &mut self,
        rate: Rate,
        places: Places,
        development_key: bool,
        events: &[Event],
    ) {
        // Between 1 and 10,000, as the start has checked.
        self.rate_hz = rate.samples(1);
        self.hour_left = rate.samples(HOUR_S);
        self.development_key = development_key;
        self.status_every = (self.rate_hz / STATUS_HZ).max(1);
        self.recorder = Recorder::new(self.rate_hz);
        self.places = places;
        for event in events {
            self.tell(*event);
        }
    }

    /// Keeps the counts around an alarm in this memory of the board.
    pub fn keep_counts(&mut self, chunks: &'static mut [Chunk]) {
        self.capture = Capture::new(chunks);
    }

    /// A piece of the counts around the alarm.
    ///
    /// # Errors
    /// What is answered when there is none.
    pub fn counts(&self, piece: u16) -> Result<CapturePiece, Answered> {
        self.capture.piece(piece).map_err(|why| match why {
            NoPiece::Nothing => Answered::Nothing,
            NoPiece::Unfinished => Answered::Busy,
        })
    }

    /// Puts the model on trial.
    pub(super) fn try_out(&mut self, trial: Trial, of: OnTrial) {
        (self.trial, self.on_trial) = (trial, Some(of));
    }

    /// The model on trial cannot run: the one before it takes its place with the next restart,
    /// which is soon.
    pub(super) fn give_up(&mut self) {
        self.trial = Trial::none();
        if self.on_trial.is_some_and(|of| of.fallback) {
            self.restart_soon();
        }
    }

    /// An event for the host; dropped and counted when too many wait already.
    pub fn tell(&mut self, event: Event) {
        if self.events.push_back(event).is_err() {
            self.dropped(1);
        }
    }

    /// Counts frames that were not sent.
    pub fn dropped(&mut self, frames: u32) {
        let dropped = &mut self.counters.frames_dropped;
        *dropped = dropped.saturating_add(frames);
    }

    /// Counts a damaged frame that was received.
    pub fn damaged(&mut self) {
        self.counters.link_errors = self.counters.link_errors.saturating_add(1);
    }

    /// Takes one sample in; gives it back when it is to be streamed.
    pub fn update(&mut self, evaluated: &Evaluated) -> Option<Streamed> {
        let frame = &evaluated.frame;
        let output = evaluated.output.as_ref();
        self.samples = frame.number.saturating_add(1);
        let mut faults = frame.faults;
        if frame.follows_gap() {
            faults.missing |= self.places.all_bits();
            faults.lost = frame.missed.saturating_add(frame.overruns);
        }
        let counters = &mut self.counters;
        counters.missed_deadlines = counters.missed_deadlines.saturating_add(frame.missed);
        counters.queue_overruns = counters.queue_overruns.saturating_add(frame.overruns);
        if let Some(output) = output {
            let at_rail = (output.saturated & Output::RAILS).count_ones();
            counters.saturated = counters.saturated.saturating_add(at_rail);
            self.recorder.sample(output.residual);
        }
        let (axes, gap) = (self.places.axes, frame.follows_gap());
        self.capture.sample(frame.number, &frame.sample, axes, gap);
        let unusable = self.chips_did(&frame.health);
        self.remember(&faults);
        if let Ok(monitor) = &self.monitor {
            let said = monitor.update(&mut self.state, &frame.sample, output, &faults);
            self.say(said);
        }
        if let Some(of) = self.on_trial {
            let evaluated = output.is_some() || !of.evaluates;
            let healthy = evaluated && unusable <= DEAD_IN_TRIAL && !frame.follows_gap();
            let lost = frame.missed.saturating_add(frame.overruns);
            match self.trial.sample(healthy, lost) {
                Some(Ended::Proven) => self.proven = true,
                Some(Ended::TooLate) => self.give_up(),
                None => {}
            }
        }
        self.hour_left = self
            .hour_left
            .saturating_sub(frame.missed)
            .saturating_sub(1);
        self.hour_over |= self.hour_left == 0;
        self.restart_in = self.restart_in.map(|left| left.saturating_sub(1));
        self.status_left = self.status_left.saturating_sub(1);
        self.stream(evaluated)
    }

    /// Tells a verdict of another kind than the one before, and keeps the residual around an alarm.
    fn say(&mut self, said: Said) {
        let before = self.verdict;
        self.verdict = said;
        if said.same_reason(&before) {
            return;
        }
        if said.state == State::Alarm && before.state != State::Alarm {
            self.keep_due |= self.alarm.is_none() && self.kept.is_none();
            let alarm = self.alarm.get_or_insert(Alarm {
                sample: self.samples,
                verdict: said.into(),
                alarms: 0,
            });
            alarm.alarms = alarm.alarms.saturating_add(1);
            self.capture.alarm(self.samples);
        }
        self.tell(Event::Verdict(said.into()));
        self.recorder.verdict(&before, &said);
    }

    /// Counts what went wrong with each chip, and tells when one falls silent or comes back. Gives
    /// how many fitted chips have no usable code.
    fn chips_did(&mut self, health: &[ChipState; CHIPS]) -> u8 {
        let mut unusable = 0;
        for (chip, health) in health.iter().enumerate() {
            let Some(tally) = self.chips.get_mut(chip) else {
                break;
            };
            match health {
                ChipState::NotFitted => continue,
                ChipState::Ok | ChipState::Saturated | ChipState::Starting => {}
                ChipState::Crc => tally.crc_errors = tally.crc_errors.saturating_add(1),
                ChipState::Bus
                | ChipState::Identity
                | ChipState::Settings
                | ChipState::TimedOut
                | ChipState::Restarted => tally.bus_errors = tally.bus_errors.saturating_add(1),
            }
            unusable += u8::from(!health.usable());
            let was_missing = tally.silent >= MISSING_AFTER;
            tally.silent = if health.usable() {
                0
            } else {
                tally.silent.saturating_add(1).min(MISSING_AFTER)
            };
            let is_missing = tally.silent >= MISSING_AFTER;
            if is_missing != was_missing
                && let Some(channel) = self.places.first_channel(chip)
            {
                self.tell(if is_missing {
                    Event::SensorMissing { channel }
                } else {
                    Event::SensorBack { channel }
                });
            }
        }
        unusable
    }

    fn remember(&mut self, faults: &Faults) {
        let kept = &mut self.faults;
        kept.saturated |= faults.saturated;
        kept.out_of_range |= faults.out_of_range;
        kept.checksum |= faults.checksum;
        kept.time_out |= faults.time_out;
        kept.missing |= faults.missing;
        kept.reference_lost |= faults.reference_lost;
    }

    /// True once, when the model on trial has run long enough: it is to be marked.
    pub fn take_proven(&mut self) -> bool {
        core::mem::take(&mut self.proven)
    }

    /// Says whether the mark could be set; if not, the trial goes on as long as its time lasts.
    pub fn confirmed(&mut self, marked: bool) {
        self.trial.marked(marked);
        if marked && let Some(of) = self.on_trial.take() {
            self.tell(Event::ModelConfirmed { slot: of.slot });
        }
    }

    /// Whether there is an alarm that nobody has acknowledged.
    pub fn has_alarm(&self) -> bool {
        self.alarm.is_some() || self.kept.is_some()
    }

    /// An alarm of an earlier run still stands.
    pub(super) fn stands(&mut self, alarm: KeptAlarm) {
        self.kept = Some(alarm);
    }

    /// The alarm that is to be written into flash, once.
    pub fn alarm_to_keep(&mut self) -> Option<KeptAlarm> {
        let alarm = self.alarm?;
        core::mem::take(&mut self.keep_due).then_some(KeptAlarm {
            sample: alarm.sample,
            verdict: alarm.verdict,
        })
    }

    /// It could not be written, which may have cost a place of the journal: it is tried again after
    /// an hour.
    pub fn not_kept(&mut self) {
        self.not_kept = true;
    }

    /// The alarm that stands has been seen.
    pub fn acknowledged(&mut self) {
        (self.alarm, self.kept) = (None, None);
        (self.keep_due, self.not_kept) = (false, false);
        self.capture.release();
    }

    /// True once after every hour of sampling.
    pub fn take_hour(&mut self) -> bool {
        let over = core::mem::take(&mut self.hour_over);
        if over {
            // At most 10,000 samples a second.
            self.hour_left = self.rate_hz * HOUR_S;
            self.keep_due |= core::mem::take(&mut self.not_kept);
        }
        over
    }

    /// A new model is in place: the device is to restart in a second, when the host has had its
    /// answer.
    pub fn restart_soon(&mut self) {
        self.restart_in = Some(self.rate_hz);
    }

    /// Whether that second is over.
    pub fn restart_now(&self) -> bool {
        self.restart_in == Some(0)
    }

    /// What it says now.
    pub fn verdict(&self) -> Said {
        self.verdict
    }

    /// What was counted so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }
}
