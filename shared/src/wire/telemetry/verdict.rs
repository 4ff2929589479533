//! What the monitor says as bytes: in a frame, and kept in flash.

use crate::monitor::{self, Cause, State};
use serde::{Deserialize, Serialize};

/// What the monitor says, in the codes that `docs/reference/telemetry.md` lists: codes, and not
/// enums, so that a receiver that does not know a newer one still reads the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verdict {
    /// The code of the state, [`State::tag`].
    pub state: u8,
    /// The code of the reason for it.
    pub cause: u8,
    /// The axis that it is about, from 0.
    pub axis: u8,
    /// The channel of that axis, from 0, when a sensor is meant; of a change of the joint how it
    /// came ([`Onset`](monitor::Onset)).
    pub channel: u8,
    /// How far it is, in 1/1000: of the threshold for a change of the joint, of the time for
    /// everything else.
    pub permille: u16,
}

impl From<monitor::Verdict> for Verdict {
    fn from(verdict: monitor::Verdict) -> Self {
        Self {
            state: verdict.state.tag(),
            cause: verdict.cause.tag(),
            axis: verdict.axis,
            channel: verdict.channel,
            permille: verdict.permille,
        }
    }
}

impl Verdict {
    /// What the monitor said; `None` when a code is newer than this program.
    pub fn read(&self) -> Option<monitor::Verdict> {
        Some(monitor::Verdict {
            state: State::from_tag(self.state)?,
            cause: Cause::from_tag(self.cause)?,
            axis: self.axis,
            channel: self.channel,
            permille: self.permille,
        })
    }
}

/// An alarm of an earlier run that nobody has acknowledged: kept in flash, so that a restart does
/// not take it back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptAlarm {
    /// The sample, counted since the restart that began that run, at which it was raised.
    pub sample: u64,
    /// What was said then.
    pub verdict: Verdict,
}
