//! What is to be read on a live view, in words and numbers: the same for the terminal and for the
//! page.

use serde::Serialize;

/// How the joint and its device are now.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Picture {
    /// The joint in one word: `healthy`, `suspect`, `alarm`, `not judged`, or `silent` where
    /// nothing comes.
    pub state: String,
    /// Why it is so, as the device's last status says; of a silent device, for how long.
    pub reason: String,
    /// The line and how it is.
    pub line: String,
    /// Seconds since the last frame, where that is longer than usual.
    pub silent_s: Option<f64>,
    /// Seconds of the device's time since its restart; nothing while its rate is not known.
    pub time_s: Option<f64>,
    /// Seconds of the device's time per second, over the last seconds; 1 for a real one.
    pub speed: Option<f64>,
    /// Who the device is, as it has introduced itself.
    pub device: Option<String>,
    /// Its axes, in order.
    pub axes: Vec<AxisPicture>,
    /// Channels, in the device's order.
    pub sensors: Vec<SensorPicture>,
    /// Part of the recent time outside the training range, percent.
    pub outside_percent: Option<f64>,
    /// The alarm that nobody has acknowledged.
    pub alarm: Option<String>,
    /// What was counted: by the device, then of the line.
    pub counters: Vec<Counter>,
}

/// One axis of the joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisPicture {
    /// The axis's name, as the device tells it.
    pub name: String,
    /// The unit of its forces; nothing while it is not known.
    pub unit: String,
    /// The state in a word or two, as in [`Picture::state`], but never `silent`.
    pub state: String,
    /// Why it is so.
    pub reason: String,
    /// Seconds since a block of it was judged last.
    pub age_s: Option<f64>,
    /// Part of the recent time that was judged, percent.
    pub judged_percent: f64,
    /// How far a change of the joint is, percent of its limit; the device tells it from three
    /// quarters of the limit on.
    pub limit_percent: Option<f64>,
    /// NMSE over the last 16 blocks and the last 1024, percent.
    pub nmse_percent: [Option<f64>; 2],
    /// The last forces, measured, predicted and residual.
    pub forces: Option<[f64; 3]>,
}

/// One channel of the rig.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorPicture {
    /// The channel's axis and sensor, in words.
    pub name: String,
    /// What is wrong with it, if anything.
    pub trouble: Option<String>,
}

/// Something that was counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Counter {
    /// What was counted, in words: `messages`, `restarts`, …
    pub what: &'static str,
    /// How often: on the device since its restart or reset, on the line since listening began.
    pub count: u64,
    /// Whether there should be none.
    pub bad: bool,
}

/// Something that happened on the line, on the device or to the joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Happened {
    /// Its number, counted from 1 since the view began.
    pub number: u64,
    /// Seconds of the device's time, where known.
    pub time_s: Option<f64>,
    /// What, in a line.
    pub text: String,
}
