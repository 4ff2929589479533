//! The counts in a stream of frames: samples as they were streamed, and those around an alarm, put
//! together from their pieces.

use crate::device::rig_block;
use crate::device::telemetry::listen::{Heard as Word, Listener, Tally};
use crate::study::time::LONGEST_GAP;
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::wire::capture::{CHUNK, unpack};
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::telemetry::{
    AxisIdentity, CAPTURE_PIECE, CapturePiece, Hello, Report, Sample,
};
use std::collections::BTreeMap;

/// For each axis: displacement far and near, body, acceleration, force, input.
pub(super) type Counts = [[i32; CHANNELS]; 2];

/// Samples of one run of a device, by their number.
#[derive(Default)]
pub(super) struct Run {
    pub(super) samples: BTreeMap<u64, Counts>,
    /// The sample at which the alarm was raised that these are kept around; `None` for a stream.
    pub(super) alarm: Option<u64>,
}

/// What was heard of the device: its runs, and what was lost on the way.
#[derive(Default)]
pub(super) struct Heard {
    pub(super) runs: Vec<Run>,
    /// Names and kinds of the axes, where the device has told them.
    pub(super) axes: Vec<AxisIdentity>,
    /// Numbers from one streamed sample to the next.
    pub(super) every: u64,
    pub(super) tally: Tally,
    /// Instants at which the device took no sample.
    pub(super) late: u64,
    /// Pieces that did not arrive.
    pub(super) pieces_lost: usize,
}

/// Reads all frames, which have to be those of a device with this rig block.
pub(super) fn read(bytes: &[u8], rig: &Rig) -> Result<Heard, String> {
    let checksum = rig_block::checksum(rig).map_err(|e| e.sentence)?;
    let mut reading = Reading {
        axes: rig.axes.len(),
        checksum,
        stream: Run::default(),
        pieces: BTreeMap::new(),
        pieces_of: BTreeMap::new(),
        status: None,
        heard: Heard::default(),
    };
    let mut listener = Listener::default();
    for word in listener.hear(bytes) {
        match word {
            Word::Restarted => reading.end_run(),
            Word::Message(received) => reading.report(received.message)?,
            Word::Lost(_) | Word::Unknown(_) => {}
        }
    }
    reading.end_run();
    let mut heard = reading.heard;
    heard.tally = listener.tally();
    if heard.runs.is_empty() {
        return Err(nothing(&heard.tally));
    }
    heard.every = every(&heard.runs);
    Ok(heard)
}

/// Why there are no counts.
fn nothing(tally: &Tally) -> String {
    if tally.messages > 0 {
        return format!(
            "holds {} messages and no sample; have the device stream with `monitor --stream 1`, or fetch what it kept around an \
             alarm with `capture`",
            tally.messages
        );
    }
    if tally.damaged > 0 || tally.torn_end && tally.bytes > 1 {
        return format!(
            "holds no whole frame in its {} bytes; record what the device sends from before its first frame to behind its last",
            tally.bytes
        );
    }
    "holds no frame; name a file of what a device sent, as `replay --frames` and `capture` write it"
        .to_owned()
}

/// The usual distance of streamed samples.
fn every(runs: &[Run]) -> u64 {
    let mut counts = BTreeMap::new();
    for run in runs.iter().filter(|run| run.alarm.is_none()) {
        for pair in run.samples.keys().zip(run.samples.keys().skip(1)) {
            *counts.entry(pair.1 - pair.0).or_insert(0_usize) += 1;
        }
    }
    let most = counts.iter().max_by_key(|(_, count)| **count);
    most.map_or(1, |(distance, _)| *distance)
}

struct Reading {
    axes: usize,
    checksum: u32,
    stream: Run,
    /// Chunks by alarm and place, with how many of their pieces have come.
    pieces: BTreeMap<(u64, u16), (Vec<u8>, u16)>,
    /// Pieces that there are, by alarm.
    pieces_of: BTreeMap<u64, u16>,
    /// Of the last status: the sample, and how many instants were missed by then.
    status: Option<(u64, u32)>,
    heard: Heard,
}

/// Pieces of a chunk.
const PER_CHUNK: u16 = (CHUNK / CAPTURE_PIECE) as u16;

impl Reading {
    fn report(&mut self, report: Report) -> Result<(), String> {
        match report {
            Report::Hello(hello) => self.hello(hello)?,
            Report::Sample(sample) => self.sample(&sample)?,
            Report::Capture(piece) => self.piece(&piece),
            Report::Status(status) => {
                let missed = status.counters.missed_deadlines;
                if let Some((from, before)) = self.status
                    && missed > before
                {
                    // At which of the instants since, nobody tells: none of them is used.
                    self.heard.late += u64::from(missed - before);
                    self.stream
                        .samples
                        .retain(|n, _| !(from..=status.sample).contains(n));
                }
                self.status = Some((status.sample, missed));
            }
            _ => {}
        }
        Ok(())
    }

