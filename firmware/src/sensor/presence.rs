//! Whether a chip is there: it is set up, watched, given up after repeated failure, and tried again
//! more and more rarely.
//!
//! ```text
//!           restart            set-up                    many failures in a row
//! waiting ───────────▶ starting ───────▶ running ───────────────────────────────▶ waiting
//!    ▲                    │ refused: twice the wait
//!    └────────────────────┘
//! ```
//! Time is counted in samples. A visit makes at most one attempt, and one at a chip that does not
//! answer is about as long on the bus as a reading: a reset in one sample, and in another a
//! converter's two frames, an accelerometer's four bytes, or three times two bytes of a counter. So
//! waiting for long saves little, and keeps a chip that is back from being heard.

use super::{ChipFault, Found, Sensor};

/// Samples from the first failed attempt to the next; doubled with each that follows.
pub const FIRST_WAIT: u16 = 16;
/// The longest wait: a quarter of a second at 1 kHz.
pub const LONGEST_WAIT: u16 = 256;
/// Samples that a chip gets between its reset and its set-up.
pub const TIME_TO_START: u16 = 16;
/// Failures in a row after which a chip that ran is set up again.
pub const FAILURES_ALLOWED: u8 = 8;
/// Readings in a row without anything new after which a chip counts as silent.
pub const STALE_ALLOWED: u8 = 8;
/// Samples after which a chip that answers again gives new codes, however long it was away: a
/// set-up that began before it was back and is refused, the longest wait, another set-up, and what
/// a chip may take until it has something new.
pub const BACK_WITHIN: u16 = 2 * (TIME_TO_START + 1) + LONGEST_WAIT + 1 + STALE_ALLOWED as u16 + 1;

/// How a sensor did at one instant; what a user is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ChipState {
    /// Not part of this rig.
    #[default]
    NotFitted = 0,
    /// A new, believable code.
    Ok = 1,
    /// Being set up, or waiting for it.
    Starting = 2,
    /// A code at a rail of its converter.
    Saturated = 3,
    /// A transfer on the bus failed.
    Bus = 4,
    /// A frame was damaged, on either way.
    Crc = 5,
    /// Another chip answers, or none.
    Identity = 6,
    /// Its settings do not stay.
    Settings = 7,
    /// Nothing new came in time.
    TimedOut = 8,
    /// It lost its supply or was reset.
    Restarted = 9,
}

impl ChipState {
    /// Every state, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::NotFitted,
        Self::Ok,
        Self::Starting,
        Self::Saturated,
        Self::Bus,
        Self::Crc,
        Self::Identity,
        Self::Settings,
        Self::TimedOut,
        Self::Restarted,
    ];

    /// Its name in a log.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFitted => "not fitted",
            Self::Ok => "ok",
            Self::Starting => "starting",
            Self::Saturated => "saturated",
            Self::Bus => "bus error",
            Self::Crc => "checksum error",
            Self::Identity => "wrong or no chip",
            Self::Settings => "settings not kept",
            Self::TimedOut => "no new sample",
            Self::Restarted => "restarted",
        }
    }

    /// Whether the code that came with it may be used.
    pub fn usable(self) -> bool {
        matches!(self, Self::Ok | Self::Saturated)
    }

    /// What a fault looks like from outside.
    pub fn of<E>(fault: &ChipFault<E>) -> Self {
        match fault {
            ChipFault::Bus(_) => Self::Bus,
            ChipFault::WrongIdentity { .. } => Self::Identity,
            ChipFault::Crc { .. } | ChipFault::NotUnderstood => Self::Crc,
            ChipFault::ConfigNotKept { .. } => Self::Settings,
            ChipFault::Restarted => Self::Restarted,
            ChipFault::NotReady => Self::TimedOut,
        }
    }
}

/// Where a chip stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Samples until the next restart.
    Waiting(u16),
    /// Samples until the set-up.
    Starting(u16),
    /// Failures and readings without anything new, in a row.
    Running { failures: u8, stale: u8 },
}

/// What one attempt to set up or read a chip gave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visit<T> {
    /// The code, or the codes: the last good ones where there are no new ones.
    pub value: T,
    /// How the chip did.
    pub health: ChipState,
    /// Bit i is set when code i stands at a rail.
    pub saturated: u8,
}

