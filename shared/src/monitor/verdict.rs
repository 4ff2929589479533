//! What the monitor says: a state, and the reason for it in words that a person understands.

use super::limits::CHANNELS;
use core::fmt;

/// How the joint stands. The numbers are those of telemetry and never change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// Nothing can be said: something is missing, or too little was seen lately.
    #[default]
    Unjudged = 0,
    /// The joint behaves like its model.
    Healthy = 1,
    /// Something is not as it should be, but it may be chance, or nothing to do with damage.
    Suspect = 2,
    /// The joint changed, or a sensor fails.
    Alarm = 3,
}

impl State {
    /// Every state, in the order of the numbers in telemetry.
    pub const ALL: [Self; 4] = [Self::Unjudged, Self::Healthy, Self::Suspect, Self::Alarm];

    /// The number in telemetry.
    pub fn tag(self) -> u8 {
        self as u8
    }

    /// The state of a tag.
    pub fn from_tag(tag: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.tag() == tag)
    }

    /// How much it asks of a person: a joint that is not judged asks for more than one that is
    /// well.
    pub fn gravity(self) -> u8 {
        match self {
            Self::Healthy => 0,
            Self::Unjudged => 1,
            Self::Suspect => 2,
            Self::Alarm => 3,
        }
    }

    /// The state in a word or two, as people read it.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Unjudged => "not judged",
            Self::Healthy => "healthy",
            Self::Suspect => "suspect",
            Self::Alarm => "alarm",
        }
    }
}

/// Why the state is what it is. The numbers are those of telemetry and never change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Cause {
    /// The filters and the first block are still filling.
    #[default]
    Starting = 0,
    /// All is as the validation records let expect.
    AsExpected = 1,
    /// There is no model in either slot.
    NoModel = 2,
    /// There is no rig block, so that counts have no meaning.
    NoRig = 3,
    /// The rig block has no limits.
    NoLimits = 4,
    /// The limits were set for another model.
    OtherModel = 5,
    /// The joint has not moved enough lately.
    TooGentle = 6,
    /// Faults of the sensors have kept most of the recent time from being judged.
    SensorFault = 7,
    /// Too many samples are lost for the joint to be judged.
    SamplesLost = 8,
    /// The states are outside the training range for too much of the time.
    OutsideRange = 16,
    /// The error's share of the force is larger than on the validation records.
    ErrorGrew = 32,
    /// The residual grows with the displacement.
    Stiffer = 33,
    /// The residual falls with the displacement.
    Softer = 34,
    /// The residual grows with the velocity.
    MoreFriction = 35,
    /// The residual falls with the velocity.
    LessFriction = 36,
    /// Most of the force that the model expects is not there.
    ForceGone = 37,
    /// There is a force, most of which the model does not expect.
    ForceUnexpected = 38,
    /// A channel stands still while its axis moves.
    Stuck = 48,
    /// A channel or a force stands at the rail of its number.
    Saturated = 49,
    /// A channel gives values that its sensor cannot give.
    OutOfRange = 50,
    /// Transfers arrive with a wrong checksum.
    Checksum = 51,
    /// A sensor does not answer.
    TimeOut = 52,
    /// Samples were lost, or a channel had no new value.
    Missing = 53,
    /// A counter lost its count and began anew: what it counts from is not known any more.
    ReferenceLost = 54,
}

/// How a change of the joint came. The numbers are those of telemetry and never change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Onset {
    /// It is no change of the joint, or nobody said.
    #[default]
    Unknown = 0,
    /// It was there at once, or came within some seconds.
    Sudden = 1,
    /// It grew, as wear, a temperature and the drift of an instrument do.
    Slow = 2,
}

impl Onset {
    /// The number in telemetry: where a sensor's fault has its channel.
    pub fn tag(self) -> u8 {
        self as u8
    }

    /// The way of a tag.
    pub fn from_tag(tag: u8) -> Self {
        match tag {
            1 => Self::Sudden,
            2 => Self::Slow,
            _ => Self::Unknown,
        }
    }
}

