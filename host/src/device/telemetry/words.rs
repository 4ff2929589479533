//! A device's messages as a person reads them: one line each, with the names, units and times that
//! the device has told of itself.

use crate::text::printable;
use crate::text::table::{rounded, sample_rate};
use jointwatch_shared::chain::Output;
use jointwatch_shared::monitor::{CHANNEL_NAMES, Cause};
use jointwatch_shared::wire::telemetry::{
    Access, Alarm, Answer, Answered, AxisHealth, Counters, Event, Health, Hello, KeptAlarm, Kind,
    ModelIdentity, Occasion, PROTOCOL_VERSION, Quantity, Report, Restart, RigIdentity, Sample,
    SensorStatus, Slot, Snapshot, Status, Supply, Upkeep, UploadReply, Verdict,
};
use std::fmt::Write;

/// What the device has told of itself so far, with which the rest can be read.
#[derive(Clone, Debug, Default)]
pub struct Reader {
    model: Option<ModelIdentity>,
    rig: Option<RigIdentity>,
}

impl Reader {
    /// The message as one line, without its end, whatever is in the device's texts.
    pub fn line(&mut self, report: &Report) -> String {
        printable::line(&match report {
            Report::Hello(hello) => {
                self.model = hello.model.clone();
                self.rig = hello.rig.clone();
                format!("device    {}", introduction(hello))
            }
            Report::Status(status) => format!("status    {}", self.status(status)),
            Report::Snapshot(snapshot) => format!("snapshot  {}", self.snapshot(snapshot)),
            Report::Sample(sample) => format!("sample    {}", self.sample(sample)),
            Report::Upload(reply) => format!("upload    {}", upload(reply)),
            Report::Event(event) => format!("event     {}", self.event(event)),
            Report::Answer(answer) => format!("answer    {}", answered(answer)),
            Report::Health(health) => format!("health    {}", self.health(health)),
            Report::Alarm(alarm) => format!("alarm     {}", self.alarm(alarm)),
            Report::Upkeep(upkeep) => format!("upkeep    {}", self.upkeep(upkeep)),
            Report::Capture(piece) => format!(
                "capture   of the alarm at {}, piece {} of {}",
                self.time(piece.alarm),
                u32::from(piece.piece) + 1,
                piece.pieces
            ),
        })
    }

    /// The model that the device has told of, if any.
    pub(crate) fn model(&self) -> Option<&ModelIdentity> {
        self.model.as_ref()
    }

    /// The rig block that the device has told of, if any.
    pub(crate) fn rig(&self) -> Option<&RigIdentity> {
        self.rig.as_ref()
    }

    /// The reason of a verdict; where a code is newer than this program, the code.
    pub(crate) fn reason(&self, verdict: &Verdict) -> String {
        match verdict.read() {
            Some(read) => read.words(&self.names()).to_string(),
            None => format!("reason {} (newer than this program)", verdict.cause),
        }
    }

    /// The time of a sample since the restart, or its number where the rate is not known.
    fn time(&self, sample: u64) -> String {
        match &self.rig {
            Some(rig) if rig.sample_rate_hz > 0.0 => {
                format!("{:.3} s", sample as f64 / rig.sample_rate_hz)
            }
            _ => format!("sample {sample}"),
        }
    }

    /// The axes' names; their numbers while they are not known.
    fn names(&self) -> Vec<&str> {
        match &self.model {
            Some(model) => model.axes.iter().map(|axis| axis.name.as_str()).collect(),
            None => vec!["axis 0", "axis 1"],
        }
    }

    pub(crate) fn name(&self, axis: usize) -> String {
        let names = self.names();
        names
            .get(axis)
            .map_or_else(|| format!("axis {axis}"), ToString::to_string)
    }

    /// A force with its unit; the number on the line while the unit is not known.
    fn force(&self, axis: usize, raw: i32) -> String {
        match self.model.as_ref().and_then(|model| model.axes.get(axis)) {
            Some(axis) => format!(
                "{} {}",
                rounded(f64::from(raw) * axis.force_per_lsb),
                unit(axis.kind)
            ),
            None => raw.to_string(),
        }
    }

