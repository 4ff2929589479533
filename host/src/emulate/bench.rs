//! The bench that the emulated device stands on: its chips fed with a record, its serial line, and
//! somebody who listens.

use super::board::{Board, BoardChip, DropOuts, Injection};
use super::judge::{Comparison, Judge, Said};
use super::line::{SerialLine, Streamer, Talk, Uploading};
use super::link::{Host, Memory, Next};
use crate::device::telemetry::listen::Tally;
use crate::device::upload::Uploaded;
use crate::text::error::Result;
use jointwatch_shared::wire::wiring::{Readings, Wiring};
use serde::Serialize;

/// Instants at which the rig rests before the record begins, so that the device can set its chips
/// up: encoders at their start counts, forces and accelerations zero.
pub const REST: u64 = 64;
/// The stages of a sample, in the order in which the device counts their instructions.
pub const STAGES: [&str; 4] = ["sample", "evaluate", "monitor", "serve"];
/// Instants that a talk over the line may last beyond the record, in seconds of the device's time.
const LINGER_S: f64 = 3600.0;

/// What a test does to the device and its surroundings.
#[derive(Default)]
pub struct Scenario {
    /// Chips that fail, and when.
    pub injections: Vec<Injection>,
    /// Transfers that do not take place.
    pub drop_outs: Option<DropOuts>,
    /// Probability that a bit on the serial line is wrong.
    pub bit_error_rate: f64,
    /// Begins to talk over the line at this instant.
    pub talk: Option<(u64, Talk)>,
    /// Instants at which the device is told to restart.
    pub restarts: Vec<u64>,
    /// The restart that comes when so many answers to an upload were heard.
    pub restart_after_replies: Option<usize>,
    /// Samples that are taken so many instants late.
    pub late: Vec<(u64, u8)>,
    /// Instants that go on after the record and after a talk, at the last row.
    pub linger: u64,
    /// For drop-outs and noise.
    pub seed: u64,
}

/// What instructions a stage took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Instructions {
    /// Samples that were counted.
    pub samples: u64,
    /// Instructions of all samples together.
    pub sum: u64,
    /// The fewest instructions of a sample.
    pub least: u32,
    /// The most instructions of a sample.
    pub most: u32,
}

impl Instructions {
    fn add(&mut self, count: u32) {
        self.least = if self.samples == 0 {
            count
        } else {
            self.least.min(count)
        };
        self.most = self.most.max(count);
        self.sum += u64::from(count);
        self.samples += 1;
    }

    /// Takes in what was counted elsewhere.
    pub fn merge(&mut self, other: &Self) {
        match (self.samples, other.samples) {
            (_, 0) => {}
            (0, _) => *self = *other,
            _ => {
                self.least = self.least.min(other.least);
                self.most = self.most.max(other.most);
                self.sum += other.sum;
                self.samples += other.samples;
            }
        }
    }

    /// Mean instructions per sample; 0 where none was counted.
    pub fn mean(&self) -> f64 {
        self.sum as f64 / self.samples.max(1) as f64
    }
}

/// What came of a run.
#[derive(Debug)]
pub struct Run {
    /// Sampling instants of the run.
    pub instants: u64,
    /// Against the host's chain.
    pub comparison: Comparison,
    /// Messages, and what was lost or damaged of them.
    pub tally: Tally,
    /// What the device said beside its samples.
    pub said: Said,
    /// Instructions of a start, the last one: slots read, signatures verified; nothing where the
    /// device never came to its first instant.
    pub start: Option<u32>,
    /// Per stage, from the record's beginning on; empty unless the device counted.
    pub instructions: Vec<Instructions>,
    /// What memory was used, if the device told.
    pub memory: Option<Memory>,
    /// How the talk over the line went.
    pub uploaded: Option<Result<Uploaded>>,
}

/// Chips, serial line and judge around one emulated device.
pub struct Bench<'a> {
    board: Board,
    wiring: Wiring,
    /// Row by row; the rest before them is not in it.
    rows: Vec<Readings>,
    rest: Readings,
    judge: Judge<'a>,
    line: SerialLine,
    streamer: Streamer,
    scenario: Scenario,
    talk: Option<Uploading>,
    /// How the one that has ended went.
    uploaded: Option<Result<Uploaded>>,
    at: u64,
    /// The record's end, and what goes on after it or after a talk.
    until: u64,
    most: u64,
    start: Option<u32>,
    instructions: Vec<Instructions>,
    memory: Option<Memory>,
}

