//! The emulated device that runs on and on, its serial line on a TCP port, its joint changed when
//! somebody says so.

use super::board::{Board, BoardChip};
use super::joint::{Change, LoopedJoint};
use super::link::{Host, Memory, Next};
use super::loopback::Loopback;
use crate::emulate::bench::REST;
use crate::text::error::Result;
use jointwatch_shared::wire::wiring::{Readings, Wiring};
use std::collections::VecDeque;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// What somebody tells the joint or the device.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Change the joint so, as [`LoopedJoint::change`] reads it, besides what was changed already.
    Change(String),
    /// Make the joint what it was.
    Restore,
    /// Come to an end.
    Quit,
}

/// What is told of the device that runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    /// Something happened, in a sentence.
    Said(String),
    /// How it goes, a few times a second.
    Going {
        /// Seconds of the device's time.
        time_s: f64,
        /// Seconds of the device's time per second.
        speed: f64,
        /// Whether a program is connected to the device's line.
        connected: bool,
    },
}

/// Behind so much it does not try to catch up: the computer is too slow, or was asleep.
const BEHIND: Duration = Duration::from_millis(500);
/// How often it is told how it goes.
const TELLING: Duration = Duration::from_millis(500);

/// The surroundings of a device that runs on and on.
pub struct Serving<'a> {
    joint: &'a LoopedJoint<'a>,
    board: Board,
    rest: Readings,
    rows: Vec<Readings>,
    changes: Vec<Change>,
    line: &'a Loopback,
    to_device: VecDeque<u8>,
    orders: Receiver<Order>,
    /// Orders for later, by the instant.
    later: Vec<(u64, Order)>,
    tell: &'a mut dyn FnMut(Told),
    rate_hz: f64,
    at: u64,
    clock: Clock,
    over: bool,
}

impl<'a> Serving<'a> {
    /// A device wired so, with its joint; `later` are orders with the seconds of the device's time
    /// at which they come.
    ///
    /// # Errors
    /// When the motion of the loop cannot be found.
    pub fn new(
        joint: &'a LoopedJoint<'a>,
        (wiring, rate_hz): (&Wiring, f64),
        line: &'a Loopback,
        (orders, later): (Receiver<Order>, Vec<(f64, Order)>),
        tell: &'a mut dyn FnMut(Told),
    ) -> Result<Self> {
        let rows = joint.readings(&[])?;
        let instant = |(time_s, order): (f64, Order)| ((time_s * rate_hz) as u64, order);
        Ok(Self {
            joint,
            board: Board::new(wiring, rate_hz, 0),
            rest: wiring.at_rest(),
            rows,
            changes: Vec::new(),
            line,
            to_device: VecDeque::new(),
            orders,
            later: later.into_iter().map(instant).collect(),
            tell,
            rate_hz,
            at: 0,
            clock: Clock::new(rate_hz),
            over: false,
        })
    }

    fn time_s(&self) -> f64 {
        self.at as f64 / self.rate_hz
    }

    fn say(&mut self, what: &str) {
        let text = format!("{:.1} s: {what}", self.time_s());
        (self.tell)(Told::Said(text));
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Quit => self.over = true,
            Order::Restore => {
                self.changes.clear();
                self.turn("the joint is what it was");
            }
            Order::Change(text) => match self.joint.change(&text) {
                Ok(change) => {
                    let what = format!("the joint changed: {}", change.text);
                    self.changes.push(change);
                    self.turn(&what);
                }
                Err(e) => (self.tell)(Told::Said(e.sentence)),
            },
        }
    }

    /// The joint is another one from now on.
    fn turn(&mut self, what: &str) {
        match self.joint.readings(&self.changes) {
            Ok(rows) => {
                self.rows = rows;
                self.say(what);
            }
            Err(e) => (self.tell)(Told::Said(e.sentence)),
        }
    }
}

impl Host for Serving<'_> {
    fn select(&mut self, place: BoardChip, bytes: &mut [u8]) {
        self.board.select(place, bytes);
    }

    fn select_counters(&mut self, bytes: &[u8]) {
        self.board.select_counters(bytes);
    }

    fn next(&mut self) -> Next {
        while let Ok(order) = self.orders.try_recv() {
            self.obey(order);
        }
        let at = self.at;
        let due: Vec<_> = self.later.extract_if(.., |(when, _)| *when <= at).collect();
        due.into_iter().for_each(|(_, order)| self.obey(order));
        if self.over {
            return Next::End;
        }
        let row = at
            .checked_sub(REST)
            .map(|row| row as usize % self.rows.len());
        let readings = row.map_or(self.rest, |row| self.rows[row]);
        self.board.next_instant(&readings);
        self.at += 1;
        if let Some(speed) = self.clock.wait(self.at) {
            let time_s = self.time_s();
            (self.tell)(Told::Going {
                time_s,
                speed,
                connected: self.line.is_connected(),
            });
        }
        Next::Sample
    }

    fn sent(&mut self, bytes: &[u8]) {
        self.line.say(bytes);
    }

    fn received(&mut self, room: usize) -> Vec<u8> {
        self.to_device.extend(self.line.heard());
        let count = room.min(self.to_device.len());
        self.to_device.drain(..count).collect()
    }

    fn started(&mut self, _: u32) {}

    fn stages(&mut self, _: &[u32]) {}

    fn memory(&mut self, _: Memory) {}
}

/// Keeps the device from running faster than a real one.
struct Clock {
    rate_hz: f64,
    /// The instant of the device's time that belongs to a moment of this computer's.
    begun: Option<(u64, Instant)>,
    told: Option<(u64, Instant)>,
}

impl Clock {
    fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            begun: None,
            told: None,
        }
    }

    /// Waits until a sample is due; now and then gives how fast it went since it was told last.
    fn wait(&mut self, at: u64) -> Option<f64> {
        let now = Instant::now();
        let (first, begun) = *self.begun.get_or_insert((at, now));
        let due = begun + Duration::from_secs_f64((at - first) as f64 / self.rate_hz);
        let ahead = due.saturating_duration_since(now);
        // Two milliseconds are slept at a time: a shorter sleep is no shorter.
        if ahead > Duration::from_millis(2) {
            std::thread::sleep(ahead);
        } else if now.saturating_duration_since(due) > BEHIND {
            self.begun = Some((at, now));
        }
        let (told_at, told) = *self.told.get_or_insert((at, now));
        let took = now.saturating_duration_since(told);
        if took < TELLING {
            return None;
        }
        self.told = Some((at, now));
        Some((at - told_at) as f64 / self.rate_hz / took.as_secs_f64())
    }
}
