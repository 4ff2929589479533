//! What the device says of itself and of the joint: who it is, how it is, its samples, what
//! happened.

use super::Text;
use super::upload::{ModelFault, Slot};
use super::verdict::{KeptAlarm, Verdict};
use crate::base::Model;
use crate::base::axis::AxisKind;
use crate::chain::{Chain, Output, RawAxis, RawSample};
use crate::monitor::{self, limits::CHANNELS};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// The most channels that a device reports on: those of two axes.
pub const MAX_CHANNELS: usize = 2 * CHANNELS;
/// The most residuals in one piece of a snapshot.
pub const SNAPSHOT_PIECE: usize = 16;

/// Who the device is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION); first, so that every receiver can read it.
    pub protocol: u16,
    /// The firmware's version: major, minor, patch.
    pub firmware: [u16; 3],
    /// Why it introduces itself; sequence numbers begin anew at 0 with [`Occasion::Restart`].
    pub occasion: Occasion,
    /// The model in use; `None` while there is none.
    pub model: Option<ModelIdentity>,
    /// The rig block in use; `None` while there is none, and the device gives raw counts only.
    pub rig: Option<RigIdentity>,
    /// Whom it trusts, and what its flash has been through.
    pub access: Access,
}

/// Whom a device trusts, and what its flash has been through.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Access {
    /// It trusts the development key, whose private half everybody knows.
    pub development_key: bool,
    /// The class of devices that it belongs to.
    pub class: Text,
    /// The keys that it trusts: bit 0 the first, bit 1 the second.
    pub keys: u8,
    /// The number that the next order has to be signed with.
    pub number: u32,
    /// A model has to have a larger release than this one.
    pub newest: u32,
    /// Erasures of a slot in the life of the device.
    pub erasures: u32,
}

/// Why a device introduces itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Occasion {
    /// The device has restarted.
    Restart,
    /// The host asked for it.
    Asked,
    /// Its model or its rig block has changed. Today's firmware restarts then, and never sends
    /// this.
    Changed,
}

/// Which model the device uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelIdentity {
    /// The slot it lies in.
    pub slot: Slot,
    /// The checksum that ends its blob; `jointwatch inspect` shows the same.
    pub crc: u32,
    /// Whether its signature was verified.
    pub signed: bool,
    /// Hz, of the records that it was learnt from.
    pub sample_rate_hz: f64,
    /// The axes of the model.
    pub axes: Vec<AxisIdentity, 2>,
}

impl ModelIdentity {
    /// Who this model is, from the slot it lies in and the checksum that ends its blob.
    pub fn new(model: &Model, slot: Slot, crc: u32, signed: bool) -> Self {
        let header = model.header();
        let axes = header.axes.iter().zip(model.outputs());
        Self {
            slot,
            crc,
            signed,
            sample_rate_hz: header.sample_rate_hz,
            // Both hold two, and a name is at most as long as a text.
            axes: axes
                .take(2)
                .map(|(axis, output)| AxisIdentity {
                    name: Text::try_from(axis.name.as_str()).unwrap_or_default(),
                    kind: axis.kind.into(),
                    force_per_lsb: output.force_per_lsb,
                })
                .collect(),
        }
    }
}

/// What a person needs to read the forces of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisIdentity {
    /// The axis's name, as in the model.
    pub name: Text,
    /// Whether it is a translation or a rotation.
    pub kind: Quantity,
    /// N or N·m per unit of the forces in [`SampleOutput`] and [`Snapshot`].
    pub force_per_lsb: f64,
}

/// What an axis measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// A translation, in m and N.
    Translation,
    /// A rotation, in rad and N·m.
    Rotation,
}

impl From<AxisKind> for Quantity {
    fn from(kind: AxisKind) -> Self {
        match kind {
            AxisKind::Translation => Self::Translation,
            AxisKind::Rotation => Self::Rotation,
        }
    }
}

/// Which rig block the device uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigIdentity {
    /// The checksum that ends the block.
    pub crc: u32,
    /// Hz, at which the sensors are sampled.
    pub sample_rate_hz: f64,
    /// Samples by which forces and residuals lag behind the sensors.
    pub delay: u16,
    /// Samples by which the residual in the band lags behind the sensors.
    pub band_delay: u16,
}

impl RigIdentity {
    /// Who this rig block is, from what it says and the checksum that ends it.
    pub fn new(sample_rate_hz: f64, chain: &Chain, crc: u32) -> Self {
        Self {
            crc,
            sample_rate_hz,
            // Filters have at most a few hundred taps.
            delay: chain.delay() as u16,
            band_delay: chain.band_delay() as u16,
        }
    }
}

