//! What the processor is clocked by: a quartz crystal, or the oscillator inside the chip.

use core::fmt;

/// Which oscillator sets the pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A quartz crystal on the board: good to tens of parts per million.
    Crystal,
    /// The RC oscillator inside the chip: good to about a percent, so sample times are only as good.
    Internal,
}

impl Source {
    /// The word used in logs and in the self-test's text.
    pub fn name(self) -> &'static str {
        match self {
            Source::Crystal => "crystal",
            Source::Internal => "internal",
        }
    }
}

/// The processor's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Where it comes from.
    pub source: Source,
    /// Its frequency, in Hz.
    pub hz: u32,
}

impl Clock {
    /// A processor clock of `hz` Hz made from the board's crystal.
    pub const fn crystal(hz: u32) -> Self {
        Self {
            source: Source::Crystal,
            hz,
        }
    }

    /// A processor clock of `hz` Hz made from the oscillator inside the chip.
    pub const fn internal(hz: u32) -> Self {
        Self {
            source: Source::Internal,
            hz,
        }
    }
}

impl fmt::Display for Clock {
    /// `crystal 168000000`: source and Hz.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.source.name(), self.hz)
    }
}
