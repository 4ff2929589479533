//! What the processor is clocked by: a quartz crystal, or the oscillator inside the chip.

use core::fmt;

/// Which oscillator sets the pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A quartz crystal on the board: good to tens of parts per million.
    Crystal,
    /// The RC oscillator inside the chip: good to about a percent, so sample times are only as
    /// good.
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

/// The processor's clock: source and frequency.
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

/// How often the sensors are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Samples per second, in Hz: to be told.
    pub hz: f64,
    /// The same in 10⁻⁶ Hz, 1 Hz to 10 kHz: to be computed with.
    pub uhz: u64,
}

impl Rate {
    /// Where no rig block says otherwise.
    pub const USUAL: Self = Self {
        hz: 1000.0,
        uhz: 1_000_000_000,
    };
    /// The least and the most that the device takes, in 10⁻⁶ Hz.
    pub const UHZ: [u64; 2] = [1_000_000, 10_000_000_000];

    /// Counts of a clock of `hz` Hz from one sample to the next, rounded.
    pub const fn counts(self, hz: u32) -> u32 {
        // Under 2⁵³, and a clock counts under 2³² in a second.
        let counts = 1_000_000 * hz as u64 + self.uhz / 2;
        match counts.checked_div(self.uhz) {
            Some(counts) => counts as u32,
            None => u32::MAX,
        }
    }

    /// Samples in so many seconds, rounded.
    pub const fn samples(self, seconds: u32) -> u32 {
        ((self.uhz * seconds as u64 + 500_000) / 1_000_000) as u32
    }
}

impl fmt::Display for Clock {
    /// `crystal 168000000`: source and Hz.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.source.name(), self.hz)
    }
}

#[cfg(test)]
mod tests {
    use super::Rate;

    #[test]
    fn a_rate_in_counts_and_samples_is_that_in_hertz() {
        for (uhz, hz) in [
            (1_000_000, 1.0),
            (1_652_892_562, 1652.892562),
            (10_000_000_000, 1e4),
        ] {
            let rate = Rate { hz, uhz };
            for clock in [16_000_000, 84_000_000, 168_000_000] {
                assert_eq!(rate.counts(clock), (f64::from(clock) / hz).round() as u32);
            }
            assert_eq!(rate.samples(10), (10.0 * hz).round() as u32);
        }
        assert_eq!(Rate::USUAL.samples(1), 1000);
    }
}