/// How the device and the joint are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Samples taken since the restart.
    pub sample: u64,
    /// What the monitor says.
    pub verdict: Verdict,
    /// Part of the recent time with a state outside the training range, in 1/1000
    /// ([`MonitorState::outside_permille`](crate::monitor::MonitorState::outside_permille)).
    pub outside_permille: u16,
    /// What the monitor knows of each axis; empty without a model.
    pub axes: Vec<AxisStatus, 2>,
    /// The channels of axis 0 (displacement far, displacement near, body, acceleration, force,
    /// input), then those of axis 1.
    pub channels: Vec<SensorStatus, MAX_CHANNELS>,
    /// What went wrong since the restart or the last reset.
    pub counters: Counters,
    /// The device trusts the development key: anybody can put a model onto it.
    pub development_key: bool,
}

/// An alarm that nobody has acknowledged: told with every status, whatever the verdict has become
/// meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Alarm {
    /// The sample, counted since the restart, at which it was raised.
    pub sample: u64,
    /// What was said then.
    pub verdict: Verdict,
    /// Alarms since then, this one among them; stays at its largest value.
    pub alarms: u16,
}

/// What outlasts a loss of power, and what would cause one: told with every status.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Upkeep {
    /// The first alarm of an earlier run, until it is acknowledged.
    pub alarm: Option<KeptAlarm>,
    /// The supply of the chip, and whether it is too low for the flash.
    pub supply: Supply,
}

/// What the device knows of its supply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Supply {
    /// Below this voltage in mV the chip holds itself in reset, as its option bytes set it; `None`
    /// where the board cannot tell.
    pub reset_below_mv: Option<u16>,
    /// The voltage is too low for the flash to be written: nothing is, meanwhile.
    pub is_low: bool,
}

/// The sliding error of one axis: an NMSE, 100·Σ(r−r̂)²/(N·var r) in percent, here in 1/1000 %,
/// from [`MonitorState::nmse`](crate::monitor::MonitorState::nmse); `None` while the force has not
/// varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisStatus {
    /// Over the last 16 blocks or so.
    pub nmse_fast: Option<u32>,
    /// Over the last 1024 blocks or so.
    pub nmse_slow: Option<u32>,
}

/// How each axis stands, and how much that says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Samples taken since the restart.
    pub sample: u64,
    /// Samples lost since the restart or the last reset, whatever for; stays at its largest value.
    pub samples_lost: u32,
    /// Every axis that is judged; empty without a monitor.
    pub axes: Vec<AxisHealth, 2>,
}

/// How one axis stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisHealth {
    /// What the monitor says of this axis.
    pub verdict: Verdict,
    /// The part of the last [`RECENT`](crate::monitor::RECENT) blocks of the monitor that was
    /// judged, in 1/1000.
    pub judged_permille: u16,
    /// Samples since the last judged block ended, or since the start; stays at its largest value.
    pub unjudged_samples: u32,
}

impl From<monitor::AxisHealth> for AxisHealth {
    fn from(health: monitor::AxisHealth) -> Self {
        Self {
            verdict: health.verdict.into(),
            judged_permille: health.judged_permille,
            unjudged_samples: health.unjudged_samples,
        }
    }
}

/// How one channel is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorStatus {
    /// What is wrong with it, as the code of a cause; 0 when nothing is.
    pub fault: u8,
    /// Transfers that failed, of the chip that the channel belongs to, or of both accelerometers
    /// of a pair.
    pub bus_errors: u32,
    /// Readings whose checksum was wrong, of the same.
    pub crc_errors: u32,
}

/// What the device could not do, counted since the restart or the last reset; each stays at its
/// largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Instants at which no sample was taken.
    pub missed_deadlines: u32,
    /// Samples that were lost because the evaluation had not kept up.
    pub queue_overruns: u32,
    /// Frames that were not sent because the line had not kept up.
    pub frames_dropped: u32,
    /// Forces that ran into a rail of their 32 bits.
    pub saturated: u32,
    /// Frames that were received damaged, or with a tag that the device does not know.
    pub link_errors: u32,
}

/// A piece of the residual around an alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Which alarm, counted from 1 since the restart.
    pub alarm: u16,
    /// This piece, from 0.
    pub piece: u16,
    /// Pieces that the snapshot is sent in.
    pub pieces: u16,
    /// The sample of the first residual here, relative to the one that raised the alarm.
    pub first: i32,
    /// Samples from one residual to the next.
    pub every: u16,
    /// Residual of both axes, in units of each axis's
    /// [`force_per_lsb`](AxisIdentity::force_per_lsb); the second is 0 for one axis.
    pub residual: Vec<[i32; 2], SNAPSHOT_PIECE>,
}

/// Bytes of a [`CapturePiece`] at most.
pub const CAPTURE_PIECE: usize = 192;

