//! Motions with their force channels read later, as a model's delays have it.

use crate::fit::identify::Prepared;
use crate::model::corrections::later;
use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::text::error::Result;
use std::borrow::Cow;

/// The effect that says by how much a force channel is late.
pub(super) const DELAY: &str = "time_delay";

/// By how much a model reads the force of each axis later, s.
///
/// # Errors
/// A model file with a correction that is none.
pub(super) fn delays_of(model: &ModelFile) -> Result<[f64; 2]> {
    Ok(model.corrections()?.force.map(|force| force.delay_s))
}

/// The motions with every force channel read later by so many seconds.
pub(super) fn read_later(prepared: &Prepared, delays_s: [f64; 2]) -> Cow<'_, Prepared> {
    if delays_s == [0.0; 2] {
        return Cow::Borrowed(prepared);
    }
    let mut prepared = prepared.clone();
    for motion in &mut prepared.motions {
        for (axis, delay_s) in delays_s.into_iter().enumerate().take(motion.force.len()) {
            shift(motion, axis, delay_s);
        }
    }
    Cow::Owned(prepared)
}

/// Reads the force channel of an axis later.
pub(super) fn shift(motion: &mut Motion, axis: usize, delay_s: f64) {
    let read = later(&motion.applied_force(axis), delay_s * motion.sample_rate_hz);
    motion.force[axis] = match &motion.ground[axis] {
        None => read,
        Some(ground) => read.iter().zip(ground).map(|(f, g)| f - g).collect(),
    };
}