    fn hello(&mut self, hello: Hello) -> Result<(), String> {
        let other = |what: &str| {
            format!(
                "these frames are of a device {what}, and this block is {:08x}; give the block that the device runs with",
                self.checksum
            )
        };
        match &hello.rig {
            Some(rig) if rig.crc == self.checksum => {}
            Some(rig) if rig.crc == 0 => {
                return Err(
                    "these frames were made without a rig block; make them with `replay --rig`"
                        .to_owned(),
                );
            }
            Some(rig) => return Err(other(&format!("with the rig block {:08x}", rig.crc))),
            None => return Err(other("without a rig block")),
        }
        if let Some(model) = &hello.model {
            self.heard.axes = model.axes.to_vec();
        }
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), String> {
        if sample.counts.len() != self.axes {
            return Err(format!(
                "these frames are of a rig with {} axes, and the rig block has {}; give the block that the device runs with",
                sample.counts.len(),
                self.axes
            ));
        }
        let mut counts = Counts::default();
        for (place, axis) in counts.iter_mut().zip(&sample.counts) {
            *place = *axis;
        }
        self.stream.samples.insert(sample.sample, counts);
        Ok(())
    }

    fn piece(&mut self, piece: &CapturePiece) {
        let (chunk, part) = (piece.piece / PER_CHUNK, piece.piece % PER_CHUNK);
        self.pieces_of.insert(piece.alarm, piece.pieces);
        let (bytes, have) = self
            .pieces
            .entry((piece.alarm, chunk))
            .or_insert_with(|| (vec![0; CHUNK], 0));
        let from = usize::from(part) * CAPTURE_PIECE;
        if piece.bytes.len() == CAPTURE_PIECE && *have >> part & 1 == 0 {
            bytes[from..from + CAPTURE_PIECE].copy_from_slice(&piece.bytes);
            *have |= 1 << part;
        }
    }

    /// What came since the last restart is complete.
    fn end_run(&mut self) {
        self.status = None;
        let stream = std::mem::take(&mut self.stream);
        if !stream.samples.is_empty() {
            self.heard.runs.push(stream);
        }
        let mut kept: BTreeMap<u64, Run> = BTreeMap::new();
        let mut whole: BTreeMap<u64, usize> = BTreeMap::new();
        for ((alarm, _), (bytes, have)) in std::mem::take(&mut self.pieces) {
            *whole.entry(alarm).or_default() += have.count_ones() as usize;
            let mut samples = Vec::new();
            let contents = (have.count_ones() == u32::from(PER_CHUNK))
                .then(|| unpack(&bytes, |counts| samples.push(*counts)))
                .flatten();
            let Some(contents) = contents.filter(|c| usize::from(c.axes) == self.axes) else {
                continue;
            };
            let run = kept.entry(alarm).or_default();
            run.alarm = Some(alarm);
            // Instants without a sample have no number, and how many there were is not known: so
            // many samples are left out that nobody bridges what is missing.
            let unusable = match contents.follows_gap && !run.samples.is_empty() {
                true => LONGEST_GAP + 1,
                false => 0,
            };
            let samples = (contents.first..).zip(samples).skip(unusable);
            run.samples.extend(samples);
        }
        for (alarm, all) in std::mem::take(&mut self.pieces_of) {
            let have = whole.get(&alarm).copied().unwrap_or_default();
            self.heard.pieces_lost += usize::from(all).saturating_sub(have);
        }
        self.heard.runs.extend(kept.into_values());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::chain::RawSample;
    use jointwatch_shared::wire::capture::Capture;

    #[test]
    fn instants_without_a_sample_leave_a_gap_that_is_not_bridged() {
        let mut capture = Capture::new(vec![[0; CHUNK]; 4].leak());
        capture.alarm(0);
        for number in 0..20_000 {
            // Something went by without a sample before the tenth one.
            capture.sample(number, &RawSample::default(), 1, number == 10);
        }
        let mut reading = Reading {
            axes: 1,
            checksum: 0,
            stream: Run::default(),
            pieces: BTreeMap::new(),
            pieces_of: BTreeMap::new(),
            status: None,
            heard: Heard::default(),
        };
        let pieces = (0..).map_while(|piece| capture.piece(piece).ok());
        pieces.for_each(|piece| reading.piece(&piece));
        reading.end_run();
        let numbers: Vec<u64> = reading.heard.runs[0].samples.keys().copied().collect();
        assert_eq!(numbers[..11], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16]);
        let steps = numbers.windows(2).filter(|pair| pair[1] - pair[0] > 1);
        assert_eq!(steps.count(), 1);
    }
}
