//! The frames that a device would send for a logged record, so that they can be looked at without a device.

use crate::replay::{Replayed, SetUp};
use crate::study::Record;
use jointwatch_shared::blob;
use jointwatch_shared::model::Model;
use jointwatch_shared::monitor::{Cause, Faults, Monitor, MonitorState, Verdict, Window};
use jointwatch_shared::telemetry::{
    AxisStatus, Counters, Event, Hello, MAX_FRAME, ModelIdentity, Occasion, PROTOCOL_VERSION,
    Report, RigIdentity, STATUS_HZ, Sample, Slot, Status, encode,
};

/// A device's introduction, then every sample, with the monitor's verdict when it changes and a status ten times a second.
///
/// The device is one that has just started with this model in slot A. `monitor` is what judges, or why nothing does; `rig_crc` is the
/// checksum of its rig block, 0 where there is none but what the study says of the rig. Its sensors are well.
pub fn of(
    set_up: &SetUp,
    record: &Record,
    replayed: &Replayed,
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
            blob::checksum(&blob::encode(model)),
            false,
        )),
        rig: Some(RigIdentity::new(
            set_up.rig.sample_rate_hz,
            &set_up.chain,
            rig_crc,
        )),
    }));

    let counts = set_up.counts(record);
    // The filters are full when this many samples have been taken; the first output comes with the last of them.
    let fill = 2 * set_up.chain.delay();
    let output = |sample: usize| Some(&replayed.outputs[sample.checked_sub(fill)?]);
    let period = (set_up.rig.sample_rate_hz / f64::from(STATUS_HZ)).max(1.0) as usize;
    let mut state = MonitorState::default();
    let mut verdict = match monitor {
        Ok(_) => Verdict::default(),
        Err(cause) => Verdict::without(cause),
    };
    let mut counters = Counters::default();
    for (number, raw) in counts.iter().enumerate() {
        let output = output(number);
        sender.send(&Report::Sample(Sample::new(
            number as u64,
            raw,
            model.axes(),
            output,
        )));
        counters.saturated += output.map_or(0, |o| o.saturated.count_ones());
        if let Ok(monitor) = monitor {
            let said = monitor.update(&mut state, raw, output, &Faults::default());
            if !said.same_reason(&verdict) {
                sender.send(&Report::Event(Event::Verdict(said.into())));
            }
            verdict = said;
        }
        if (number + 1).is_multiple_of(period) {
            let nmse = |monitor: &Monitor, axis| AxisStatus {
                nmse_fast: state.nmse(monitor, axis, Window::Fast),
                nmse_slow: state.nmse(monitor, axis, Window::Slow),
            };
            let axes = monitor.map(|m| (0..model.axes()).map(|axis| nmse(m, axis)).collect());
            sender.send(&Report::Status(Status {
                sample: number as u64 + 1,
                verdict: verdict.into(),
                outside_permille: state.outside_permille(),
                axes: axes.unwrap_or_default(),
                channels: heapless::Vec::new(),
                counters,
            }));
        }
    }
    sender.bytes
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
struct Sender {
    bytes: Vec<u8>,
    sequence: u16,
}

impl Sender {
    fn send(&mut self, report: &Report) {
        let mut place = [0; MAX_FRAME];
        // Every report fits a frame; a test shows it.
        if let Ok(frame) = encode(report, self.sequence, &mut place) {
            self.bytes.extend_from_slice(frame);
        }
        self.sequence = self.sequence.wrapping_add(1);
    }
}