    fn status(&self, status: &Status) -> String {
        let mut text = format!(
            "{}: {}",
            self.time(status.sample),
            self.verdict(&status.verdict)
        );
        for (number, axis) in status.axes.iter().enumerate() {
            let percent = |nmse: Option<u32>| {
                nmse.map_or_else(
                    || "–".to_string(),
                    |n| format!("{:.3} %", f64::from(n) / 1e3),
                )
            };
            let _ = write!(
                text,
                "; {} NMSE {} fast, {} slow",
                self.name(number),
                percent(axis.nmse_fast),
                percent(axis.nmse_slow)
            );
        }
        let outside = f64::from(status.outside_permille) / 10.0;
        let _ = write!(text, "; outside range {outside:.1} %");
        for (number, channel) in status.channels.iter().enumerate() {
            if let Some(trouble) = trouble(channel) {
                let _ = write!(text, "; {}: {trouble}", self.channel(number));
            }
        }
        for (count, what) in counted(&status.counters) {
            if count > 0 {
                let _ = write!(text, "; {count} {what}");
            }
        }
        if status.development_key {
            let _ = write!(text, "; {DEVELOPMENT_KEY}");
        }
        text
    }

    fn alarm(&self, alarm: &Alarm) -> String {
        let again = match alarm.alarms {
            0 | 1 => String::new(),
            many => format!("; {many} since then"),
        };
        format!(
            "not acknowledged: {} at {}{again}",
            self.verdict(&alarm.verdict),
            self.time(alarm.sample)
        )
    }

    fn upkeep(&self, upkeep: &Upkeep) -> String {
        let alarm = upkeep.alarm.as_ref().map(|alarm| self.kept(alarm));
        let alarm = alarm.unwrap_or_else(|| "no alarm of an earlier run".into());
        format!("{alarm}; {}", supply(&upkeep.supply))
    }

    /// An alarm that outlasted a restart.
    pub(crate) fn kept(&self, alarm: &KeptAlarm) -> String {
        format!(
            "not acknowledged since an earlier run: {} at {} of that run",
            self.verdict(&alarm.verdict),
            self.time(alarm.sample)
        )
    }

    fn health(&self, health: &Health) -> String {
        let mut text = format!("{}:", self.time(health.sample));
        for (number, axis) in health.axes.iter().enumerate() {
            let between = if number == 0 { "" } else { ";" };
            let _ = write!(text, "{between} {} {}", self.name(number), self.axis(axis));
        }
        if health.axes.is_empty() {
            text.push_str(" nothing is judged");
        }
        if health.samples_lost > 0 {
            let _ = write!(text, "; {} samples lost", health.samples_lost);
        }
        text
    }

    /// The verdict over an axis, its age and the share of the recent time that was judged.
    fn axis(&self, axis: &AxisHealth) -> String {
        let (verdict, age) = (
            self.verdict(&axis.verdict),
            self.span(axis.unjudged_samples),
        );
        let share = f64::from(axis.judged_permille) / 10.0;
        format!("{verdict} (last judged {age} ago, {share:.0} % of the recent time)")
    }

    /// A number of samples as a time, where the rate is known.
    fn span(&self, samples: u32) -> String {
        match &self.rig {
            Some(rig) if rig.sample_rate_hz > 0.0 => {
                format!("{:.1} s", f64::from(samples) / rig.sample_rate_hz)
            }
            _ => format!("{samples} samples"),
        }
    }

    fn verdict(&self, verdict: &Verdict) -> String {
        match verdict.read() {
            Some(read) => format!("{}, {}", read.state.words(), read.words(&self.names())),
            None => format!(
                "state {}, reason {} (newer than this program)",
                verdict.state, verdict.cause
            ),
        }
    }

    /// A channel, as [`Status::channels`] numbers them.
    pub(crate) fn channel(&self, number: usize) -> String {
        let (axis, channel) = (number / CHANNEL_NAMES.len(), number % CHANNEL_NAMES.len());
        format!("{} of {}", CHANNEL_NAMES[channel], self.name(axis))
    }

