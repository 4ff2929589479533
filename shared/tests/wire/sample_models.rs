//! Models to write as blobs: a different value in every field, so that no two fields can be taken
//! for each other.

use jointwatch_shared::base::axis::{
    Axis, AxisKind, Convention, Input, InputRange, Name, Validation,
};
use jointwatch_shared::base::corrections::ForceCorrection;
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::base::terms::{EffectValues, MAX_TERMS};
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::effect::{Acts, EFFECTS, Entry, Subsystem};
use jointwatch_shared::selftest::Points;
use jointwatch_shared::wire::blob::{BLOB_LEN, CHECKSUM_OFFSET};

/// A header with a different value in every field.
pub(crate) fn header(axes: usize) -> Header {
    let axis = |number: u8| Axis {
        name: Name::new(number, ["x", "phi"][usize::from(number)]).unwrap(),
        kind: [AxisKind::Translation, AxisKind::Rotation][usize::from(number)],
        convention: [Convention::InertiaMinusForce, Convention::ForceMinusInertia]
            [usize::from(number)],
        inertia: 1.6947 + f64::from(number),
        displacement: InputRange {
            center: -1e-5 + f64::from(number),
            half_range: 2.5e-3 + f64::from(number),
        },
        velocity: InputRange {
            center: 1e-4 + f64::from(number),
            half_range: 0.3 + f64::from(number),
        },
        input: Some(Input {
            name: Name::new(number, "voltage").unwrap(),
            range: InputRange {
                center: 2.0 + f64::from(number),
                half_range: 3.0,
            },
        }),
        validation: (number == 0).then_some(Validation {
            nmse_percent: 1.4,
            relative_error: 0.12,
        }),
    };
    Header {
        sample_rate_hz: 2000.0,
        band_hz: 120.0,
        state_band_hz: 400.0,
        axes: (0..axes as u8).map(axis).collect(),
    }
}

/// A polynomial with a different value in every field.
pub(crate) fn polynomial(axes: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let coefficients: Vec<Vec<f64>> = (0..axes)
        .map(|_| {
            (0..16_u32.pow(axes as u32))
                .map(|_| f64::from(points.next_word()) * 1e-8)
                .collect()
        })
        .collect();
    let slices: Vec<&[f64]> = coefficients.iter().map(Vec::as_slice).collect();
    let model = Model::from_polynomial(header(axes), &[3; 4][..2 * axes], &slices, &[1e-4; 2]);
    corrected(model.unwrap())
}

/// The model for a rig whose force channels are wrong in every way that its number of axes allows.
fn corrected(model: Model) -> Model {
    let wrong = |axis: usize| ForceCorrection {
        excess: 0.03 - 0.1 * axis as f64,
        cross: if model.axes() == 2 {
            0.25 + axis as f64
        } else {
            0.0
        },
        delay_s: 8e-4 - 1e-3 * axis as f64,
        hum: Hum {
            frequency_hz: 50.0 + axis as f64,
            amplitude: 0.3,
        },
    };
    let second = if model.axes() == 2 {
        wrong(1)
    } else {
        ForceCorrection::NONE
    };
    let corrections = [wrong(0), second];
    model.correcting(corrections).unwrap()
}

/// A network with a different value in every field, of weights of up to 2 and forces of up to some
/// hundred newtons.
pub(crate) fn network(axes: usize, neurons: usize, seed: u64) -> Model {
    let mut points = Points::new(seed);
    let mut draw = |count: usize, size: f64| -> Vec<f64> {
        let unit = |word| size * f64::from(word) / 2_f64.powi(31);
        (0..count).map(|_| unit(points.next_word())).collect()
    };
    let hidden = draw(2 * axes * neurons, 2.0);
    let hidden_bias = draw(neurons, 2.0);
    let output: Vec<Vec<f64>> = (0..axes).map(|_| draw(neurons, 37.0)).collect();
    let output: Vec<&[f64]> = output.iter().map(Vec::as_slice).collect();
    let weights = Weights {
        hidden: &hidden,
        hidden_bias: &hidden_bias,
        output: &output,
        output_bias: &draw(axes, 11.0),
    };
    Model::from_network(header(axes), &weights, &[1e-4; 2]).unwrap()
}

/// The largest tag of an effect in these models.
const LAST_SAMPLED: u8 = 18;

/// Effects with a different value in every parameter: as many of the table as act on these axes and
/// a blob holds.
pub(crate) fn effects(axes: usize, seed: u64) -> Vec<EffectValues> {
    let mut points = Points::new(seed);
    // The first ones, so that new effects change no sample.
    let known = EFFECTS.iter().rev();
    let known = known.filter(|e| e.subsystem == Subsystem::Plant && e.tag <= LAST_SAMPLED);
    let allowed = known.filter(|entry| axes == 2 || !entry.needs_two_axes());
    let term = |(number, entry): (usize, &'static Entry)| EffectValues {
        // One effect in three, one of them without a lag.
        input: match number % 6 {
            1 if entry.acts == Acts::OwnAxis => Some("voltage~12.5ms"),
            4 if entry.acts == Acts::OwnAxis => Some("voltage^2"),
            _ => None,
        },
        entry,
        axis: match entry.acts {
            Acts::OwnAxis => (number % axes) as u8,
            Acts::BothAxes => 0,
        },
        values: (0..entry.parameters().len())
            .map(|_| 0.02 + f64::from(points.next_word()).abs() / 2_f64.powi(31))
            .collect(),
    };
    allowed.enumerate().take(MAX_TERMS).map(term).collect()
}

/// A model with effects beside its base.
pub(crate) fn with_effects(base: Model, seed: u64) -> Model {
    let terms = effects(base.axes(), seed);
    base.adding_effects(&terms, &[]).unwrap()
}

/// A model of effects alone.
pub(crate) fn physical(axes: usize, seed: u64) -> Model {
    Model::from_effects(header(axes), &effects(axes, seed), &[]).unwrap()
}

/// The blob with its checksum made right, by a CRC-32 of its own.
pub(crate) fn sealed(mut blob: [u8; BLOB_LEN]) -> [u8; BLOB_LEN] {
    let mut crc = u32::MAX;
    for &byte in &blob[..CHECKSUM_OFFSET] {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
        }
    }
    blob[CHECKSUM_OFFSET..].copy_from_slice(&(!crc).to_le_bytes());
    blob
}
