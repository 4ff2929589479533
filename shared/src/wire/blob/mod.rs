//! The model as bytes: 4096 of them, the same layout in a file, on the wire and in a flash slot.
//!
//! The blob is a postcard message in which every number has a fixed width, little-endian, so each
//! field has a fixed place; zeros follow, and a CRC-32 over all of it ends it.
//! `docs/reference/blob.md` lists every byte. Decoding refuses whatever it cannot prove: a decoded
//! [`Model`] evaluates without overflow for every input.

mod base;
mod corrections;
mod effects;

use crate::base::axis::{
    Axis, AxisKind, Convention, Input, InputRange, NAME_LEN, Name, Validation,
};
use crate::base::{Header, Model, Output};
use crate::fault::{Checks, Error};
use crate::wire::layout::{Field, Reader, Writer, laid_out, unless_zero};
use base::BaseHeader;
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec;

/// Bytes of a blob.
pub const BLOB_LEN: usize = 4096;
/// The format version that this program writes and reads.
pub const BLOB_VERSION: u16 = 3;
/// The first four bytes.
pub const BLOB_MAGIC: [u8; 4] = *b"JWMB";
/// Bytes of header, base, effects, corrections, origins and inputs; what follows up to the checksum
/// is zero.
pub const MESSAGE_LEN: usize = INPUTS_OFFSET + effects::INPUTS_LEN;
/// Where the checksum stands.
pub const CHECKSUM_OFFSET: usize = BLOB_LEN - 4;

/// Where stands what effects follow.
const INPUTS_OFFSET: usize = corrections::OFFSET + corrections::LEN + effects::ORIGINS_LEN;

/// Where the first axis begins.
const AXES_OFFSET: usize = 40;

/// CRC-32 as in Ethernet and zip; the table takes 1 KiB of flash and makes a 4 KiB blob cheap
/// enough for a boot. Telemetry's frames have the same one.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

laid_out! {
/// What the bytes before the base say, before any of it is believed.
struct Message {
    magic: [u8; 4],
    version: u16,
    base: u8,
    axes: u8,
    sample_rate_hz: f64,
    band_hz: f64,
    state_band_hz: f64,
    orders: [u8; 4],
    shifts: [u8; 2],
    effects: u8,
    base_shifts: u8,
    axis: [AxisMessage; 2],
}
}

laid_out! {
/// One axis, as the bytes say; all zero for the second of a one-axis model.
#[derive(Clone, Copy)]
struct AxisMessage {
    name: [u8; NAME_LEN],
    kind: u8,
    convention: u8,
    validated: u8,
    reserved: [u8; 5],
    inertia: f64,
    displacement_center: f64,
    displacement_half_range: f64,
    velocity_center: f64,
    velocity_half_range: f64,
    force_per_lsb: f64,
    error_bound: f64,
    nmse_percent: f32,
    relative_error: f32,
}
}

/// The blob of a model.
pub fn encode(model: &Model) -> [u8; BLOB_LEN] {
    let mut blob = [0; BLOB_LEN];
    let (header, rest) = blob.split_at_mut(base::OFFSET);
    let (base, rest) = rest.split_at_mut(base::LEN);
    let (terms, rest) = rest.split_at_mut(effects::LEN);
    let effects = effects::write(&model.terms, terms);
    let (corrections, rest) = rest.split_at_mut(corrections::LEN);
    corrections::write(&model.corrections, corrections);
    let (origins, rest) = rest.split_at_mut(effects::ORIGINS_LEN);
    effects::write_origins(&model.terms, origins);
    effects::write_inputs(&model.terms, &model.header.axes, rest);
    Message::of(model, effects).write(&mut Writer::new(header));
    base::write(&model.base, base);
    let checksum = CRC.checksum(blob.get(..CHECKSUM_OFFSET).unwrap_or_default());
    if let Some(place) = blob.last_chunk_mut() {
        *place = checksum.to_le_bytes();
    }
    blob
}

