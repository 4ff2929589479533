//! A device as it is now: fed with what is heard of it, and shown by the terminal and by the lab's
//! page alike.
//!
//! Nothing is computed here of the joint: the device has judged. What it says is kept, put into
//! words, and thinned for plots. Everything that is text has been made printable, as the line may
//! carry anything.

mod picture;
mod trace;

pub use picture::{AxisPicture, Counter, Happened, Picture, SensorPicture};
pub use trace::{COLUMN_S, Column, Forces, LoopPoint, SHOWN_S, Trace};

use super::telemetry::listen::{Heard, Tally};
use super::telemetry::steady::News;
use super::telemetry::words::{self, Reader};
use crate::text::printable;
use jointwatch_shared::wire::telemetry::{
    Answered, AxisHealth, Health, Occasion, Report, Sample, Status, Verdict,
};
use std::collections::VecDeque;
use std::time::Duration;

/// Frames come ten times a second; without any for so long the view says so.
pub const SILENCE: Duration = Duration::from_secs(2);
/// Things that happened which are kept.
const KEPT: usize = 200;
/// By so many samples a status may overtake a sample.
const OVERTAKEN: u64 = 1000;
/// Over so long the device's time is held against this computer's.
const SPEED_S: f64 = 4.0;

/// A device as it is now.
#[derive(Clone, Debug, Default)]
pub struct LiveView {
    source: String,
    reader: Reader,
    link: Link,
    tally: Tally,
    /// When the last message came, or the line was opened.
    heard_at: Duration,
    introduced: Option<String>,
    status: Option<Status>,
    health: Option<Health>,
    /// The alarm that is not acknowledged, and the statuses since it was told last: it comes with
    /// every status while it stands.
    alarm: Option<(String, u32)>,
    traces: [Trace; 2],
    happened: VecDeque<Happened>,
    numbered: u64,
    /// The device's newest sample, and when it came, now and before.
    sample: Option<u64>,
    seen: VecDeque<(Duration, f64)>,
    /// Counts how often plots began anew.
    generation: u64,
}

/// How the line is.
#[derive(Clone, Debug, Default, PartialEq)]
enum Link {
    #[default]
    Opening,
    Open,
    Lost(String),
    Ended,
}

impl LiveView {
    /// A view of what comes over the line of this name.
    pub fn new(source: &str) -> Self {
        Self {
            source: printable::line(source),
            ..Self::default()
        }
    }

    /// Takes what was heard; `now` goes on with the clock of this computer, from any beginning.
    pub fn hear(&mut self, heard: &[Heard], tally: Tally, now: Duration) {
        self.tally = tally;
        for heard in heard {
            match heard {
                Heard::Message(received) => {
                    self.heard_at = now;
                    self.message(&received.message);
                }
                // Counted in the tally.
                Heard::Lost(_) | Heard::Unknown(_) => {}
                Heard::Restarted => {
                    self.begin_anew();
                    self.happens("the device has started anew");
                }
            }
        }
        self.note_speed(now);
    }

    /// Takes what became of the line.
    pub fn learn(&mut self, news: &News, now: Duration) {
        match news {
            News::Open => {
                self.heard_at = now;
                if let Link::Lost(_) = self.link {
                    self.happens("the line is back");
                }
                self.link = Link::Open;
                self.seen.clear();
            }
            News::Lost(why) => {
                self.happens(&format!("the line is lost: {why}"));
                self.link = Link::Lost(printable::line(why));
            }
            News::End => self.link = Link::Ended,
        }
    }

    /// Whether there will be no more.
    pub fn has_ended(&self) -> bool {
        self.link == Link::Ended
    }

    /// What is drawn, for each of the device's axes.
    pub fn traces(&self) -> &[Trace] {
        let axes = self.reader.model().map_or(0, |model| model.axes.len());
        &self.traces[..axes.min(2)]
    }

    /// What happened, the oldest first.
    pub fn happened(&self) -> impl DoubleEndedIterator<Item = &Happened> {
        self.happened.iter()
    }

    /// Changes when the plots begin anew: with a restart or another model.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// What is to be read.
    pub fn picture(&self, now: Duration) -> Picture {
        let silent = now.saturating_sub(self.heard_at);
        let is_silent = self.link != Link::Ended && silent >= SILENCE;
        let (state, reason) = self.verdict(is_silent.then_some(silent));
        Picture {
            state,
            reason,
            line: self.line(),
            silent_s: is_silent.then_some(silent.as_secs_f64()),
            time_s: self.time_s(),
            speed: self.speed().filter(|_| !is_silent),
            device: self.introduced.clone(),
            axes: self.axes(),
            sensors: self.sensors(),
            outside_percent: self
                .status
                .as_ref()
                .map(|status| f64::from(status.outside_permille) / 10.0),
            alarm: self.alarm.as_ref().map(|(alarm, _)| alarm.clone()),
            counters: self.counters(),
        }
    }

