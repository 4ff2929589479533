//! The effects' part of a blob: eight places of 56 bytes behind the base, and the origins of the inputs behind the corrections.

use crate::base::terms::{MAX_TERMS, Terms};
use crate::effect::{MAX_PARAMETERS, Parameters};
use crate::fault::{Checks, Error};
use crate::scalar::q::Q;
use crate::wire::layout::{Field, Reader, Writer, laid_out, unless_zero};

/// Where the effects begin.
pub(super) const OFFSET: usize = super::base::OFFSET + super::base::LEN;
/// Bytes of all places.
pub(super) const LEN: usize = MAX_TERMS * EffectMessage::LEN;

laid_out! {
/// One effect; all zero where there is none.
#[derive(Clone, Copy)]
struct EffectMessage {
    tag: u8,
    axis: u8,
    reserved: [u8; 6],
    parameters: [i64; MAX_PARAMETERS],
}
}

/// Writes the effects to the beginning of `bytes`, which are [`LEN`] zeros; gives their number.
pub(super) fn write(terms: &Terms, bytes: &mut [u8]) -> u8 {
    for (place, term) in bytes.chunks_mut(EffectMessage::LEN).zip(terms.list()) {
        let message = EffectMessage {
            tag: term.entry().tag,
            axis: term.axis() as u8,
            reserved: [0; 6],
            parameters: term.parameters().map(|value| value.raw()),
        };
        message.write(&mut Writer::new(place));
    }
    terms.list().len() as u8
}

laid_out! {
/// What effects add to their inputs; all zero without effects.
struct OriginsMessage {
    origins: [i64; 4],
}
}

/// Bytes of the origins.
pub(super) const ORIGINS_LEN: usize = OriginsMessage::LEN;

/// Writes the origins to the beginning of `bytes`.
pub(super) fn write_origins(terms: &Terms, bytes: &mut [u8]) {
    let origins = terms.origins().map(|origin| origin.raw());
    OriginsMessage { origins }.write(&mut Writer::new(bytes));
}

/// The effects in `bytes`, of which the header states `count`, of a model of so many axes.
pub(super) fn read(
    axes: u8,
    count: u8,
    bytes: &[u8; LEN],
    origins: &[u8; ORIGINS_LEN],
) -> Result<Terms, Error> {
    let mut checks = Checks::new();
    checks.whole("number of effects", i32::from(count), 0, MAX_TERMS as i32);
    checks.done()?;
    let count = usize::from(count);
    let mut stored: heapless::Vec<(u8, u8, Parameters<Q>), MAX_TERMS> = heapless::Vec::new();
    for (number, place) in bytes.chunks(EffectMessage::LEN).enumerate() {
        let offset = OFFSET + number * EffectMessage::LEN;
        if number >= count {
            unless_zero(offset, place)?;
            continue;
        }
        let message = EffectMessage::read(&mut Reader::new(place));
        unless_zero(offset + 2, &message.reserved)?;
        let parameters = message.parameters.map(Q::from_raw);
        // As many places as the list holds.
        let _ = stored.push((message.tag, message.axis, parameters));
    }
    let origins = OriginsMessage::read(&mut Reader::new(origins)).origins;
    // Not by value: the list's own iterator would bring a path to a panic into the flashed image.
    Terms::stored(
        usize::from(axes),
        stored.iter().copied(),
        origins.map(Q::from_raw),
    )
}
