//! The effects' part of a blob: eight places of 56 bytes behind the base; the origins of the
//! states, and what effects follow beside them, behind the corrections.

use crate::base::axis::{Axis, Input, InputRange, NAME_LEN, Name};
use crate::base::terms::{MAX_TERMS, StoredTerm, Terms};
use crate::effect::MAX_PARAMETERS;
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
    /// 1 for an effect whose force goes with the square of its input.
    squared: u8,
    reserved: u8,
    /// Of [`Term::follows`](crate::base::terms::Term::follows), one unit of 2⁻³² less; 0 for an
    /// effect of the motion alone.
    follows: u32,
    parameters: [i64; MAX_PARAMETERS],
}
}

/// Writes the effects to the beginning of `bytes`, which are [`LEN`] zeros; gives their number.
pub(super) fn write(terms: &Terms, bytes: &mut [u8]) -> u8 {
    for (place, term) in bytes.chunks_mut(EffectMessage::LEN).zip(terms.list()) {
        let message = EffectMessage {
            tag: term.entry().tag,
            axis: term.axis() as u8,
            squared: u8::from(term.squared()),
            reserved: 0,
            follows: term.follows().map_or(0, |share| (share.raw() - 1) as u32),
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

laid_out! {
/// What effects of an axis follow; all zero where there is no such effect.
struct InputMessage {
    name: [u8; NAME_LEN],
    center: f64,
    half_range: f64,
    origin: i64,
}
}

/// Bytes of what effects follow, on both axes.
pub(super) const INPUTS_LEN: usize = 2 * InputMessage::LEN;
/// Writes what effects follow to the beginning of `bytes`.
pub(super) fn write_inputs(terms: &Terms, axes: &[Axis], bytes: &mut [u8]) {
    let places = bytes.chunks_mut(InputMessage::LEN);
    for ((place, axis), origin) in places.zip(axes).zip(terms.followed_origins()) {
        if let Some(input) = &axis.input {
            let message = InputMessage {
                name: input.name.bytes,
                center: input.range.center,
                half_range: input.range.half_range,
                origin: origin.raw(),
            };
            message.write(&mut Writer::new(place));
        }
    }
}

/// What effects of each axis follow, of so many axes, and its origin, in bytes that begin there in
/// the blob; what it holds is checked with the model.
pub(super) fn read_inputs(
    axes: u8,
    begin: usize,
    bytes: &[u8; INPUTS_LEN],
) -> Result<([Option<Input>; 2], [Q; 2]), Error> {
    let (mut inputs, mut origins) = ([None; 2], [Q::default(); 2]);
    let places = (0_u8..).zip(bytes.chunks(InputMessage::LEN));
    for ((number, place), (input, origin)) in places.zip(inputs.iter_mut().zip(&mut origins)) {
        let offset = begin + usize::from(number) * InputMessage::LEN;
        let message = InputMessage::read(&mut Reader::new(place));
        if number >= axes || message.name == [0; NAME_LEN] {
            unless_zero(offset, place)?;
            continue;
        }
        *input = Some(Input {
            name: Name::from_bytes(number, message.name)?,
            range: InputRange {
                center: message.center,
                half_range: message.half_range,
            },
        });
        *origin = Q::from_raw(message.origin);
    }
    Ok((inputs, origins))
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
    followed_origins: [Q; 2],
) -> Result<Terms, Error> {
    let mut checks = Checks::new();
    checks.whole("number of effects", i32::from(count), 0, MAX_TERMS as i32);
    checks.done()?;
    let count = usize::from(count);
    let mut stored: heapless::Vec<StoredTerm, MAX_TERMS> = heapless::Vec::new();
    for (number, place) in bytes.chunks(EffectMessage::LEN).enumerate() {
        let offset = OFFSET + number * EffectMessage::LEN;
        if number >= count {
            unless_zero(offset, place)?;
            continue;
        }
        let message = EffectMessage::read(&mut Reader::new(place));
        unless_zero(offset + 2, &[message.squared & !1, message.reserved])?;
        // As many places as the list holds.
        let _ = stored.push(StoredTerm {
            tag: message.tag,
            axis: message.axis,
            squared: message.squared != 0,
            follows: message.follows,
            parameters: message.parameters.map(Q::from_raw),
        });
    }
    let origins = OriginsMessage::read(&mut Reader::new(origins)).origins;
    // Not by value: the list's own iterator would bring a path to a panic into the flashed image.
    Terms::stored(
        usize::from(axes),
        stored.iter().copied(),
        origins.map(Q::from_raw),
        followed_origins,
    )
}
