//! What the device said, held against what it should have said: counts against what its chips were
//! fed, and every output of its chain against the host's.

use crate::device::telemetry::listen::{Heard, Listener, Tally};
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Chain, ChainState, Output, RawAxis, RawSample};
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::wire::telemetry::{
    Event, Hello, Occasion, Report, Sample, SampleOutput, Snapshot, Status, UploadReply,
};
use serde::Serialize;

/// How the device's words compare with the host's.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Comparison {
    /// Samples that were streamed and arrived.
    pub samples: u64,
    /// Samples of which at least one count is not what the chips were fed, from the first one on
    /// that was.
    pub wrong_counts: u64,
    /// The last of them.
    pub last_wrong_counts: Option<u64>,
    /// Outputs that were compared, and those that were expected or came alone.
    pub outputs: u64,
    /// Bits of all predicted forces, measured forces, residuals, band residuals and flags that
    /// differ.
    pub different_bits: u64,
    /// Bits of the predicted forces and residuals among them.
    pub different_force_bits: u64,
    /// The first sample with a difference.
    pub first_difference: Option<u64>,
    /// Outputs that were compared with `replay`'s of the record alone, and the bits in which they
    /// differ.
    pub replayed: u64,
    /// Bits that differ between the device and `replay` of the record alone.
    pub different_replayed_bits: u64,
}

/// What the device said beside its samples, in the order in which it came.
#[derive(Debug, Default)]
pub struct Said {
    /// Introductions of the device.
    pub hellos: Vec<Hello>,
    /// Status reports.
    pub statuses: Vec<Status>,
    /// Events.
    pub events: Vec<Event>,
    /// Pieces of snapshots.
    pub snapshots: Vec<Snapshot>,
    /// Answers to an upload.
    pub uploads: Vec<UploadReply>,
    /// Counts that were not what the chips were fed: the sample and what the device said, the
    /// first of them.
    pub wrong: Vec<(u64, Vec<[i32; CHANNELS]>)>,
}

/// What `replay` says of the record that the chips are fed.
pub struct Replayed {
    /// Outputs of `replay`, in order.
    pub outputs: Vec<SampleOutput>,
    /// The device's sample that the first of them comes with.
    pub first: u64,
}

/// A model that the device may run, with the host's chain for it.
#[derive(Clone, Copy)]
pub struct Known<'a> {
    /// The checksum that ends its blob.
    pub crc: u32,
    /// The model on the device.
    pub model: &'a Model,
    /// The chain before it.
    pub chain: &'a Chain,
}

/// Listens to the device and compares.
pub struct Judge<'a> {
    listener: Listener,
    replayed: Replayed,
    /// The models that the device may run; the first is the one that was replayed.
    known: Vec<Known<'a>>,
    /// The one that it says to run; none until it has introduced itself.
    running: Option<usize>,
    state: ChainState,
    /// The next sample that the host's chain takes.
    next: u64,
    /// What the chips were fed, by the device's samples since its restart.
    fed: Vec<RawSample>,
    started: bool,
    /// Only the record as it was logged is compared with `replay`; not what follows a restart.
    restarted: bool,
    comparison: Comparison,
    /// What the device said beside its samples.
    pub said: Said,
}

/// How many wrong samples are kept for a person to look at.
const WRONG_KEPT: usize = 16;

impl<'a> Judge<'a> {
    /// Has heard nothing yet. A device that begins without introducing itself is taken to run the
    /// first of the models.
    pub fn new(replayed: Replayed, known: Vec<Known<'a>>) -> Self {
        Self {
            listener: Listener::default(),
            replayed,
            known,
            running: Some(0),
            state: ChainState::default(),
            next: 0,
            fed: Vec::new(),
            started: false,
            restarted: false,
            comparison: Comparison::default(),
            said: Said::default(),
        }
    }

    /// The chips were fed so for the device's next sample.
    pub fn fed(&mut self, sample: RawSample) {
        self.fed.push(sample);
    }

    /// Hears bytes of the line.
    pub fn hear(&mut self, bytes: &[u8]) {
        for heard in self.listener.hear(bytes) {
            let Heard::Message(received) = heard else {
                continue;
            };
            match received.message {
                Report::Hello(hello) => {
                    if hello.occasion == Occasion::Restart && !self.said.hellos.is_empty() {
                        self.restart();
                    }
                    let of_rig = hello.rig.as_ref().and(hello.model.as_ref());
                    self.running =
                        of_rig.and_then(|model| self.known.iter().position(|k| k.crc == model.crc));
                    self.said.hellos.push(hello);
                }
                Report::Status(status) => self.said.statuses.push(status),
                Report::Event(event) => self.said.events.push(event),
                Report::Upload(reply) => self.said.uploads.push(reply),
                Report::Sample(sample) => self.sample(&sample),
                Report::Snapshot(piece) => self.said.snapshots.push(piece),
                Report::Answer(_)
                | Report::Health(_)
                | Report::Alarm(_)
                | Report::Capture(_)
                | Report::Upkeep(_) => {}
            }
        }
    }