/// The channels of an axis, in the order of [`RawAxis`](crate::chain::RawAxis).
pub const CHANNEL_NAMES: [&str; CHANNELS] = [
    "far displacement counter",
    "near displacement counter",
    "body counter",
    "accelerometer",
    "force channel",
    "input channel",
];

impl Cause {
    /// Every cause, in the order of the numbers in telemetry.
    pub const ALL: [Self; 24] = [
        Self::Starting,
        Self::AsExpected,
        Self::NoModel,
        Self::NoRig,
        Self::NoLimits,
        Self::OtherModel,
        Self::TooGentle,
        Self::SensorFault,
        Self::SamplesLost,
        Self::OutsideRange,
        Self::ErrorGrew,
        Self::Stiffer,
        Self::Softer,
        Self::MoreFriction,
        Self::LessFriction,
        Self::ForceGone,
        Self::ForceUnexpected,
        Self::Stuck,
        Self::Saturated,
        Self::OutOfRange,
        Self::Checksum,
        Self::TimeOut,
        Self::Missing,
        Self::ReferenceLost,
    ];

    /// The number in telemetry.
    pub fn tag(self) -> u8 {
        self as u8
    }

    /// The cause of a tag.
    pub fn from_tag(tag: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.tag() == tag)
    }

    /// What happened, without saying where.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::AsExpected => "as expected",
            Self::NoModel => "no model",
            Self::NoRig => "rig block missing",
            Self::NoLimits => "the rig block has no limits for the monitor",
            Self::OtherModel => "the limits were set for another model",
            Self::TooGentle => "too little motion to be judged",
            Self::SensorFault => "sensor faults",
            Self::SamplesLost => "samples lost",
            Self::OutsideRange => "outside the trained range",
            Self::ErrorGrew => "error grew",
            Self::Stiffer => "stiffer than the model",
            Self::Softer => "softer than the model",
            Self::MoreFriction => "more friction than in the model",
            Self::LessFriction => "less friction than in the model",
            Self::ForceGone => "most of the expected force is missing",
            Self::ForceUnexpected => "force that the model does not expect",
            Self::Stuck => "stuck",
            Self::Saturated => "at its rail",
            Self::OutOfRange => "out of range",
            Self::Checksum => "wrong checksums",
            Self::TimeOut => "no answer",
            Self::Missing => "samples missing",
            Self::ReferenceLost => "reference lost",
        }
    }

    /// Whether it is a change of the joint.
    pub fn is_damage(self) -> bool {
        matches!(self.tag(), 32..=47)
    }

    /// Whether it is a fault of a sensor.
    pub fn is_sensor(self) -> bool {
        matches!(self.tag(), 48..=63)
    }
}

/// What the monitor says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// How the joint stands.
    pub state: State,
    /// Why it stands so.
    pub cause: Cause,
    /// The axis that it is about, from 0.
    pub axis: u8,
    /// The channel of that axis, when a sensor is meant: a place in [`CHANNEL_NAMES`]. Of a change
    /// of the joint the tag of its [`Onset`].
    pub channel: u8,
    /// How far it is, in 1/1000: of the threshold for a change of the joint, of the time for
    /// everything else.
    pub permille: u16,
}

impl Verdict {
    /// What a device says that cannot run the monitor.
    pub fn without(cause: Cause) -> Self {
        Self {
            cause,
            ..Self::default()
        }
    }

    /// How it came, where it is a change of the joint.
    pub fn onset(&self) -> Onset {
        if self.cause.is_damage() {
            Onset::from_tag(self.channel)
        } else {
            Onset::Unknown
        }
    }

    /// Whether it says the same as another, however far it is.
    pub fn same_reason(&self, other: &Self) -> bool {
        let said = |v: &Self| (v.state, v.cause, v.axis, v.channel);
        said(self) == said(other)
    }

    /// The reason as a sentence without a full stop; `names` are those of the axes.
    pub fn words<'a>(&self, names: &'a [&'a str]) -> Words<'a> {
        Words {
            verdict: *self,
            names,
        }
    }
}

/// The reason of a verdict, to be printed.
#[derive(Clone, Copy, Debug)]
pub struct Words<'a> {
    verdict: Verdict,
    names: &'a [&'a str],
}

