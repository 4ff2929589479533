//! Whether a rig block can go with a model: asked before an upload is sealed, and again when it is
//! to run.

use crate::clock::Rate;
use jointwatch_shared::base::Model;
use jointwatch_shared::fault::Error;
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block::{self, Refusal};
use jointwatch_shared::wire::telemetry::{Event, ModelFault};

/// Why a rig block cannot go with a model.
pub(crate) enum Unfit {
    /// It is no rig block that this device can use.
    Refused(Refusal),
    /// It is one, for another model.
    Mismatch,
}

impl Unfit {
    /// What is told of it.
    pub(crate) fn event(&self) -> Event {
        match self {
            Self::Refused(why) => Event::RigRefused { fault: fault(why) },
            Self::Mismatch => Event::Mismatch,
        }
    }

    /// The same in a fixed phrase, for the log.
    pub(crate) fn phrase(&self) -> &'static str {
        match self {
            Self::Refused(why) => why.phrase(),
            Self::Mismatch => "it is for another model",
        }
    }
}

/// The sample rate of a rig block that was made for the model of this checksum. The block stays
/// where it is: it is large, and the stack is not.
///
/// # Errors
/// [`Unfit`], whichever comes first.
pub(crate) fn rate(rig: &Rig, model: &Model, checksum: u32) -> Result<Rate, Unfit> {
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
    Ok(rate)
}

/// Whether a rig block is undamaged and for the model of this checksum. What the stack has no room
/// for beside an upload, whether its quantities can be used, shows at the start: a trial then ends
/// at once.
///
/// # Errors
/// [`Unfit`], whichever comes first.
pub(crate) fn check(bytes: &[u8], checksum: u32) -> Result<(), Unfit> {
    match rig_block::model_checksum(bytes).map_err(Unfit::Refused)? {
        seen if seen == checksum => Ok(()),
        _ => Err(Unfit::Mismatch),
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