/// The checksum that stands at a blob's end, by which one model is told from another.
pub fn checksum(blob: &[u8; BLOB_LEN]) -> u32 {
    blob.last_chunk().copied().map_or(0, u32::from_le_bytes)
}

/// The checksum that ends the blob of a model.
pub fn checksum_of(model: &Model) -> u32 {
    checksum(&encode(model))
}

/// The model of a blob, checked in every respect.
///
/// # Errors
/// [`Error`] says what was seen and what was wanted: length, magic, version and checksum first, in
/// this order, then each field, then the sums that the stored words could drive to overflow.
pub fn decode(blob: &[u8]) -> Result<Model, Error> {
    let wrong_length = Error::BlobLength {
        seen: blob.len(),
        wanted: BLOB_LEN,
    };
    let blob: &[u8; BLOB_LEN] = blob.try_into().map_err(|_| wrong_length)?;
    let (content, &checksum) = blob.split_last_chunk::<4>().ok_or(wrong_length)?;
    let (&magic, rest) = content.split_first_chunk::<4>().ok_or(wrong_length)?;
    if magic != BLOB_MAGIC {
        return Err(Error::BlobMagic { seen: magic });
    }
    let (&version, _) = rest.split_first_chunk::<2>().ok_or(wrong_length)?;
    let version = u16::from_le_bytes(version);
    if version != BLOB_VERSION {
        return Err(Error::BlobVersion {
            seen: version,
            wanted: BLOB_VERSION,
        });
    }
    let (seen, wanted) = (u32::from_le_bytes(checksum), CRC.checksum(content));
    if seen != wanted {
        return Err(Error::BlobChecksum { seen, wanted });
    }
    let (header, rest) = content
        .split_first_chunk::<{ base::OFFSET }>()
        .ok_or(wrong_length)?;
    let message = Message::read(&mut Reader::new(header));
    let (base, rest) = rest.split_first_chunk().ok_or(wrong_length)?;
    let (effects, rest) = rest.split_first_chunk().ok_or(wrong_length)?;
    let (corrections, rest) = rest.split_first_chunk().ok_or(wrong_length)?;
    let (origins, rest) = rest.split_first_chunk().ok_or(wrong_length)?;
    let (inputs, padding) = rest.split_first_chunk().ok_or(wrong_length)?;
    unless_zero(MESSAGE_LEN, padding)?;
    let corrections = corrections::read(message.axes, corrections)?;
    message
        .model(header, base, effects, origins, inputs)?
        .correcting(corrections)
}

impl Message {
    fn of(model: &Model, effects: u8) -> Self {
        let [first, second] = model.base_shifts;
        let mut axis = [AxisMessage::EMPTY; 2];
        let known = model.header.axes.iter().zip(&model.outputs);
        for (place, (header, output)) in axis.iter_mut().zip(known) {
            *place = AxisMessage::of(header, output);
        }
        let base = base::header(&model.base);
        Self {
            magic: BLOB_MAGIC,
            version: BLOB_VERSION,
            base: base.tag,
            axes: base.axes,
            sample_rate_hz: model.header.sample_rate_hz,
            band_hz: model.header.band_hz,
            state_band_hz: model.header.state_band_hz,
            orders: base.orders,
            shifts: base.shifts,
            effects,
            base_shifts: first | second << 4,
            axis,
        }
    }