    fn snapshot(&self, snapshot: &Snapshot) -> String {
        let axes = self.model.as_ref().map_or(2, |model| model.axes.len());
        let mut text = format!(
            "of alarm {}, piece {} of {}, from sample {:+} every {}:",
            snapshot.alarm,
            snapshot.piece + 1,
            snapshot.pieces,
            snapshot.first,
            snapshot.every
        );
        for residual in &snapshot.residual {
            let forces: Vec<String> = residual
                .iter()
                .enumerate()
                .take(axes)
                .map(|(axis, &raw)| self.force(axis, raw))
                .collect();
            let _ = write!(text, " ({})", forces.join(", "));
        }
        text
    }

    fn sample(&self, sample: &Sample) -> String {
        let mut text = self.time(sample.sample);
        for (axis, counts) in sample.counts.iter().enumerate() {
            let counts = counts.map(|count| count.to_string()).join(" ");
            let _ = write!(text, "; {} counts {counts}", self.name(axis));
        }
        let Some(output) = &sample.output else {
            return text;
        };
        for axis in 0..sample.counts.len().min(2) {
            let force = |raw: [i32; 2]| self.force(axis, raw[axis]);
            let _ = write!(
                text,
                "; {} measured {}, predicted {}, residual {}",
                self.name(axis),
                force(output.measured),
                force(output.predicted),
                force(output.residual)
            );
            if let Some(band) = output.residual_band {
                let _ = write!(text, ", in the band {}", force(band));
            }
        }
        if output.outside != 0 {
            text.push_str("; outside range");
        }
        if output.saturated & Output::RAILS != 0 {
            text.push_str("; a force at its rail");
        }
        if output.saturated & Output::HELD != 0 {
            text.push_str("; mains hum not tracked");
        }
        text
    }

    fn event(&self, event: &Event) -> String {
        match event {
            Event::Started { why } => format!("the device started: {}", restart(*why)),
            Event::NoCrystal => {
                "the crystal does not swing: times are only as good as the internal oscillator"
                    .to_string()
            }
            Event::NoModel => "no model: only sensors are reported".to_string(),
            Event::ModelRefused { slot: of, fault } => {
                format!(
                    "the model in slot {} is not used: {}",
                    slot(*of),
                    fault.words()
                )
            }
            Event::ModelUnsigned { slot: of } => {
                format!(
                    "the model in slot {} is not used: it has no valid signature",
                    slot(*of)
                )
            }
            Event::ModelConfirmed { slot: of } => {
                format!("the model in slot {} has run and is kept", slot(*of))
            }
            Event::ModelGivenUp { slot: of } => format!(
                "the model in slot {} did not run; the old one is in use again",
                slot(*of)
            ),
            Event::NoRig => "no rig block: raw counts only".to_string(),
            Event::RigRefused { fault } => {
                format!(
                    "the rig block is not used: {}; raw counts only",
                    fault.words()
                )
            }
            Event::Mismatch => {
                "model and rig block do not fit each other: raw counts only".to_string()
            }
            Event::SensorMissing { channel } => format!(
                "no answer from the sensor of the {}; it is tried again",
                self.channel(usize::from(*channel))
            ),
            Event::SensorBack { channel } => format!(
                "the sensor of the {} answers again",
                self.channel(usize::from(*channel))
            ),
            Event::Verdict(verdict) => self.verdict(verdict),
        }
    }
}

