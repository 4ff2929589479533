//! How often the chips of a board give a value.

use crate::text::error::{Error, Result};
use jointwatch_shared::wire::rig::Rig;

/// ADS131M04: its clock over twice the least oversampling, 128, Hz.
const CONVERSIONS_HZ: f64 = 32_000.0;
/// ADXL355: results per second without filter.
const RESULTS_HZ: f64 = 4000.0;

/// Refuses chips that give less often than they are asked: they would be taken for silent.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] naming the chip and what to change.
pub(crate) fn check(block: &Rig) -> Result<()> {
    let rate = block.sample_rate_hz;
    let refuse = |what: &str, hz: f64, advice: &str| {
        Err(Error::data(format!(
            "the {what} gives {hz} samples per second and is asked for {rate}: {advice} in rig.toml"
        )))
    };
    let conversions = CONVERSIONS_HZ / f64::from(1_u32 << block.wiring.converter.oversampling);
    if conversions < rate {
        return refuse("bridges' converter", conversions, "lower its oversampling");
    }
    for chip in block.wiring.accelerometers.iter().flatten() {
        let results = RESULTS_HZ / f64::from(1_u32 << chip.filter);
        if results < rate {
            return refuse("accelerometer", results, "raise its corner_hz");
        }
    }
    Ok(())
}