/// A chip with its presence.
pub struct Watched<S: Sensor> {
    sensor: S,
    phase: Phase,
    /// The wait after the next refusal.
    wait: u16,
    /// What was wrong last; shown until the chip gives something new.
    health: ChipState,
    value: S::Value,
    restarts: u32,
}

impl<S: Sensor> Watched<S> {
    /// A chip that was never talked to: the next visit begins.
    pub fn new(sensor: S) -> Self {
        Self {
            sensor,
            phase: Phase::Waiting(0),
            wait: FIRST_WAIT,
            health: ChipState::Starting,
            value: S::Value::default(),
            restarts: 0,
        }
    }

    /// The driver of the chip.
    pub fn sensor_mut(&mut self) -> &mut S {
        &mut self.sensor
    }

    /// Its last good code, or codes.
    pub fn last(&self) -> S::Value {
        self.value
    }

    /// Whether the chip is set up.
    pub fn is_running(&self) -> bool {
        matches!(self.phase, Phase::Running { .. })
    }

    /// How often the chip was set up from nothing; a counter's count begins anew with each.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    fn visit_result(&self, health: ChipState, saturated: u8) -> Visit<S::Value> {
        Visit {
            value: self.value,
            health,
            saturated,
        }
    }

    /// Gives the chip up for a while.
    fn refuse(&mut self, health: ChipState) {
        self.health = health;
        self.phase = Phase::Waiting(self.wait);
        self.wait = self.wait.saturating_mul(2).min(LONGEST_WAIT);
    }

    /// One sample: reads a chip that runs, and brings one that does not a step further.
    pub fn visit(&mut self) -> Visit<S::Value> {
        match self.phase {
            Phase::Waiting(0) => match self.sensor.restart() {
                Ok(()) => self.phase = Phase::Starting(TIME_TO_START),
                Err(fault) => self.refuse(ChipState::of(&fault)),
            },
            Phase::Starting(0) => match self.sensor.set_up() {
                Ok(found) => {
                    self.restarts = self
                        .restarts
                        .saturating_add(u32::from(found == Found::Fresh));
                    self.phase = Phase::Running {
                        failures: 0,
                        stale: 0,
                    };
                }
                Err(fault) => self.refuse(ChipState::of(&fault)),
            },
            Phase::Waiting(left) => self.phase = Phase::Waiting(left - 1),
            Phase::Starting(left) => self.phase = Phase::Starting(left - 1),
            Phase::Running { failures, stale } => return self.read(failures, stale),
        }
        self.visit_result(self.health, 0)
    }

    fn read(&mut self, failures: u8, stale: u8) -> Visit<S::Value> {
        match self.sensor.read() {
            Ok(reading) => {
                let stale = if reading.fresh {
                    // What is not new may be no reading at all, as the zeros of a line that nobody
                    // drives.
                    self.value = reading.value;
                    0
                } else {
                    stale.saturating_add(1)
                };
                if stale > STALE_ALLOWED {
                    self.refuse(ChipState::TimedOut);
                    return self.visit_result(ChipState::TimedOut, 0);
                }
                self.phase = Phase::Running { failures: 0, stale };
                if reading.fresh {
                    // It works: the next trouble is a new one.
                    self.wait = FIRST_WAIT;
                    self.health = ChipState::Ok;
                }
                // Until something new came, a chip that was set up again is no better than before.
                let health = match self.health {
                    ChipState::Ok if reading.saturated != 0 => ChipState::Saturated,
                    health => health,
                };
                self.visit_result(health, reading.saturated)
            }
            Err(fault) => {
                let health = ChipState::of(&fault);
                self.failed(health, failures, stale);
                self.visit_result(health, 0)
            }
        }
    }

    /// Counts a failure; a chip that lost its settings is given up at once.
    fn failed(&mut self, health: ChipState, failures: u8, stale: u8) {
        let failures = failures.saturating_add(1);
        let lost = matches!(health, ChipState::Restarted | ChipState::Settings);
        if lost || failures > FAILURES_ALLOWED {
            self.refuse(health);
        } else {
            self.phase = Phase::Running { failures, stale };
        }
    }

    /// Tells that the chip failed outside [`Watched::visit`].
    pub fn report(&mut self, health: ChipState) {
        if let Phase::Running { failures, stale } = self.phase {
            self.failed(health, failures, stale);
        }
    }
}