    fn verdict(&self, silent: Option<Duration>) -> (String, String) {
        let said = self.status.as_ref().map(|status| status.verdict);
        let said = said.map(|verdict| {
            (
                state(&verdict),
                printable::line(&self.reader.reason(&verdict)),
            )
        });
        match (silent, said) {
            (Some(silent), None) => (
                "silent".into(),
                format!(
                    "no frames for {} s; is the device powered, and this its line and its baud rate?",
                    silent.as_secs()
                ),
            ),
            (Some(silent), Some((state, reason))) => (
                "silent".into(),
                format!(
                    "no frames for {} s; the last said {state}: {reason}",
                    silent.as_secs()
                ),
            ),
            (None, Some(said)) => said,
            (None, None) => ("not judged".into(), "nothing was heard yet".into()),
        }
    }

    fn line(&self) -> String {
        let how = match &self.link {
            Link::Opening => "opening".into(),
            Link::Open => "connected".into(),
            Link::Lost(why) => format!("lost, trying again ({why})"),
            Link::Ended => "at its end".into(),
        };
        format!("{}: {how}", self.source)
    }

    fn rate_hz(&self) -> Option<f64> {
        let rate = self.reader.rig()?.sample_rate_hz;
        (rate.is_finite() && rate > 0.0).then_some(rate)
    }

    fn time_s(&self) -> Option<f64> {
        Some(self.sample? as f64 / self.rate_hz()?)
    }

    fn axes(&self) -> Vec<AxisPicture> {
        let told = self.health.as_ref().map_or(&[][..], |health| &health.axes);
        let errors = self.status.as_ref().map_or(&[][..], |status| &status.axes);
        let known = self.reader.model().map_or(0, |model| model.axes.len());
        let count = known.max(told.len()).max(errors.len()).min(2);
        // A device without limits tells of no axis; what it says of the joint then holds for each.
        let of_joint = AxisHealth {
            verdict: self.status.as_ref().map(|s| s.verdict).unwrap_or_default(),
            ..AxisHealth::default()
        };
        let axis = |number: usize| {
            let health = told.get(number).copied().unwrap_or(of_joint);
            let change = health.verdict.read().filter(|v| v.cause.is_damage());
            let percent = |permille: u32| f64::from(permille) / 1e3;
            AxisPicture {
                name: printable::line(&self.reader.name(number)),
                unit: self.unit(number).into(),
                state: state(&health.verdict),
                reason: printable::line(&self.reader.reason(&health.verdict)),
                age_s: self
                    .rate_hz()
                    .map(|rate| f64::from(health.unjudged_samples) / rate),
                judged_percent: f64::from(health.judged_permille) / 10.0,
                limit_percent: change.map(|v| f64::from(v.permille) / 10.0),
                nmse_percent: errors.get(number).map_or([None; 2], |error| {
                    [error.nmse_fast, error.nmse_slow].map(|n| n.map(percent))
                }),
                forces: self.traces[number]
                    .last()
                    .map(|f| [f.measured, f.predicted, f.residual]),
            }
        };
        (0..count).map(axis).collect()
    }