/// A piece of the counts around an alarm, as [`capture`](crate::wire::capture) packs them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CapturePiece {
    /// The sample, counted since the restart, at which the alarm was raised.
    pub alarm: u64,
    /// This piece, from 0.
    pub piece: u16,
    /// Pieces that there are.
    pub pieces: u16,
    /// Ten pieces, one behind the other, are a [`Chunk`](crate::wire::capture::Chunk).
    pub bytes: Vec<u8, CAPTURE_PIECE>,
}

/// One sample. Counts belong to this instant; the output belongs to the one [`RigIdentity::delay`]
/// samples ago.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sample {
    /// Its number since the restart, from 0.
    pub sample: u64,
    /// For each axis: displacement far and near, body, acceleration, force, input, in counts.
    pub counts: Vec<[i32; CHANNELS], 2>,
    /// What the chain says; `None` without a model and a rig block, and until the filters are
    /// full.
    pub output: Option<SampleOutput>,
}

impl Sample {
    /// The sample with this number of a rig with one or two axes.
    pub fn new(sample: u64, raw: &RawSample, axes: usize, output: Option<&Output>) -> Self {
        let counts = raw.iter().take(axes.min(2)).map(RawAxis::counts);
        Self {
            sample,
            counts: counts.collect(),
            output: output.map(SampleOutput::from),
        }
    }
}

/// What the chain says of one instant; forces in units of each axis's
/// [`force_per_lsb`](AxisIdentity::force_per_lsb), the second 0 for one axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleOutput {
    /// Bit i is set when state i of [x, ẋ, φ, φ̇] was outside the training range, bit 4 + a when
    /// the input of axis a was.
    pub outside: u8,
    /// Bit a is set when a force of axis a ran into a rail of its 32 bits; bit 2 while a fault of
    /// a sensor is within the filters, so that mains hum is not tracked.
    pub saturated: u8,
    /// Restoring force from the equation of motion.
    pub measured: [i32; 2],
    /// Restoring force from the model.
    pub predicted: [i32; 2],
    /// Measured minus predicted, saturated.
    pub residual: [i32; 2],
    /// The residual in the common band, which belongs to the instant [`RigIdentity::band_delay`]
    /// samples ago.
    pub residual_band: Option<[i32; 2]>,
}

impl From<&Output> for SampleOutput {
    fn from(output: &Output) -> Self {
        Self {
            outside: output.outside,
            saturated: output.saturated,
            measured: output.measured,
            predicted: output.predicted,
            residual: output.residual,
            residual_band: output.residual_band,
        }
    }
}

/// Something happened that a person should know of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The device has started.
    Started {
        /// Why it had to.
        why: Restart,
    },
    /// The crystal does not swing: the clock, and with it the sample rate, is only as good as the
    /// internal oscillator.
    NoCrystal,
    /// No slot holds a usable model: only sensors are reported.
    NoModel,
    /// A slot holds something that is not used.
    ModelRefused {
        /// Which slot of the flash.
        slot: Slot,
        /// What is wrong with it.
        fault: ModelFault,
    },
    /// A slot holds a model without a valid signature, which is not used.
    ModelUnsigned {
        /// Which slot of the flash.
        slot: Slot,
    },
    /// A newly uploaded model has run and is kept.
    ModelConfirmed {
        /// Which slot of the flash.
        slot: Slot,
    },
    /// A newly uploaded model did not run; the old one is in use again.
    ModelGivenUp {
        /// The slot of the one that did not.
        slot: Slot,
    },
    /// There is no rig block: raw counts only.
    NoRig,
    /// The rig block is not used: raw counts only.
    RigRefused {
        /// What is wrong with it.
        fault: ModelFault,
    },
    /// Model and rig block do not fit each other: raw counts only.
    Mismatch,
    /// A sensor does not answer; it is tried again.
    SensorMissing {
        /// The first of its channels, numbered as in [`Status::channels`].
        channel: u8,
    },
    /// A sensor answers again.
    SensorBack {
        /// The first of its channels.
        channel: u8,
    },
    /// The monitor's verdict has another state or another reason than before.
    Verdict(Verdict),
}

/// Why the device started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Restart {
    /// The supply came on.
    PowerOn,
    /// The supply voltage fell too low.
    BrownOut,
    /// The reset pin was pulled.
    Pin,
    /// The program asked for it.
    Software,
    /// The program had stopped answering.
    Watchdog,
    /// A processor fault or a panic.
    Fault,
    /// The hardware does not tell.
    Unknown,
}

/// What became of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// The request's sequence number.
    pub to: u16,
    /// What became of it.
    pub answered: Answered,
}

/// What can become of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answered {
    /// The request was carried out.
    Done,
    /// Not now; ask again.
    Busy,
    /// There is nothing to send: no alarm has been raised since the restart.
    Nothing,
    /// The line is too slow for what was asked.
    LineTooSlow,
    /// The order is not signed by a key that the device trusts.
    NotSigned,
    /// The order was signed with another number than the device's next; ask it to introduce itself.
    Stale,
    /// The flash could not take it.
    Failed,
}
