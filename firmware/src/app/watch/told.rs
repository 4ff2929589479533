//! What the watch tells: samples, how device and joint stand, events, and the answers to what is
//! asked of it.

use super::{Tally, Watch};
use crate::app::evaluation::Evaluated;
use crate::sensor::acquire::CHIPS;
use heapless::Vec;
use jointwatch_shared::chain::{Output, RawSample};
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::monitor::{Faults, MonitorState, State, Verdict as Said, Window};
use jointwatch_shared::wire::telemetry::{
    Answered, AxisStatus, Counters, Health, MAX_FRAME, Report, Request, STATUS_HZ, Sample,
    SensorStatus, Status, Supply, Upkeep, Verdict,
};

/// Bits that a byte takes on the line.
const BITS: u32 = 10;

/// The longest frame of a streamed sample, which a test pins.
const SAMPLE_FRAME: u32 = 128;
/// The longest frame that tells how the axes stand, which a test pins.
const HEALTH_FRAME: u32 = 56;
/// The longest frame that tells of an alarm, which a test pins.
const ALARM_FRAME: u32 = 30;
/// The longest frame that tells what outlasts a loss of power, which a test pins.
const UPKEEP_FRAME: u32 = 33;

/// One sample for the host, when it asked for a stream.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Streamed {
    number: u64,
    axes: u8,
    raw: RawSample,
    output: Option<Output>,
}

impl Streamed {
    /// The sample as a message of the telemetry.
    pub fn report(&self) -> Report {
        let axes = usize::from(self.axes);
        Report::Sample(Sample::new(
            self.number,
            &self.raw,
            axes,
            self.output.as_ref(),
        ))
    }
}

impl Watch {
    /// The sample for the stream, when it is its turn.
    pub(super) fn stream(&mut self, evaluated: &Evaluated) -> Option<Streamed> {
        if self.stream_every == 0 {
            return None;
        }
        if self.stream_left > 1 {
            self.stream_left -= 1;
            return None;
        }
        // One of every few samples begins with one that has a residual in the band, or might never
        // meet another.
        let output = evaluated.output.as_ref();
        let without_band = output.is_some_and(|output| output.residual_band.is_none());
        if self.stream_left == 0 && self.stream_every > 1 && without_band {
            return None;
        }
        self.stream_left = self.stream_every;
        Some(Streamed {
            number: evaluated.frame.number,
            axes: self.places.axes,
            raw: evaluated.frame.sample,
            output: evaluated.output,
        })
    }

    /// The next thing that is to be told, besides streamed samples: events first, then a status
    /// report when it is time for one, then pieces of a snapshot.
    pub fn to_tell(&mut self) -> Option<Report> {
        if let Some(event) = self.events.pop_front() {
            return Some(Report::Event(event));
        }
        if self.status_left == 0 && self.samples > 0 {
            self.status_left = self.status_every;
            (self.health_due, self.upkeep_due, self.alarm_due) = (true, true, true);
            return Some(Report::Status(self.status()));
        }
        if core::mem::take(&mut self.health_due) {
            return Some(Report::Health(self.health()));
        }
        if core::mem::take(&mut self.upkeep_due) {
            // Of the supply whoever sends it knows more.
            return Some(Report::Upkeep(Upkeep {
                alarm: self.kept,
                supply: Supply::default(),
            }));
        }
        if core::mem::take(&mut self.alarm_due)
            && let Some(alarm) = self.alarm
        {
            return Some(Report::Alarm(alarm));
        }
        self.recorder.piece().map(Report::Snapshot)
    }

    fn health(&self) -> Health {
        let counters = &self.counters;
        let mut health = Health {
            sample: self.samples,
            samples_lost: counters
                .missed_deadlines
                .saturating_add(counters.queue_overruns),
            axes: Vec::new(),
        };
        if let Ok(monitor) = &self.monitor {
            for axis in 0..usize::from(self.places.axes).min(2) {
                // The list holds two.
                let _ = health.axes.push(self.state.axis(monitor, axis).into());
            }
        }
        health
    }

