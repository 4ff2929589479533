//! The corrections' part of a blob: five numbers per force channel behind the effects, all zero
//! where nothing is wrong.

use crate::base::corrections::ForceCorrection;
use crate::base::hum::Hum;
use crate::fault::Error;
use crate::wire::layout::{Field, Reader, Writer, laid_out, unless_zero};

/// Where the corrections begin.
pub(super) const OFFSET: usize = super::effects::OFFSET + super::effects::LEN;
/// Bytes of both channels.
pub(super) const LEN: usize = 2 * CorrectionMessage::LEN;

laid_out! {
/// What is wrong with one force channel, in the order of its bytes.
#[derive(Clone, Copy)]
struct CorrectionMessage {
    excess: f64,
    cross: f64,
    delay_s: f64,
    hum_hz: f64,
    hum_amplitude: f64,
}
}

/// Writes the corrections to the beginning of `bytes`, which are [`LEN`] zeros.
pub(super) fn write(corrections: &[ForceCorrection; 2], bytes: &mut [u8]) {
    for (place, correction) in bytes.chunks_mut(CorrectionMessage::LEN).zip(corrections) {
        let message = CorrectionMessage {
            excess: correction.excess,
            cross: correction.cross,
            delay_s: correction.delay_s,
            hum_hz: correction.hum.frequency_hz,
            hum_amplitude: correction.hum.amplitude,
        };
        message.write(&mut Writer::new(place));
    }
}

/// The corrections in `bytes`, for a model of so many axes; what they hold is checked with the
/// model.
pub(super) fn read(axes: u8, bytes: &[u8; LEN]) -> Result<[ForceCorrection; 2], Error> {
    let mut corrections = [ForceCorrection::NONE; 2];
    let places = bytes.chunks(CorrectionMessage::LEN).enumerate();
    for (correction, (number, place)) in corrections.iter_mut().zip(places) {
        let offset = OFFSET + number * CorrectionMessage::LEN;
        if number >= usize::from(axes) {
            unless_zero(offset, place)?;
            continue;
        }
        let message = CorrectionMessage::read(&mut Reader::new(place));
        *correction = ForceCorrection {
            excess: message.excess,
            cross: message.cross,
            delay_s: message.delay_s,
            hum: Hum {
                frequency_hz: message.hum_hz,
                amplitude: message.hum_amplitude,
            },
        };
    }
    Ok(corrections)
}