    /// The host has told the device to restart, or the device says that it did: its samples begin
    /// anew.
    pub fn restart(&mut self) {
        self.fed.clear();
        (self.next, self.started, self.restarted) = (0, false, true);
        self.state = ChainState::default();
    }

    /// How it compares so far, and what was heard.
    pub fn verdict(&self) -> (Comparison, Tally) {
        (self.comparison.clone(), self.listener.tally())
    }

    fn sample(&mut self, sample: &Sample) {
        let number = sample.sample;
        if number < self.next || number >= self.fed.len() as u64 {
            // Said before the restart, and heard late.
            return;
        }
        self.comparison.samples += 1;
        let said = raw(sample);
        let fed = self.fed[number as usize];
        let axes = sample.counts.len().min(said.len());
        let right = said[..axes] == fed[..axes];
        if self.started && !right {
            self.comparison.wrong_counts += 1;
            self.comparison.last_wrong_counts = Some(number);
            if self.said.wrong.len() < WRONG_KEPT {
                self.said.wrong.push((number, sample.counts.to_vec()));
            }
        }
        self.started |= right;
        // What did not arrive the device has taken all the same: nothing before its chips are set
        // up, and then what it was fed.
        while self.next < number {
            let missing = if self.started {
                self.fed[self.next as usize]
            } else {
                RawSample::default()
            };
            self.step(&missing);
        }
        // Which samples a fault spoils the device knows from its chips.
        if sample
            .output
            .as_ref()
            .is_some_and(|o| o.saturated & Output::HELD != 0)
        {
            self.state.hold_notches(1);
        }
        let wanted = self.step(&said);
        if wanted.is_some() || sample.output.is_some() {
            self.comparison.outputs += 1;
            let [all, forces] = difference(wanted.as_ref(), sample.output.as_ref());
            self.comparison.different_bits += all;
            self.comparison.different_force_bits += forces;
            if all > 0 {
                self.comparison.first_difference.get_or_insert(number);
            }
        }
        self.against_replay(number, sample.output.as_ref());
    }

    fn step(&mut self, counts: &RawSample) -> Option<SampleOutput> {
        self.next += 1;
        let Known { chain, model, .. } = self.running.and_then(|at| self.known.get(at))?;
        let output = chain.step(&mut self.state, model, counts)?;
        Some(SampleOutput::from(&output))
    }

    fn against_replay(&mut self, number: u64, output: Option<&SampleOutput>) {
        let row = number
            .checked_sub(self.replayed.first)
            .filter(|_| !self.restarted && self.running == Some(0));
        let Some(replayed) = row.and_then(|row| self.replayed.outputs.get(row as usize)) else {
            return;
        };
        let mut said = output.cloned();
        if let (None, Some(said)) = (replayed.residual_band, &mut said) {
            // The device's low-pass is full already: of the rest before the record.
            said.residual_band = None;
        }
        self.comparison.replayed += 1;
        self.comparison.different_replayed_bits += difference(Some(replayed), said.as_ref())[0];
    }
}

/// A streamed sample's counts as the chain takes them.
fn raw(sample: &Sample) -> RawSample {
    let mut raw = RawSample::default();
    for (place, &counts) in raw.iter_mut().zip(&sample.counts) {
        *place = RawAxis::of_counts(counts);
    }
    raw
}

/// Bits that differ: all, and those of predicted forces and residuals. Where one has no output, all
/// bits of the other's differ.
fn difference(one: Option<&SampleOutput>, other: Option<&SampleOutput>) -> [u64; 2] {
    let bits = |a: &[i32], b: &[i32]| -> u64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| u64::from((a ^ b).count_ones())).sum()
    };
    match (one, other) {
        (Some(a), Some(b)) => {
            let forces = bits(&a.predicted, &b.predicted) + bits(&a.residual, &b.residual);
            let flags = u64::from((a.outside ^ b.outside).count_ones())
                + u64::from((a.saturated ^ b.saturated).count_ones());
            let band = match (a.residual_band, b.residual_band) {
                (Some(a), Some(b)) => bits(&a, &b),
                (None, None) => 0,
                _ => 64,
            };
            [
                forces + flags + band + bits(&a.measured, &b.measured),
                forces,
            ]
        }
        (None, None) => [0, 0],
        // Two flags of eight bits and eight numbers of 32.
        _ => [2 * 8 + 8 * 32, 4 * 32],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output() -> SampleOutput {
        SampleOutput {
            outside: 0,
            saturated: 0,
            measured: [1, 2],
            predicted: [3, 4],
            residual: [-2, -2],
            residual_band: Some([5, 6]),
        }
    }

    #[test]
    fn every_flipped_bit_counts_once() {
        let good = output();
        assert_eq!(difference(Some(&good), Some(&good)), [0, 0]);
        let mut bad = output();
        bad.predicted[1] ^= 0b101;
        bad.residual[0] ^= i32::MIN;
        bad.outside ^= 0b1000;
        assert_eq!(difference(Some(&good), Some(&bad)), [4, 3]);
        bad = output();
        bad.residual_band = None;
        assert_eq!(difference(Some(&good), Some(&bad)), [64, 0]);
        assert_eq!(difference(None, Some(&bad)), [272, 128]);
    }
}