impl fmt::Display for Words<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Verdict {
            cause,
            axis,
            channel,
            permille,
            ..
        } = self.verdict;
        let words = cause.words();
        let axis = self.names.get(usize::from(axis)).copied().unwrap_or("?");
        let percent = permille.saturating_add(5) / 10;
        match cause {
            Cause::OutsideRange => write!(f, "{words} {percent} % of the time"),
            Cause::ErrorGrew => write!(f, "{words} on {axis}"),
            // What goes with the displacement may as well be the gain of the bridge.
            Cause::Stiffer => write!(f, "{axis} is {words}, or its force channel reads high"),
            Cause::Softer => write!(f, "{axis} is {words}, or its force channel reads low"),
            Cause::ForceGone | Cause::ForceUnexpected | Cause::TooGentle => {
                write!(f, "{axis}: {words}")
            }
            Cause::SensorFault | Cause::SamplesLost => {
                write!(f, "{words} keep {axis} from being judged")
            }
            Cause::MoreFriction | Cause::LessFriction => write!(f, "{axis} has {words}"),
            cause if cause.is_sensor() => {
                let channels = CHANNEL_NAMES.get(usize::from(channel));
                let channel = channels.copied().unwrap_or("a channel");
                write!(f, "{channel} of {axis}: {words}")?;
                if matches!(cause, Cause::Stuck | Cause::ReferenceLost) {
                    return Ok(());
                }
                write!(f, ", {percent} % of the time")
            }
            _ => f.write_str(words),
        }?;
        match self.verdict.onset() {
            Onset::Slow => f.write_str("; it came slowly"),
            Onset::Sudden | Onset::Unknown => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::format;

    #[test]
    fn a_joint_that_is_not_judged_asks_for_more_than_one_that_is_well() {
        let order = [
            State::Healthy,
            State::Unjudged,
            State::Suspect,
            State::Alarm,
        ];
        assert!(order.map(State::gravity).is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn tags_are_what_they_always_were() {
        assert_eq!(State::ALL.map(State::tag), [0, 1, 2, 3]);
        let tags = Cause::ALL.map(Cause::tag);
        let known = [
            0, 1, 2, 3, 4, 5, 6, 7, 8, 16, 32, 33, 34, 35, 36, 37, 38, 48, 49, 50, 51, 52, 53, 54,
        ];
        assert_eq!(tags, known);
        for tag in 0..=u8::MAX {
            assert_eq!(Cause::from_tag(tag).is_some(), known.contains(&tag));
            assert_eq!(State::from_tag(tag).is_some(), tag < 4);
        }
    }

    #[test]
    fn reasons_read_as_a_person_would_say_them() {
        let said = |cause, axis, channel, permille| {
            let verdict = Verdict {
                state: State::Alarm,
                cause,
                axis,
                channel,
                permille,
            };
            format!("{}", verdict.words(&["x", "phi"]))
        };
        assert_eq!(said(Cause::ErrorGrew, 0, 0, 1000), "error grew on x");
        assert_eq!(
            said(Cause::Softer, 1, 0, 1000),
            "phi is softer than the model, or its force channel reads low"
        );
        assert_eq!(
            said(Cause::MoreFriction, 0, Onset::Sudden.tag(), 1000),
            "x has more friction than in the model"
        );
        assert_eq!(
            said(Cause::MoreFriction, 0, Onset::Slow.tag(), 1000),
            "x has more friction than in the model; it came slowly"
        );
        assert_eq!(said(Cause::Stuck, 0, 4, 1000), "force channel of x: stuck");
        assert_eq!(
            said(Cause::ReferenceLost, 0, 1, 1000),
            "near displacement counter of x: reference lost"
        );
        assert_eq!(
            said(Cause::Checksum, 1, 3, 23),
            "accelerometer of phi: wrong checksums, 2 % of the time"
        );
        assert_eq!(
            said(Cause::OutsideRange, 0, 0, 400),
            "outside the trained range 40 % of the time"
        );
        assert_eq!(said(Cause::NoModel, 9, 9, 0), "no model");
        assert_eq!(said(Cause::NoRig, 9, 9, 0), "rig block missing");
    }
}
