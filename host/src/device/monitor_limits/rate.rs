//! How long a block is, and how often a residual in the band has to come for it.

use crate::signal::every::every_log2;
use crate::signal::filters::Filters;
use jointwatch_shared::monitor::limits::{BLOCK, MIN_VALUES};
use jointwatch_shared::wire::rig::MAX_BAND_EVERY_LOG2;

/// How long a block lasts, s: some periods of what moves a joint, and some ten of them within the
/// time to an alarm.
const BLOCK_S: f64 = 0.064;
/// Binary logarithm of the samples from one residual in the band to the next on the device
/// ([`every_log2`]): as many as the band allows, and not so many that a block of the monitor would
/// sum up too few of them.
pub(crate) fn band_every_log2(filters: &Filters) -> u8 {
    let of_block = i32::from(block(filters.sample_rate_hz)) / MIN_VALUES;
    let most = (of_block.max(1).ilog2() as u8).min(MAX_BAND_EVERY_LOG2);
    every_log2(&filters.band, filters.sample_rate_hz, filters.band_hz, most)
}

/// The power of two nearest to [`BLOCK_S`], within [`BLOCK`].
pub(super) fn block(sample_rate_hz: f64) -> u16 {
    let [least, most] = BLOCK;
    let exponent = (BLOCK_S * sample_rate_hz).log2().round();
    (exponent.exp2() as u16).clamp(least, most)
}
