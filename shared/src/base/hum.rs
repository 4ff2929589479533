//! Mains hum in a force channel, as a model and a rig know it: its frequency and how large it was
//! when it was found.

use crate::fault::Checks;
use serde::{Deserialize, Serialize};

/// Mains hum; both are 0 where there is none. Its phase is another one whenever a record or a
/// device begins.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hum {
    /// Frequency of the hum, Hz; 0 where there is none.
    #[serde(serialize_with = "crate::scalar::zero::plain_zero")]
    pub frequency_hz: f64,
    /// Amplitude in the restoring force, N or N·m.
    #[serde(serialize_with = "crate::scalar::zero::plain_zero")]
    pub amplitude: f64,
}

impl Hum {
    /// A force channel without hum.
    pub const NONE: Self = Self {
        frequency_hz: 0.0,
        amplitude: 0.0,
    };

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.frequency_hz == 0.0
    }

    /// Checks that the numbers are real numbers that can be such: what more it has to be, the rig
    /// that it is for says.
    pub(crate) fn check(&self, checks: &mut Checks) {
        for value in [self.frequency_hz, self.amplitude] {
            checks.within("frequency or amplitude of a line", value, 0.0, 1e60);
        }
    }
}
