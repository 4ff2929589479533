//! The frames that a device would send for a logged record, so that they can be looked at without a device.

use crate::replay::{Replayed, SetUp};
use crate::study::Record;
use jointwatch_shared::blob;
use jointwatch_shared::model::Model;
use jointwatch_shared::monitor::{self, Cause};
use jointwatch_shared::pipeline::Output;
use jointwatch_shared::telemetry::{
    Counters, Hello, MAX_FRAME, ModelIdentity, Occasion, PROTOCOL_VERSION, Report, RigIdentity,
    STATUS_HZ, Sample, Slot, Status, encode,
};

/// A device's introduction, then every sample, with a status between them ten times a second.
///
/// The device is one that has just started with this model in slot A. It has no rig block, but what the study says of the rig
/// (the block's checksum is 0), and no limits for its monitor, which therefore does not judge.
pub fn of(set_up: &SetUp, record: &Record, replayed: &Replayed, model: &Model) -> Vec<u8> {
    let mut sender = Sender::default();
    let [.., a, b, c, d] = blob::encode(model);
    let crc = u32::from_le_bytes([a, b, c, d]);
    sender.send(&Report::Hello(Hello {
        protocol: PROTOCOL_VERSION,
        firmware: version(),
        occasion: Occasion::Restart,
        model: Some(ModelIdentity::new(model, Slot::A, crc, false)),
        rig: Some(RigIdentity::new(&set_up.rig, &set_up.chain, 0)),
    }));

    let counts = set_up.counts(record);
    // The filters are full when this many samples have been taken; the first output comes with the last of them.
    let fill = 2 * set_up.chain.delay();
    let output = |sample: usize| Some(&replayed.outputs[sample.checked_sub(fill)?]);
    let mut saturated = 0;
    let period = (set_up.rig.sample_rate_hz / f64::from(STATUS_HZ)).max(1.0) as usize;
    for (number, raw) in counts.iter().enumerate() {
        let sample = Sample::new(number as u64, raw, model.axes(), output(number));
        sender.send(&Report::Sample(sample));
        if (number + 1).is_multiple_of(period) {
            let recent: Vec<&Output> = (number + 1 - period..=number).filter_map(output).collect();
            saturated += recent.iter().filter(|o| o.saturated != 0).count() as u32;
            sender.send(&Report::Status(status(number + 1, &recent, saturated)));
        }
    }
    sender.bytes
}

/// What a device says after so many samples that has no limits to judge by; `recent` came since the last status.
fn status(samples: usize, recent: &[&Output], saturated: u32) -> Status {
    let outside = recent.iter().filter(|o| o.outside != 0).count();
    Status {
        sample: samples as u64,
        verdict: monitor::Verdict::without(Cause::NoLimits).into(),
        outside_permille: (1000 * outside / recent.len().max(1)) as u16,
        axes: heapless::Vec::new(),
        channels: heapless::Vec::new(),
        counters: Counters {
            saturated,
            ..Counters::default()
        },
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