impl<'a> Bench<'a> {
    /// A board wired so, fed with these rows.
    pub fn new(
        wiring: &Wiring,
        sample_rate_hz: f64,
        rows: Vec<Readings>,
        judge: Judge<'a>,
        mut scenario: Scenario,
    ) -> Self {
        let injections = std::mem::take(&mut scenario.injections);
        let board = Board::new(wiring, sample_rate_hz, scenario.seed)
            .with_troubles(injections, scenario.drop_outs.take());
        let until = REST + rows.len() as u64 + scenario.linger;
        Self {
            board,
            wiring: wiring.clone(),
            rows,
            rest: wiring.at_rest(),
            judge,
            line: SerialLine::new(scenario.bit_error_rate, scenario.seed ^ 1),
            streamer: Streamer::default(),
            scenario,
            talk: None,
            uploaded: None,
            at: 0,
            until,
            most: until + (LINGER_S * sample_rate_hz) as u64,
            start: None,
            instructions: Vec::new(),
            memory: None,
        }
    }

    /// What came of it; a talk that still goes on is cut off.
    pub fn end(mut self) -> Run {
        if let Some(talk) = self.talk.take() {
            self.uploaded = Some(talk.end());
        }
        let (comparison, tally) = self.judge.verdict();
        Run {
            instants: self.at,
            comparison,
            tally,
            said: self.judge.said,
            start: self.start,
            instructions: self.instructions,
            memory: self.memory,
            uploaded: self.uploaded,
        }
    }

    /// Takes up what the talk sends, and notices its end.
    fn attend(&mut self) {
        if let Some((_, talk)) = self.scenario.talk.take_if(|(from, _)| *from <= self.at) {
            self.talk = Some(Uploading::begin(talk));
        }
        if let Some(talk) = &mut self.talk {
            let bytes = talk.requests();
            self.line.send(&bytes);
        }
        if let Some(talk) = self.talk.take_if(|talk| !talk.goes_on()) {
            self.uploaded = Some(talk.end());
            self.until = self.until.max(self.at + self.scenario.linger);
        }
    }

    /// Whether there is something to wait for beyond the record.
    fn is_over(&self) -> bool {
        let busy = self.talk.is_some() || self.scenario.talk.is_some();
        self.at >= self.most || self.at >= self.until && !busy
    }

    /// Whether the device is to restart now.
    fn restarts(&mut self) -> bool {
        let replies = self.judge.said.uploads.len();
        let broken_off = self.scenario.restart_after_replies;
        if broken_off.is_some_and(|wanted| replies >= wanted) {
            self.scenario.restart_after_replies = None;
            return true;
        }
        let before = self.scenario.restarts.len();
        let at = self.at;
        self.scenario.restarts.retain(|&instant| instant != at);
        self.scenario.restarts.len() < before
    }
}

impl Host for Bench<'_> {
    fn select(&mut self, place: BoardChip, bytes: &mut [u8]) {
        self.board.select(place, bytes);
    }

    fn select_counters(&mut self, bytes: &[u8]) {
        self.board.select_counters(bytes);
    }

    fn next(&mut self) -> Next {
        self.attend();
        if self.is_over() {
            return Next::End;
        }
        if self.restarts() {
            self.judge.restart();
            return Next::Restart;
        }
        let row = self.at.checked_sub(REST);
        let last = self.rows.len().saturating_sub(1);
        let readings = row.map(|row| self.rows.get((row as usize).min(last)));
        let readings = readings.flatten().copied().unwrap_or(self.rest);
        self.board.next_instant(&readings);
        self.judge.fed(self.wiring.raw_sample(&readings));
        let at = self.at;
        self.at += 1;
        let late = self
            .scenario
            .late
            .iter()
            .find(|(instant, _)| *instant == at);
        late.map_or(Next::Sample, |(_, instants)| Next::Late(*instants))
    }

    fn sent(&mut self, bytes: &[u8]) {
        let bytes = self.line.arriving(bytes);
        self.judge.hear(&bytes);
        self.streamer.hear(&bytes);
        if let Some(talk) = &mut self.talk {
            talk.hear(&bytes);
        }
    }

    fn received(&mut self, room: usize) -> Vec<u8> {
        let request = self.streamer.request();
        self.line.send(&request);
        self.attend();
        self.line.fetched(room)
    }

    fn started(&mut self, count: u32) {
        self.start = Some(count);
    }

    fn stages(&mut self, counts: &[u32]) {
        // The rest before the record is not what a sample takes: chips are set up.
        if self.at <= REST {
            return;
        }
        self.instructions
            .resize(counts.len(), Instructions::default());
        for (sum, &count) in self.instructions.iter_mut().zip(counts) {
            sum.add(count);
        }
    }

    fn memory(&mut self, memory: Memory) {
        self.memory = Some(memory);
    }
}