    /// What was counted of the chips that feed a channel.
    fn tally(&self, axis: usize, channel: usize) -> Tally {
        let mut all = Tally::default();
        for chip in self.places.of_channel(axis, channel).into_iter().flatten() {
            let own = self.chips.get(usize::from(chip));
            let own = own.copied().unwrap_or_default();
            all.bus_errors = all.bus_errors.saturating_add(own.bus_errors);
            all.crc_errors = all.crc_errors.saturating_add(own.crc_errors);
        }
        all
    }

    fn status(&mut self) -> Status {
        let axes = usize::from(self.places.axes);
        let mut status = Status {
            sample: self.samples,
            verdict: Verdict::from(self.verdict),
            outside_permille: self.state.outside_permille(),
            axes: Vec::new(),
            channels: Vec::new(),
            counters: self.counters,
            development_key: self.development_key,
        };
        if let Ok(monitor) = &self.monitor {
            for axis in 0..axes.min(2) {
                let nmse = |window| self.state.nmse(monitor, axis, window);
                // The list holds two.
                let _ = status.axes.push(AxisStatus {
                    nmse_fast: nmse(Window::Fast),
                    nmse_slow: nmse(Window::Slow),
                });
            }
        }
        for axis in 0..axes.min(2) {
            for channel in 0..CHANNELS {
                let tally = self.tally(axis, channel);
                // The list holds the channels of two axes.
                let _ = status.channels.push(SensorStatus {
                    fault: cause(&self.faults, Faults::bit(axis, channel)),
                    bus_errors: tally.bus_errors,
                    crc_errors: tally.crc_errors,
                });
            }
        }
        self.faults = Faults::default();
        status
    }

    /// Does what a request asks of the monitor; `None` for one that is not for it. `line_baud` is
    /// what the line carries, in bits per second; `None` for one that always keeps up.
    pub fn ask(&mut self, request: &Request, line_baud: Option<u32>) -> Option<Answered> {
        match request {
            Request::Ping => Some(Answered::Done),
            Request::Stream { every } => Some(self.ask_stream(*every, line_baud)),
            // Whoever is on the line must not take back what is said of the joint.
            Request::ResetStatistics if self.verdict.state >= State::Suspect => {
                Some(Answered::Busy)
            }
            Request::ResetStatistics => {
                self.state = MonitorState::default();
                self.counters = Counters::default();
                self.chips = [Tally::default(); CHIPS];
                self.faults = Faults::default();
                if self.monitor.is_ok() {
                    self.verdict = Said::default();
                }
                Some(Answered::Done)
            }
            Request::Snapshot => Some(if self.recorder.again() {
                Answered::Done
            } else {
                Answered::Nothing
            }),
            Request::Hello
            | Request::Upload(_)
            | Request::Order { .. }
            | Request::Capture { .. } => None,
        }
    }

    /// Streams when the line carries it beside the status reports, the longest frames assumed.
    fn ask_stream(&mut self, every: u16, line_baud: Option<u32>) -> Answered {
        if every > 0
            && let Some(baud) = line_baud
        {
            // Bits per `every` samples on both sides, so that nothing is divided.
            let wanted =
                u64::from(BITS * SAMPLE_FRAME + BITS) * u64::from(self.rate_hz) / u64::from(every);
            let status = MAX_FRAME as u32 + HEALTH_FRAME + UPKEEP_FRAME + ALARM_FRAME;
            let status = u64::from(BITS * status * STATUS_HZ);
            if wanted + status > u64::from(baud) {
                return Answered::LineTooSlow;
            }
        }
        self.stream_every = every;
        self.stream_left = 0;
        Answered::Done
    }
}

/// The code of what is wrong with a channel; 0 when nothing is.
fn cause(faults: &Faults, bit: u16) -> u8 {
    let mut kinds = faults.kinds().into_iter();
    let wrong = kinds.find(|(_, channels)| channels & bit != 0);
    wrong.map_or(0, |(cause, _)| cause.tag())
}
