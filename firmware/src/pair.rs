//! Whether a rig block can go with a model: asked before an upload is sealed, and again when it is to run.

use crate::clock::Rate;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::Chain;
use jointwatch_shared::fault::Error;
use jointwatch_shared::monitor::Monitor;
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block::{self, Refusal};
use jointwatch_shared::wire::telemetry::ModelFault;

/// Why a rig block cannot go with a model.
pub(crate) enum Unfit {
    /// It is no rig block that this device can use.
    Refused(Refusal),
    /// It is one, for another model.
    Mismatch,
}

/// A rig block that was made for the model of this checksum, and its sample rate.
///
/// # Errors
/// [`Unfit`], whichever comes first.
pub(crate) fn read(bytes: &[u8], model: &Model, checksum: u32) -> Result<(Rig, Rate), Unfit> {
    let rig = rig_block::decode(bytes).map_err(Unfit::Refused)?;
    let rate = Rate {
        hz: rig.sample_rate_hz,
        uhz: rig.sample_rate_uhz(),
    };
    let [least, most] = Rate::UHZ;
    if !(least..=most).contains(&rate.uhz) {
        return Err(Unfit::Refused(Refusal::Value(Error::OutOfRange {
            quantity: "sample rate of the rig in 10⁻⁶ Hz",
            seen: rate.uhz as f64,
            least: least as f64,
            most: most as f64,
        })));
    }
    if rig.model_checksum != checksum || rig.axes.len() != model.axes() {
        return Err(Unfit::Mismatch);
    }
    Ok((rig, rate))
}

/// Whether everything that the start makes of a model and a rig block can be made.
///
/// Not inlined: what is made here is on the stack only meanwhile.
///
/// # Errors
/// [`Unfit`]: with [`Unfit::Mismatch`] also when a quantity of the two lies outside the device's integers.
#[inline(never)]
pub(crate) fn check(bytes: &[u8], model: &Model, checksum: u32) -> Result<(), Unfit> {
    let (rig, _) = read(bytes, model, checksum)?;
    let chain = Chain::new(model, &rig).map_err(|_| Unfit::Mismatch)?;
    match rig.limits {
        Some(limits) if limits.model_checksum == checksum => Monitor::new(limits, &chain)
            .map(|_| ())
            .map_err(|_| Unfit::Mismatch),
        _ => Ok(()),
    }
}

/// What is told of a rig block that cannot be used.
pub(crate) fn fault(why: &Refusal) -> ModelFault {
    match why {
        Refusal::Length { .. } => ModelFault::Length,
        Refusal::Magic { .. } => ModelFault::Magic,
        Refusal::Version { .. } => ModelFault::Version,
        Refusal::Checksum { .. } => ModelFault::Checksum,
        Refusal::Message | Refusal::Form => ModelFault::Field,
        Refusal::Reserved { .. } => ModelFault::Reserved,
        Refusal::Value(why) => ModelFault::from(why),
        _ => ModelFault::Other,
    }
}
