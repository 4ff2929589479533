//! What a device streamed, or kept around an alarm, as records and a study that the other commands
//! take.

mod frames;
mod write;
mod written;

pub use written::{StudyFrom, Written};

use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::wire::rig::Rig;
use std::path::Path;

/// Writes the folder `out`, which must not hold anything yet, from the frames in `bytes`. `rig` is
/// the block that the device runs with, whose skews are taken off the channels, and `model` the
/// blob, whose corrections of the force channels' gain and lateness the block contains and the
/// records must not.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when there are no frames, none with counts, or frames of a
/// device with another rig block; [`crate::text::error::Kind::Failed`] when the folder is not empty
/// or cannot be written.
pub fn write(
    (file, bytes): (&Path, &[u8]),
    rig: &Rig,
    model: Option<&Model>,
    out: &Path,
) -> Result<StudyFrom> {
    let wrong = |what: String| Error::data(format!("{}: {what}", file.display()));
    let heard = frames::read(bytes, rig).map_err(wrong)?;
    let mut rig = rig.clone();
    for (axis, correction) in rig
        .axes
        .iter_mut()
        .zip(model.into_iter().flat_map(Model::corrections))
    {
        axis.force_step /= 1.0 - correction.excess;
        axis.force_delay_samples -= correction.delay_s * rig.sample_rate_hz;
    }
    write::study(&heard, &rig, model.is_some(), out)
}
