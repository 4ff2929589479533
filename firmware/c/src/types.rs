//! What goes in and out of the library, laid out as C lays it out, and the constants beside it.

use core::mem::offset_of;
use jointwatch_shared::chain::{Output, RawAxis, RawSample};
use jointwatch_shared::monitor::{AxisHealth, Cause, Faults, State, Verdict};

/// Bytes of a model blob and of a rig block.
pub const JW_BLOB_LENGTH: usize = 4096;
/// The alignment of every buffer, in bytes.
pub const JW_ALIGN: usize = 16;
/// Bytes of a model's buffer.
pub const JW_MODEL_SIZE: usize = 4096;
/// Bytes of a chain's buffer.
pub const JW_CHAIN_SIZE: usize = 14336;
/// Bytes of a monitor's buffer.
pub const JW_MONITOR_SIZE: usize = 6144;

/// The output holds states and forces: the filters are full.
pub const JW_FLAG_VALID: u32 = 1 << 16;
/// residual_band holds a value, which comes at every so many samples.
pub const JW_FLAG_BAND: u32 = 1 << 17;
/// State i is outside the training range: JW_FLAG_OUTSIDE << i; the input of axis a:
/// JW_FLAG_OUTSIDE << (4 + a).
pub const JW_FLAG_OUTSIDE: u32 = 1;
/// A force of axis a is at the rail of its 32 bits: JW_FLAG_RAIL << a.
pub const JW_FLAG_RAIL: u32 = 1 << 8;
/// A fault is within the filters: mains hum was subtracted with its last amplitude and phase.
pub const JW_FLAG_HELD: u32 = 1 << 10;

/// Counts of one axis at one instant, with the signs that the rig's wiring gives them; what a rig
/// has not is 0.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct jw_axis_counts {
    /// Encoder counters: far side and near side.
    pub displacement: [i32; 2],
    /// Encoder counter of the body that carries the inertia.
    pub body: i32,
    /// Accelerometer code of the body that carries the inertia.
    pub acceleration: i32,
    /// Force or torque code.
    pub force: i32,
    /// Converter code of the input that effects of the axis follow.
    pub input: i32,
}

/// Counts of one instant, both axes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct jw_counts {
    /// The second stays 0 on a rig of one axis.
    pub axis: [jw_axis_counts; 2],
}

/// What went wrong with the sensors at one instant. Bit 6*axis + channel of a word stands for one
/// channel: far counter, near counter, body counter, accelerometer, force, input.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct jw_faults {
    /// The converter stood at a rail of its code.
    pub saturated: u16,
    /// The value was outside what the sensor's data sheet allows.
    pub out_of_range: u16,
    /// The checksum of the transfer was wrong.
    pub checksum: u16,
    /// The sensor did not answer in time, or the bus failed.
    pub time_out: u16,
    /// There was no new value.
    pub missing: u16,
    /// The counter lost its count and began anew, for as long as that is so.
    pub reference_lost: u16,
    /// Samples that were lost right before this one.
    pub lost: u32,
}

/// What the chain says of the instant jw_chain_delay samples ago. Forces are in counts of
/// jw_model_force_unit.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct jw_output {
    /// Normalised states [x, v, phi, omega] in Q31.
    pub state: [i32; 4],
    /// Restoring force from the equation of motion, per axis.
    pub measured: [i32; 2],
    /// Restoring force from the model.
    pub predicted: [i32; 2],
    /// Measured minus predicted restoring force, per axis.
    pub residual: [i32; 2],
    /// The residual in the common band, older still; with JW_FLAG_BAND only.
    pub residual_band: [i32; 2],
    /// JW_FLAG_VALID and the others; all else is 0 without that one.
    pub flags: u32,
}

/// What the monitor says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct jw_verdict {
    /// A jw_state: how it stands.
    pub state: u8,
    /// A jw_cause: why it stands so.
    pub cause: u8,
    /// The axis that it is about, from 0.
    pub axis: u8,
    /// The channel of that axis, when a sensor is meant, as in jw_faults. Of a change of the joint
    /// how it came: 1 suddenly, 2 slowly.
    pub channel: u8,
    /// How far it is, in 1/1000 of the threshold for a change of the joint, of the time for
    /// everything else.
    pub permille: u16,
}

/// How one axis stands, and how much that says.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct jw_health {
    /// How it stands, and why.
    pub verdict: jw_verdict,
    /// The part of the recent blocks that was judged, in 1/1000.
    pub judged_permille: u16,
    /// Samples since the last judged block ended.
    pub unjudged_samples: u32,
}

/// How the joint stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs, reason = "jw_state_name gives the words")]
pub enum jw_state {
    JW_UNJUDGED = 0,
    JW_HEALTHY = 1,
    JW_SUSPECT = 2,
    JW_ALARM = 3,
}

/// Why; jw_cause_name gives the words. 32 to 47: the joint changed. 48 to 63: a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs, reason = "jw_cause_name gives the words")]
pub enum jw_cause {
    JW_STARTING = 0,
    JW_AS_EXPECTED = 1,
    JW_NO_MODEL = 2,
    JW_NO_RIG = 3,
    JW_WITHOUT_LIMITS = 4,
    JW_LIMITS_OF_OTHER_MODEL = 5,
    JW_TOO_GENTLE = 6,
    JW_SENSOR_FAULT = 7,
    JW_SAMPLES_LOST = 8,
    JW_OUTSIDE_RANGE = 16,
    JW_ERROR_GREW = 32,
    JW_STIFFER = 33,
    JW_SOFTER = 34,
    JW_MORE_FRICTION = 35,
    JW_LESS_FRICTION = 36,
    JW_FORCE_GONE = 37,
    JW_FORCE_UNEXPECTED = 38,
    JW_STUCK = 48,
    JW_SATURATED = 49,
    JW_OUT_OF_RANGE = 50,
    JW_WRONG_CHECKSUM = 51,
    JW_TIME_OUT = 52,
    JW_MISSING = 53,
    JW_REFERENCE_LOST = 54,
}