/// What a device could not do, with its words.
pub(crate) fn counted(counters: &Counters) -> [(u32, &'static str); 5] {
    [
        (counters.missed_deadlines, "samples late"),
        (counters.queue_overruns, "samples lost"),
        (counters.frames_dropped, "frames not sent"),
        (counters.saturated, "forces at their rail"),
        (counters.link_errors, "damaged frames received"),
    ]
}

/// What is said of a device that trusts the development key.
const DEVELOPMENT_KEY: &str = "development key: anybody can put a model onto this device";

/// Whom a device trusts, and what its flash has been through.
fn trusting(access: &Access) -> String {
    let mut text = String::new();
    if access.development_key {
        let _ = write!(text, "; {DEVELOPMENT_KEY}");
    }
    if !access.class.is_empty() {
        let _ = write!(text, "; class {}", access.class);
    }
    if access.newest > 0 {
        let _ = write!(text, "; takes releases above {}", access.newest);
    }
    if access.erasures > 0 {
        let _ = write!(text, "; {} erasures of its flash", access.erasures);
    }
    text
}

pub(crate) fn introduction(hello: &Hello) -> String {
    let [major, minor, patch] = hello.firmware;
    let occasion = match hello.occasion {
        Occasion::Restart => "restarted",
        Occasion::Asked => "as asked",
        Occasion::Changed => "model or rig changed",
    };
    let mut text = format!("firmware {major}.{minor}.{patch}, {occasion}");
    if hello.protocol != PROTOCOL_VERSION {
        let _ = write!(
            text,
            "; it speaks version {} of the protocol and this program version {PROTOCOL_VERSION}: what follows may be read wrongly",
            hello.protocol
        );
    }
    match &hello.model {
        None => text.push_str("; no model"),
        Some(model) => {
            let axes: Vec<String> = model
                .axes
                .iter()
                .map(|axis| format!("{} ({})", axis.name, unit(axis.kind)))
                .collect();
            let _ = write!(
                text,
                "; model {:08x} in slot {}, {}, axes {}, learnt at {}",
                model.crc,
                slot(model.slot),
                if model.signed { "signed" } else { "not signed" },
                axes.join(" and "),
                sample_rate(model.sample_rate_hz)
            );
        }
    }
    match &hello.rig {
        None => text.push_str("; no rig block"),
        Some(rig) => {
            let _ = write!(
                text,
                "; rig block {:08x}, {} Hz",
                rig.crc, rig.sample_rate_hz
            );
        }
    }
    text + &trusting(&hello.access)
}

/// What is wrong with a channel, if anything is.
pub(crate) fn trouble(channel: &SensorStatus) -> Option<String> {
    let mut words = Vec::new();
    if channel.fault != 0 {
        words.push(match Cause::from_tag(channel.fault) {
            Some(cause) => cause.words().to_string(),
            None => format!("fault {} (newer than this program)", channel.fault),
        });
    }
    if channel.bus_errors > 0 {
        words.push(format!("{} failed transfers", channel.bus_errors));
    }
    if channel.crc_errors > 0 {
        words.push(format!("{} wrong checksums", channel.crc_errors));
    }
    (!words.is_empty()).then(|| words.join(", "))
}

fn upload(reply: &UploadReply) -> String {
    match reply {
        UploadReply::Accepted { next } => format!("{next} bytes are there"),
        UploadReply::Activated { kind, slot: place } => {
            let what = match kind {
                Kind::Model => "the model",
                Kind::Rig => "the rig block",
            };
            match place {
                Some(place) => format!("{what} is active, in slot {}", slot(*place)),
                None => format!("{what} is active"),
            }
        }
        UploadReply::Aborted => "given up as asked".to_string(),
        UploadReply::Refused(why) => format!("refused: {why}"),
    }
}

/// What a device says of its supply.
fn supply(supply: &Supply) -> String {
    let low = if supply.is_low {
        "; the supply is too low to write the flash"
    } else {
        ""
    };
    match supply.reset_below_mv {
        Some(mv) => format!("held in reset below {:.2} V{low}", f64::from(mv) / 1e3),
        None => format!("nothing is known of the supply{low}"),
    }
}

fn answered(answer: &Answer) -> String {
    let what = match answer.answered {
        Answered::Done => "done",
        Answered::Busy => "not now; ask again",
        Answered::Nothing => "there is nothing to send or to do",
        Answered::LineTooSlow => "the line is too slow for that: ask for fewer samples",
        Answered::NotSigned => "it is not signed by a key that the device trusts",
        Answered::Stale => "it was signed for another moment",
        Answered::Failed => "the flash could not take it",
    };
    format!("to request {}: {what}", answer.to)
}

fn restart(why: Restart) -> &'static str {
    match why {
        Restart::PowerOn => "power came on",
        Restart::BrownOut => "the supply voltage had fallen too low",
        Restart::Pin => "its reset pin was pulled",
        Restart::Software => "as the program asked",
        Restart::Watchdog => "the program had stopped answering",
        Restart::Fault => "the program had failed",
        Restart::Unknown => "the hardware does not tell why",
    }
}

fn slot(slot: Slot) -> &'static str {
    match slot {
        Slot::A => "A",
        Slot::B => "B",
    }
}

pub(crate) fn unit(kind: Quantity) -> &'static str {
    match kind {
        Quantity::Translation => "N",
        Quantity::Rotation => "N·m",
    }
}
