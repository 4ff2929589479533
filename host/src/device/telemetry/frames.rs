//! The frames that a device would send for a logged record, so that they can be looked at without a
//! device.

use crate::device::replay::SetUp;
use crate::study::Record;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Output, RawSample};
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::monitor::{Cause, Faults, Monitor, MonitorState, Verdict, Window};
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::snapshot::Recorder;
use jointwatch_shared::wire::telemetry::{
    Access, AxisStatus, Counters, Event, Health, Hello, MAX_FRAME, ModelIdentity, Occasion,
    PROTOCOL_VERSION, Report, RigIdentity, STATUS_HZ, Sample, SensorStatus, Slot, Status, encode,
};

/// A device's introduction, then every sample, the monitor's verdict when it changes, a status ten
/// times a second, and the residual around an alarm.
///
/// The device is one that has just started with this model in slot A. `monitor` is what judges, or
/// why nothing does; `rig_crc` is the checksum of its rig block, 0 where there is none but what the
/// study says of the rig. Its sensors are well.
pub fn of(
    set_up: &SetUp,
    record: &Record,
    model: &Model,
    monitor: Result<&Monitor, Cause>,
    rig_crc: u32,
) -> Vec<u8> {
    let mut sender = Sender::default();
    sender.send(&Report::Hello(Hello {
        protocol: PROTOCOL_VERSION,
        firmware: version(),
        occasion: Occasion::Restart,
        model: Some(ModelIdentity::new(
            model,
            Slot::A,
            blob::checksum_of(model),
            false,
        )),
        rig: Some(RigIdentity::new(
            set_up.rig.sample_rate_hz,
            &set_up.chain,
            rig_crc,
        )),
        access: Access::default(),
    }));
    let mut watch = ReplayedWatch::new(set_up.rig.sample_rate_hz, model.axes(), monitor);
    for sample in set_up.samples(record, model) {
        let reports = watch.sample(&sample.raw, sample.output.as_ref(), &sample.faults);
        reports.iter().for_each(|report| sender.send(report));
    }
    sender.bytes
}

/// What a device that streams every sample tells of each, in its order: the firmware's own watch
/// without chips that fail, a line that is slow and a model on trial. A test holds it against the
/// emulated firmware.
pub struct ReplayedWatch<'a> {
    monitor: Result<&'a Monitor, Cause>,
    state: MonitorState,
    verdict: Verdict,
    recorder: Recorder,
    counters: Counters,
    axes: usize,
    /// Samples from one status to the next.
    period: u64,
    number: u64,
}

impl<'a> ReplayedWatch<'a> {
    /// Before the first sample of a rig of so many axes and samples per second.
    pub fn new(sample_rate_hz: f64, axes: usize, monitor: Result<&'a Monitor, Cause>) -> Self {
        let rate_hz = (sample_rate_hz + 0.5) as u32;
        Self {
            monitor,
            state: MonitorState::default(),
            verdict: match monitor {
                Ok(_) => Verdict::default(),
                Err(cause) => Verdict::without(cause),
            },
            recorder: Recorder::new(rate_hz),
            counters: Counters::default(),
            axes,
            period: u64::from((rate_hz / STATUS_HZ).max(1)),
            number: 0,
        }
    }

    /// Takes one sample with what the chain made of it and what was wrong with its channels, and
    /// tells what there is to tell.
    pub fn sample(
        &mut self,
        raw: &RawSample,
        output: Option<&Output>,
        faults: &Faults,
    ) -> Vec<Report> {
        let mut reports = vec![Report::Sample(Sample::new(
            self.number,
            raw,
            self.axes,
            output,
        ))];
        if let Some(output) = output {
            self.counters.saturated += (output.saturated & Output::RAILS).count_ones();
            self.recorder.sample(output.residual);
        }
        if let Ok(monitor) = self.monitor {
            let said = monitor.update(&mut self.state, raw, output, faults);
            if !said.same_reason(&self.verdict) {
                reports.push(Report::Event(Event::Verdict(said.into())));
            }
            self.recorder.verdict(&self.verdict, &said);
            self.verdict = said;
        }
        let status_is_due = self.number.is_multiple_of(self.period);
        self.number += 1;
        if status_is_due {
            reports.push(Report::Status(self.status()));
            reports.push(Report::Health(self.health()));
        }
        reports.extend(std::iter::from_fn(|| self.recorder.piece()).map(Report::Snapshot));
        reports
    }

    fn health(&self) -> Health {
        let of = |monitor| (0..self.axes).map(move |axis| self.state.axis(monitor, axis).into());
        Health {
            sample: self.number,
            samples_lost: 0,
            axes: self.monitor.map(|m| of(m).collect()).unwrap_or_default(),
        }
    }

    fn status(&self) -> Status {
        let nmse = |monitor, axis| AxisStatus {
            nmse_fast: self.state.nmse(monitor, axis, Window::Fast),
            nmse_slow: self.state.nmse(monitor, axis, Window::Slow),
        };
        let axes = self
            .monitor
            .map(|m| (0..self.axes).map(|axis| nmse(m, axis)).collect());
        Status {
            sample: self.number,
            verdict: self.verdict.into(),
            outside_permille: self.state.outside_permille(),
            axes: axes.unwrap_or_default(),
            channels: std::iter::repeat_n(SensorStatus::default(), CHANNELS * self.axes).collect(),
            counters: self.counters,
            development_key: false,
        }
    }
}

/// This program's version, which is that of the firmware built with it.
fn version() -> [u16; 3] {
    let parts = [
        env!("CARGO_PKG_VERSION_MAJOR"),
        env!("CARGO_PKG_VERSION_MINOR"),
        env!("CARGO_PKG_VERSION_PATCH"),
    ];
    parts.map(|part| part.parse().unwrap_or(0))
}

/// Frames one after the other, numbered.
#[derive(Default)]
pub(in crate::device) struct Sender {
    pub(in crate::device) bytes: Vec<u8>,
    sequence: u16,
}

impl Sender {
    pub(in crate::device) fn send(&mut self, report: &Report) {
        let mut place = [0; MAX_FRAME];
        // Every report fits a frame; a test shows it.
        if let Ok(frame) = encode(report, self.sequence, &mut place) {
            self.bytes.extend_from_slice(frame);
        }
        self.sequence = self.sequence.wrapping_add(1);
    }
}