/// Holds that a struct of C has the fields of one of Rust at the same places, so that the boundary
/// may hand it on without a copy.
macro_rules! same_bytes {
    ($of_c:ty, $of_rust:ty, [$($field:ident),*]) => {
        const _: () = assert!(
            size_of::<$of_c>() == size_of::<$of_rust>()
                && align_of::<$of_c>() == align_of::<$of_rust>()
                $(&& offset_of!($of_c, $field) == offset_of!($of_rust, $field))*
        );
    };
}

same_bytes!(
    jw_axis_counts,
    RawAxis,
    [displacement, body, acceleration, force]
);
same_bytes!(jw_counts, RawSample, []);
same_bytes!(
    jw_faults,
    Faults,
    [
        saturated,
        out_of_range,
        checksum,
        time_out,
        missing,
        reference_lost,
        lost
    ]
);

impl From<&Output> for jw_output {
    fn from(output: &Output) -> Self {
        let band = output.residual_band.map_or(0, |_| JW_FLAG_BAND);
        Self {
            state: output.state,
            measured: output.measured,
            predicted: output.predicted,
            residual: output.residual,
            residual_band: output.residual_band.unwrap_or([0; 2]),
            flags: JW_FLAG_VALID
                | band
                | u32::from(output.outside)
                | u32::from(output.saturated) << 8,
        }
    }
}

impl jw_output {
    /// What the monitor takes; none while the filters fill.
    pub(crate) fn output(&self) -> Option<Output> {
        if self.flags & JW_FLAG_VALID == 0 {
            return None;
        }
        let [outside, saturated, ..] = self.flags.to_le_bytes();
        Some(Output {
            state: self.state,
            outside,
            measured: self.measured,
            predicted: self.predicted,
            residual: self.residual,
            residual_band: (self.flags & JW_FLAG_BAND != 0).then_some(self.residual_band),
            saturated,
        })
    }
}

impl From<Verdict> for jw_verdict {
    fn from(verdict: Verdict) -> Self {
        Self {
            state: verdict.state as u8,
            cause: verdict.cause as u8,
            axis: verdict.axis,
            channel: verdict.channel,
            permille: verdict.permille,
        }
    }
}

impl From<AxisHealth> for jw_health {
    fn from(health: AxisHealth) -> Self {
        Self {
            verdict: health.verdict.into(),
            judged_permille: health.judged_permille,
            unjudged_samples: health.unjudged_samples,
        }
    }
}

/// Room for the longest name and the zero behind it.
type Name = [u8; 48];

const fn name(words: &str) -> Name {
    let (bytes, mut name) = (words.as_bytes(), [0; 48]);
    let mut at = 0;
    while at < bytes.len() {
        name[at] = bytes[at];
        at += 1;
    }
    assert!(at < name.len(), "the zero behind it has no room");
    name
}

/// The words of every state, in the order of [`State::ALL`].
static STATES: [Name; State::ALL.len()] = {
    let mut names = [[0; 48]; State::ALL.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = name(State::ALL[at].words());
        at += 1;
    }
    names
};

/// The words of every cause, in the order of [`Cause::ALL`].
static CAUSES: [Name; Cause::ALL.len()] = {
    let mut names = [[0; 48]; Cause::ALL.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = name(Cause::ALL[at].words());
        at += 1;
    }
    names
};

static UNKNOWN: Name = name("unknown");

/// The words of a state's number, with a zero behind them.
pub(crate) fn state_name(number: u8) -> &'static Name {
    let mut known = State::ALL.into_iter().zip(&STATES);
    let found = known.find(|(state, _)| *state as u8 == number);
    found.map_or(&UNKNOWN, |(_, name)| name)
}

/// The words of a cause's number, with a zero behind them.
pub(crate) fn cause_name(number: u8) -> &'static Name {
    let mut known = Cause::ALL.into_iter().zip(&CAUSES);
    let found = known.find(|(cause, _)| *cause as u8 == number);
    found.map_or(&UNKNOWN, |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::{Cause, State, jw_cause::*, jw_state::*};

    #[test]
    fn states_and_causes_have_the_numbers_of_the_telemetry() {
        let states = [JW_UNJUDGED, JW_HEALTHY, JW_SUSPECT, JW_ALARM];
        assert_eq!(states.map(|state| state as u8), State::ALL.map(State::tag));
        let causes = [
            JW_STARTING,
            JW_AS_EXPECTED,
            JW_NO_MODEL,
            JW_NO_RIG,
            JW_WITHOUT_LIMITS,
            JW_LIMITS_OF_OTHER_MODEL,
            JW_TOO_GENTLE,
            JW_SENSOR_FAULT,
            JW_SAMPLES_LOST,
            JW_OUTSIDE_RANGE,
            JW_ERROR_GREW,
            JW_STIFFER,
            JW_SOFTER,
            JW_MORE_FRICTION,
            JW_LESS_FRICTION,
            JW_FORCE_GONE,
            JW_FORCE_UNEXPECTED,
            JW_STUCK,
            JW_SATURATED,
            JW_OUT_OF_RANGE,
            JW_WRONG_CHECKSUM,
            JW_TIME_OUT,
            JW_MISSING,
            JW_REFERENCE_LOST,
        ];
        assert_eq!(causes.map(|cause| cause as u8), Cause::ALL.map(Cause::tag));
    }
}
