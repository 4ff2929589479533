//! What is known to be wrong with the force channels: gain, cross-talk, delay and hum, as a model
//! carries them to the rig.
//!
//! A channel is first put in time, then its gain is put right, then the cross-talk of the other
//! channel is taken off: `F = (1 − excess)·F_read(t + delay) − cross·F_other`, with `F_other` the
//! other channel after its own time and gain. Hum is what then stands in the restoring force.

use super::axis::MAGNITUDE;
use crate::base::hum::Hum;
use crate::fault::{Checks, Error};

/// The largest share of a reading that can be too much or too little; a channel that is further off
/// is another channel.
pub const MAX_GAIN: f64 = 0.9;

/// Corrections of one axis's force channel; all 0 for a channel that is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceCorrection {
    /// Share of the reading that is too much, −[`MAX_GAIN`] to [`MAX_GAIN`].
    pub excess: f64,
    /// Reading of this channel per force on the other axis: N per N, N·m per N, …
    pub cross: f64,
    /// By how many seconds the channel is late; negative when it is early. −1 to 1.
    pub delay_s: f64,
    /// What stands in it of the mains, with a phase that is another one whenever a record or a
    /// device begins.
    pub hum: Hum,
}

impl ForceCorrection {
    /// Of a channel that is right.
    pub const NONE: Self = Self {
        excess: 0.0,
        cross: 0.0,
        delay_s: 0.0,
        hum: Hum::NONE,
    };

    /// Whether the channel is right as it is.
    pub fn is_none(&self) -> bool {
        [self.excess, self.cross, self.delay_s] == [0.0; 3] && self.hum.is_none()
    }

    /// Checks that the numbers are usable.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the first that is not.
    pub fn check(&self, axes: usize) -> Result<(), Error> {
        let mut checks = Checks::new();
        self.check_in(axes, &mut checks);
        checks.done()
    }

    /// [`Self::check`] as one of several, of which the first failure is kept in `checks`.
    pub(super) fn check_in(&self, axes: usize, checks: &mut Checks) {
        checks.within(
            "correction of a force gain",
            self.excess,
            -MAX_GAIN,
            MAX_GAIN,
        );
        let most = if axes == 2 { MAGNITUDE } else { 0.0 };
        checks.within("correction of cross-talk", self.cross, -most, most);
        let quantity = "correction of a force delay in s";
        checks.within(quantity, self.delay_s, -1.0, 1.0);
        self.hum.check(checks);
    }
}
