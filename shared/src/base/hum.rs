//! A line of the mains in a force channel, as a model and a rig know it: its frequency and how large it was when it was found.

use crate::fault::Checks;

/// The line; both are 0 where there is none. Its phase is another one whenever a record or a device begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hum {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude in the restoring force, N or N·m.
    pub amplitude: f64,
}

impl Hum {
    /// No line.
    pub const NONE: Self = Self {
        frequency_hz: 0.0,
        amplitude: 0.0,
    };

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        // Told from its bits: no arithmetic on real numbers.
        self.frequency_hz.to_bits() == 0
    }

    /// Checks that the numbers are real numbers that can be such: what more a line has to be, the rig that it is for says.
    pub(crate) fn check(&self, checks: &mut Checks) {
        for value in [self.frequency_hz, self.amplitude] {
            checks.within("frequency or amplitude of a line", value, 0.0, 1e60);
        }
    }
}