    fn unit(&self, axis: usize) -> &'static str {
        let model = self.reader.model();
        let axis = model.and_then(|model| model.axes.get(axis));
        axis.map_or("", |axis| words::unit(axis.kind))
    }

    fn sensors(&self) -> Vec<SensorPicture> {
        let channels = self.status.as_ref().map_or(&[][..], |s| &s.channels);
        let channels = channels.iter().enumerate();
        channels
            .map(|(number, channel)| SensorPicture {
                name: printable::line(&self.reader.channel(number)),
                trouble: words::trouble(channel),
            })
            .collect()
    }

    fn counters(&self) -> Vec<Counter> {
        let counter = |(count, what, bad)| Counter { what, count, bad };
        let mut all = Vec::new();
        if let Some(status) = &self.status {
            let of_device = words::counted(&status.counters);
            let of_device = of_device.map(|(count, what)| (u64::from(count), what, true));
            all.extend(of_device.map(counter));
        }
        let tally = &self.tally;
        let of_line = [
            (tally.messages, "messages", false),
            (tally.lost, "lost on the way", true),
            (tally.damaged, "damaged frames", true),
            (tally.unknown, "frames not known", true),
            (tally.restarts, "restarts", true),
        ];
        all.extend(of_line.map(counter));
        all
    }

    fn message(&mut self, message: &Report) {
        match message {
            Report::Sample(sample) => {
                self.count(sample.sample);
                self.sample(sample);
            }
            Report::Status(status) => {
                self.count(status.sample);
                self.status = Some(status.clone());
                if let Some((_, statuses)) = &mut self.alarm {
                    *statuses += 1;
                }
                self.alarm.take_if(|(_, statuses)| *statuses > 1);
            }
            Report::Health(health) => self.health = Some(health.clone()),
            Report::Alarm(_) => {
                let line = self.reader.line(message);
                let words = line.trim_start_matches("alarm").trim_start();
                self.alarm = Some((words.into(), 0));
            }
            Report::Upkeep(upkeep) => {
                // An alarm of this run comes right behind it, and then stands in its place.
                if let Some(alarm) = &upkeep.alarm {
                    self.alarm = Some((printable::line(&self.reader.kept(alarm)), 0));
                }
            }
            Report::Hello(hello) => {
                let line = self.reader.line(message);
                self.introduced = Some(printable::line(&words::introduction(hello)));
                if hello.occasion != Occasion::Asked {
                    self.begin_anew();
                    self.happens(&line);
                }
            }
            Report::Event(_) | Report::Upload(_) => {
                let line = self.reader.line(message);
                self.happens(&line);
            }
            Report::Answer(answer) if answer.answered != Answered::Done => {
                let line = self.reader.line(message);
                self.happens(&line);
            }
            Report::Snapshot(piece) if piece.piece == 0 => {
                let alarm = piece.alarm;
                self.happens(&format!("the residual around alarm {alarm} is sent"));
            }
            Report::Answer(_) | Report::Snapshot(_) | Report::Capture(_) => {}
        }
    }

    /// Notes the newest sample. A device whose samples are numbered from lower down has restarted
    /// while the line was lost.
    fn count(&mut self, sample: u64) {
        let newest = self.sample.unwrap_or(0);
        if sample.saturating_add(OVERTAKEN) < newest {
            self.begin_anew();
        }
        self.sample = Some(sample);
    }

    fn sample(&mut self, sample: &Sample) {
        for (trace, [far, near, ..]) in self.traces.iter_mut().zip(&sample.counts) {
            trace.displaced(sample.sample, f64::from(*far) - f64::from(*near));
        }
        let (Some(rate), Some(rig), Some(model), Some(output)) = (
            self.rate_hz(),
            self.reader.rig(),
            self.reader.model(),
            &sample.output,
        ) else {
            return;
        };
        let axes = self.traces.iter_mut().zip(&model.axes).enumerate();
        for (axis, (trace, identity)) in axes {
            let force = |raw: [i32; 2]| f64::from(raw[axis]) * identity.force_per_lsb;
            let forces = Forces {
                measured: force(output.measured),
                predicted: force(output.predicted),
                residual: force(output.residual),
            };
            let all = [forces.measured, forces.predicted, forces.residual];
            if all.iter().all(|f| f.is_finite()) {
                trace.add(sample.sample, u64::from(rig.delay), rate, forces);
            }
        }
    }

    /// After a restart nothing of before is shown but what happened.
    fn begin_anew(&mut self) {
        self.traces = Default::default();
        (self.status, self.health, self.alarm) = (None, None, None);
        self.sample = None;
        self.seen.clear();
        self.generation += 1;
    }

    fn happens(&mut self, text: &str) {
        if self.happened.len() == KEPT {
            self.happened.pop_front();
        }
        self.numbered += 1;
        self.happened.push_back(Happened {
            number: self.numbered,
            time_s: self.time_s(),
            text: printable::line(text),
        });
    }

    /// Keeps the device's time beside this computer's, a few times a second.
    fn note_speed(&mut self, now: Duration) {
        let Some(time_s) = self.time_s() else { return };
        let pause = |(at, _): &(Duration, f64)| now.saturating_sub(*at).as_secs_f64();
        if self.seen.back().is_none_or(|last| pause(last) >= 0.25) {
            self.seen.push_back((now, time_s));
        }
        while self.seen.get(1).is_some_and(|next| pause(next) > SPEED_S) {
            self.seen.pop_front();
        }
    }

    fn speed(&self) -> Option<f64> {
        let ((from, first), (to, last)) = (self.seen.front()?, self.seen.back()?);
        let took = to.saturating_sub(*from).as_secs_f64();
        (took > 0.5 && self.link == Link::Open).then(|| (last - first) / took)
    }
}

/// A verdict's state in one word; its code where it is newer than this program.
fn state(verdict: &Verdict) -> String {
    match verdict.read() {
        Some(read) => read.state.words().into(),
        None => format!("state {}", verdict.state),
    }
}