    /// The model without corrections; `header` are this message's own bytes.
    fn model(
        &self,
        header: &[u8; base::OFFSET],
        base: &[u8; base::LEN],
        effects: &[u8; effects::LEN],
        origins: &[u8; effects::ORIGINS_LEN],
        inputs: &[u8; effects::INPUTS_LEN],
    ) -> Result<Model, Error> {
        let of_base = BaseHeader {
            tag: self.base,
            axes: self.axes,
            orders: self.orders,
            shifts: self.shifts,
        };
        let base = base::read(of_base, base)?;
        let (inputs, followed_origins) = effects::read_inputs(self.axes, INPUTS_OFFSET, inputs)?;
        let mut axes = Vec::new();
        let mut outputs = Vec::new();
        for (number, axis) in (0..self.axes).zip(&self.axis) {
            // Both hold two, and so does the array that is walked.
            let input = inputs.get(usize::from(number)).copied().flatten();
            let _ = axes.push(axis.axis(number, input)?);
            let _ = outputs.push(axis.output());
        }
        let mut checks = Checks::new();
        checks.whole("number of axes", i32::from(self.axes), 1, 2);
        checks.done()?;
        if self.axes == 1 {
            let offset = AXES_OFFSET + AxisMessage::LEN;
            unless_zero(offset, header.get(offset..).unwrap_or_default())?;
        }
        let about = Header {
            sample_rate_hz: self.sample_rate_hz,
            band_hz: self.band_hz,
            state_band_hz: self.state_band_hz,
            axes,
        };
        let terms = effects::read(self.axes, self.effects, effects, origins, followed_origins)?;
        let base_shifts = [self.base_shifts & 15, self.base_shifts >> 4];
        Model::with_effects(about, outputs, base, base_shifts, terms)
    }
}

impl AxisMessage {
    const EMPTY: Self = Self {
        name: [0; NAME_LEN],
        kind: 0,
        convention: 0,
        validated: 0,
        reserved: [0; 5],
        inertia: 0.0,
        displacement_center: 0.0,
        displacement_half_range: 0.0,
        velocity_center: 0.0,
        velocity_half_range: 0.0,
        force_per_lsb: 0.0,
        error_bound: 0.0,
        nmse_percent: 0.0,
        relative_error: 0.0,
    };

    fn of(axis: &Axis, output: &Output) -> Self {
        let validation = axis.validation.unwrap_or(Validation {
            nmse_percent: 0.0,
            relative_error: 0.0,
        });
        Self {
            name: axis.name.bytes,
            kind: axis.kind as u8,
            convention: axis.convention as u8,
            validated: u8::from(axis.validation.is_some()),
            reserved: [0; 5],
            inertia: axis.inertia,
            displacement_center: axis.displacement.center,
            displacement_half_range: axis.displacement.half_range,
            velocity_center: axis.velocity.center,
            velocity_half_range: axis.velocity.half_range,
            force_per_lsb: output.force_per_lsb,
            error_bound: output.error_bound,
            nmse_percent: validation.nmse_percent,
            relative_error: validation.relative_error,
        }
    }

    fn output(&self) -> Output {
        Output {
            force_per_lsb: self.force_per_lsb,
            error_bound: self.error_bound,
        }
    }

    /// The axis with this number; what it holds is checked with the model that it becomes part of.
    fn axis(&self, number: u8, input: Option<Input>) -> Result<Axis, Error> {
        unless_zero(
            AXES_OFFSET + usize::from(number) * Self::LEN + 19,
            &self.reserved,
        )?;
        let unknown = |field, seen| Err(Error::BlobField { field, seen });
        let validation = Validation {
            nmse_percent: self.nmse_percent,
            relative_error: self.relative_error,
        };
        let unmeasured = self.nmse_percent.to_bits() == 0 && self.relative_error.to_bits() == 0;
        Ok(Axis {
            name: Name::from_bytes(number, self.name)?,
            kind: match self.kind {
                0 => AxisKind::Translation,
                1 => AxisKind::Rotation,
                seen => return unknown("kind of axis", seen),
            },
            convention: match self.convention {
                0 => Convention::ForceMinusInertia,
                1 => Convention::InertiaMinusForce,
                seen => return unknown("sign convention", seen),
            },
            inertia: self.inertia,
            displacement: InputRange {
                center: self.displacement_center,
                half_range: self.displacement_half_range,
            },
            velocity: InputRange {
                center: self.velocity_center,
                half_range: self.velocity_half_range,
            },
            input,
            validation: match self.validated {
                0 if unmeasured => None,
                1 => Some(validation),
                seen => return unknown("mark of a validated axis", seen),
            },
        })
    }
}

const _: () = {
    assert!(Message::LEN == base::OFFSET && AXES_OFFSET + 2 * AxisMessage::LEN == base::OFFSET);
};
