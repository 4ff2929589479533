//! A line of the mains in a force channel, as a model and a rig know it: its frequency and how large it was when it was found.

use crate::error::Checks;

/// The line; both are 0 where there is none. Its phase is another one whenever a record or a device begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hum {
    /// Frequency, Hz, 0 to [`MOST_HZ`].
    pub frequency_hz: f64,
    /// Amplitude in the restoring force, N or N·m.
    pub amplitude: f64,
}

/// Half of the highest sample rate, Hz.
pub const MOST_HZ: f64 = 5e5;

impl Hum {
    /// No line.
    pub const NONE: Self = Self {
        frequency_hz: 0.0,
        amplitude: 0.0,
    };

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        // Zeros of either sign, told from their bits: no arithmetic on real numbers.
        [self.frequency_hz, self.amplitude].map(|x| x.to_bits() << 1) == [0; 2]
    }

    /// Checks that the numbers are usable: both are 0, or neither.
    pub(crate) fn check(&self, checks: &mut Checks) {
        let least = if self.is_none() {
            0.0
        } else {
            f64::MIN_POSITIVE
        };
        let quantity = "frequency of a line in Hz";
        checks.within(quantity, self.frequency_hz, least, MOST_HZ);
        checks.within("amplitude of a line", self.amplitude, least, 1e60);
    }
}
