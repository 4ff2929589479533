//! The keys of `rig.toml`.

use crate::study::description::Source;
use crate::text::error::Result;
use serde::Deserialize;
use std::fmt::Display;
use toml::Spanned;

/// Every key of rig.toml.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RigFile {
    pub(super) wiring: WiringEntry,
    #[serde(default)]
    pub(super) axis: Vec<AxisEntry>,
}

/// `[wiring]`: how the chips are set.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WiringEntry {
    /// Of the converter: 128, 256, … 16384.
    pub(super) oversampling: Spanned<u32>,
    /// In the order of the counters' chip selects.
    pub(super) counters: Spanned<Vec<CounterEntry>>,
    #[serde(default)]
    pub(super) accelerometers: Vec<AccelerometerEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CounterEntry {
    #[serde(default = "yes")]
    pub(super) fitted: bool,
    pub(super) quadrature: Option<Spanned<u8>>,
    #[serde(default)]
    pub(super) start: i32,
    #[serde(default)]
    pub(super) index: bool,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AccelerometerEntry {
    #[serde(default = "yes")]
    pub(super) fitted: bool,
    pub(super) range_g: Spanned<u8>,
    pub(super) corner_hz: Spanned<f64>,
    #[serde(default)]
    pub(super) external_sync: bool,
}

/// `[[axis]]`, in any order.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisEntry {
    pub(super) name: Spanned<String>,
    /// Counters as "+0" or "-1".
    pub(super) far: Spanned<String>,
    pub(super) near: Option<Spanned<String>>,
    pub(super) body: Option<Spanned<String>>,
    pub(super) counts_per_m: Option<Spanned<f64>>,
    pub(super) counts_per_rev: Option<Spanned<f64>>,
    /// Converter channel, as the counters.
    pub(super) bridge: Spanned<String>,
    pub(super) gain: Spanned<u32>,
    /// N or N·m per V/V.
    pub(super) sensitivity: Spanned<f64>,
    #[serde(rename = "excitation_V")]
    pub(super) excitation_v: Spanned<f64>,
    /// What effects of the axis follow.
    pub(super) input: Option<InputEntry>,
    /// "+0x": accelerometer and direction.
    #[serde(default)]
    pub(super) acceleration: Option<Spanned<Vec<String>>>,
    pub(super) pair_distance_m: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) ground_stiffness: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) ground_damping: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) skew_us: Skew,
}

/// What effects of an axis follow: a voltage at the converter, in the unit of the study.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputEntry {
    /// Converter channel, as the counters.
    pub(super) channel: Spanned<String>,
    pub(super) gain: Spanned<u32>,
    /// The input per volt at the converter.
    #[serde(rename = "per_V")]
    pub(super) per_v: Spanned<f64>,
    /// The input at 0 V there.
    #[serde(rename = "at_0_V", default)]
    pub(super) at_0_v: f64,
}

/// By how many microseconds a channel is late; negative when it is early.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Skew {
    pub(super) displacement: f64,
    pub(super) body: f64,
    pub(super) acceleration: f64,
    pub(super) force: f64,
    /// As `force` where it is left out, for all channels of the converter sample together.
    pub(super) input: Option<f64>,
}

/// A number above 0.
pub(super) fn positive(source: &Source<'_>, key: &str, stated: &Spanned<f64>) -> Result<f64> {
    bounded(source, key, stated, f64::MIN_POSITIVE, "has to be above 0")
}

/// A number that is not below `least`.
pub(super) fn bounded(
    source: &Source<'_>,
    key: &str,
    stated: &Spanned<f64>,
    least: f64,
    what: impl Display,
) -> Result<f64> {
    let value = *stated.get_ref();
    if value.is_finite() && value >= least {
        return Ok(value);
    }
    Err(source.wrong(
        stated,
        format!("{key} = {value} {what}; put the number right"),
    ))
}
