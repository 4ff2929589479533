//! The rig block: what a device is told about its rig, from a `rig.toml` or from a study's own
//! records, and back in words.

use crate::device::chip_rates;
use crate::device::monitor_limits::{self, Calibration};
use crate::device::plain_rig;
use crate::device::replay::{self, SetUp};
use crate::device::rig_file;
use crate::signal::motion::Filters;
use crate::study::Study;
use crate::study::description::Source;
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::table::Table;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::Chain;
use jointwatch_shared::monitor::limits::{AxisLimits, Cusum, Limits};
use jointwatch_shared::monitor::{Cause, OCTAVE, SHARE, SIDES};
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::{Rig, RigAxis};
use jointwatch_shared::wire::rig_block::{self, RIG_BLOCK_LEN, RIG_BLOCK_MAGIC};
use jointwatch_shared::wire::wiring::{AxisWiring, COUNTERS, Signed, SignedDirection, Wiring};
use std::path::Path;

/// A converter of 24 bits is this much finer than an accelerometer of 20.
const ACCELEROMETER_STEP: f64 = 16.0;

/// The rig that a `rig.toml` describes, with the filters and corrections of a model.
///
/// # Errors
/// [`crate::text::error::Kind::Data`], one sentence with the line, or the quantity that the device
/// cannot hold.
pub fn of_file(path: &Path, model: &Model) -> Result<Rig> {
    let text = input::read_to_string(path).map_err(|e| {
        Error::data(format!(
            "{}: the description of the rig could not be read ({e}); docs/reference/rig-block.md has an example",
            path.display()
        ))
    })?;
    let source = Source::file(path, &text);
    let file: rig_file::RigFile = source.parse("reference/rig-block.md")?;
    let described = rig_file::described(&source, &file, model)?;
    let header = model.header();
    let filters = Filters::for_bands(header.sample_rate_hz, header.band_hz, header.state_band_hz)?;
    let (velocity, acceleration, band) = filters.taps()?;
    let converters = Rig {
        model_checksum: blob::checksum_of(model),
        sample_rate_hz: header.sample_rate_hz,
        wiring: described.wiring,
        axes: described.axes.into_iter().collect(),
        velocity,
        acceleration,
        band,
        band_every_log2: monitor_limits::rate::band_every_log2(&filters),
        limits: None,
    };
    finished(path, &converters, model)
}

/// The rig as `replay` sets it up for a study: steps from the records' ranges, and chips in a plain
/// order. It is what an emulated board is set to, not a real one.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study does not fit the model, or needs more counters
/// than a board has.
pub fn of_study(study: &Study, model: &Model) -> Result<Rig> {
    let header = model.header();
    let filters = Filters::for_bands(study.sample_rate_hz, header.band_hz, header.state_band_hz)?;
    let mut converters = plain_rig::rig(study, model, &filters)?;
    for axis in &mut converters.axes {
        axis.acceleration_step *= ACCELEROMETER_STEP;
    }
    let wired = converters.wiring.axes.iter();
    let mut counters = wired
        .flat_map(|axis| [Some(axis.far), axis.near, axis.body])
        .flatten();
    if counters.any(|counter| usize::from(counter.place) >= COUNTERS) {
        return Err(Error::data(format!(
            "{}: this rig has more than four encoders, and the board four counters; measure a difference as one \
             channel, or leave body_position out",
            study.path.display()
        )));
    }
    finished(&study.path, &converters, model)
}

/// Corrections put in, everything checked, the chain's own check included.
fn finished(path: &Path, converters: &Rig, model: &Model) -> Result<Rig> {
    let mut rig = replay::corrected(converters, model.corrections());
    for (axis, read) in rig.axes.iter_mut().zip(&converters.axes) {
        // The board's own skew, besides what the model knows of the channel.
        axis.force_delay_samples += read.force_delay_samples;
    }
    let refuse = |e: jointwatch_shared::fault::Error| {
        Error::data(format!(
            "{}: the device cannot hold this rig ({e}); check the counts, gains and skews, and their units",
            path.display()
        ))
    };
    rig.check().map_err(refuse)?;
    Chain::new(model, &rig).map_err(refuse)?;
    chip_rates::check(&rig)?;
    Ok(rig)
}

/// Puts the monitor's limits into a block: from the study's validation records, as this board's
/// sensors would count them.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study does not fit the model or the board, or has
/// too little validation.
pub fn set_limits(
    block: &mut Rig,
    study: &Study,
    model: &Model,
    false_alarm_days: u32,
    drift: f64,
) -> Result<Calibration> {
    let set_up = SetUp::of_block(study, model, block)?;
    let purpose = monitor_limits::Purpose {
        model_checksum: blob::checksum_of(model),
        false_alarm_hours: 24 * false_alarm_days,
        drift,
    };
    let calibration = monitor_limits::limits(study, &set_up, model, purpose)?;
    block.limits = Some(calibration.limits.clone());
    block.check().map_err(|e| {
        let path = study.path.display();
        Error::data(format!("{path}: the monitor's limits cannot be held ({e})"))
    })?;
    Ok(calibration)
}

/// The limits by which a device with this block judges a model, or why it does not.
///
/// # Errors
/// [`Cause::NoLimits`] and [`Cause::OtherModel`].
pub fn usable_limits<'a>(block: &'a Rig, model: &Model) -> std::result::Result<&'a Limits, Cause> {
    let limits = block.limits.as_ref().ok_or(Cause::NoLimits)?;
    if limits.model_checksum == blob::checksum_of(model) {
        Ok(limits)
    } else {
        Err(Cause::OtherModel)
    }
}

/// Refuses the bytes of a rig block that cannot be used, or that is not for the model of this blob;
/// of a blob that is no model, nothing is said.
///
/// # Errors
/// [`crate::text::error::Kind::Data`], what is wrong with the block and what to do.
pub fn check_pair(model: &[u8], rig: &[u8]) -> Result<()> {
    let Ok(model) = blob::decode(model) else {
        return Ok(());
    };
    let wrong = |what: &dyn std::fmt::Display| {
        Error::data(format!(
            "the rig block cannot go with this model: {what}; export it again with this model"
        ))
    };
    let block = rig_block::decode(rig).map_err(|e| wrong(&e))?;
    Chain::new(&model, &block).map_err(|e| wrong(&e))?;
    if block.model_checksum == blob::checksum_of(&model) {
        Ok(())
    } else {
        Err(wrong(&"it was made for another one"))
    }
}

/// As [`usable_limits`], for a person.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with the file and what to do.
pub fn limits_for<'a>(path: &Path, block: &'a Rig, model: &Model) -> Result<&'a Limits> {
    usable_limits(block, model).map_err(|cause| {
        Error::data(format!(
            "{}: {}; export the rig block again with this model and --study",
            path.display(),
            cause.words()
        ))
    })
}

/// The checksum that ends a block's bytes.
///
/// # Errors
/// As [`encode`].
pub fn checksum(block: &Rig) -> Result<u32> {
    let bytes = encode(block)?;
    Ok(bytes.last_chunk().copied().map_or(0, u32::from_le_bytes))
}

/// The bytes of a block that was made here.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with the quantity that cannot be held.
pub fn encode(block: &Rig) -> Result<[u8; RIG_BLOCK_LEN]> {
    rig_block::encode(block).map_err(|e| Error::data(format!("this rig cannot be exported: {e}")))
}

/// Whether these bytes begin like a rig block.
pub fn begins_like_one(bytes: &[u8]) -> bool {
    bytes.starts_with(&RIG_BLOCK_MAGIC)
}

/// Reads and checks a rig block's bytes, those of the file `path`.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with the file and the reason for which the device would
/// refuse it too.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<Rig> {
    rig_block::decode(bytes).map_err(|e| Error::data(format!("{}: {e}", path.display())))
}

/// Reads the file that `export --rig` wrote.
///
/// # Errors
/// As [`decode`], and when the file cannot be read.
pub fn read(path: &Path) -> Result<Rig> {
    let bytes = input::read(path).map_err(|e| {
        Error::data(format!(
            "{}: could not be read ({e}); give the file that `jointwatch export --rig` wrote",
            path.display()
        ))
    })?;
    decode(path, &bytes)
}

/// "+0", or "–" where nothing is wired.
fn signed(place: Option<Signed>) -> String {
    place.map_or("–".into(), |s| format!("{}{}", sign(s.negative), s.place))
}

fn sign(negative: bool) -> char {
    if negative { '-' } else { '+' }
}

fn directions(axis: &AxisWiring) -> Vec<String> {
    let wired = axis.acceleration.iter().flatten();
    let letter = |d: &SignedDirection| {
        ["x", "y", "z"]
            .get(usize::from(d.direction))
            .copied()
            .unwrap_or("?")
    };
    wired
        .map(|d| format!("{}{}{}", sign(d.negative), d.chip, letter(d)))
        .collect()
}

/// By how many microseconds displacement, body, acceleration, force and input are late.
fn skews_us(axis: &RigAxis, sample_rate_hz: f64) -> [f64; 5] {
    let delays = &axis.delays;
    let samples = [
        delays.displacement,
        delays.body,
        delays.acceleration,
        axis.force_delay_samples,
        delays.input,
    ];
    samples.map(|samples| samples / sample_rate_hz * 1e6)
}

/// The block for a person to read.
pub fn in_words(rig: &Rig) -> String {
    let mut text = format!(
        "Rig block: {} axes at {} Hz; derivatives of {} taps, residual's low-pass of {} taps, a value at every {}; {} limits of the monitor; for the model \
         whose checksum is {:08x}.\n",
        rig.axes.len(),
        rig.sample_rate_hz,
        rig.velocity.taps.len(),
        rig.band.taps.len(),
        match 1 << rig.band_every_log2 {
            1 => "sample".into(),
            every => format!("{every} samples"),
        },
        if rig.limits.is_some() {
            "with"
        } else {
            "without"
        },
        rig.model_checksum,
    );
    text.push_str(&scales(rig).to_string());
    for (number, axis) in rig.axes.iter().enumerate() {
        if !axis.hum.is_none() {
            text.push_str(&format!(
                "The force of axis {number} hums at {:.3} Hz with an amplitude of {:.3e}, which is followed and taken out.\n",
                axis.hum.frequency_hz, axis.hum.amplitude
            ));
        }
    }
    text.push_str(&format!(
        "\nCounters, converter channels and accelerometers, with their signs:\n{}",
        connections(&rig.wiring)
    ));
    if let Some(limits) = &rig.limits {
        text.push_str(&limits_in_words(limits, rig.sample_rate_hz));
    }
    text
}

/// What a count of every channel is worth, and by how much it is late.
fn scales(rig: &Rig) -> Table {
    let mut table = Table::new(&[
        "axis",
        "per count",
        "per force code",
        "per accel. code",
        "per input code",
        "inertia",
        "late by (µs): position, body, accel., force, input",
    ]);
    for (number, axis) in rig.axes.iter().enumerate() {
        let late = skews_us(axis, rig.sample_rate_hz).map(|skew| format!("{skew:.1}"));
        table.row(vec![
            number.to_string(),
            format!("{:.4e}", axis.displacement_step),
            format!("{:.4e}", axis.force_step),
            format!("{:.4e}", axis.acceleration_step),
            format!("{:.4e}", axis.input_step),
            format!("{:.5}", axis.inertia),
            late.join(", "),
        ]);
    }
    table
}

/// Which channel of which chip measures what.
fn connections(wiring: &Wiring) -> Table {
    let mut table = Table::new(&[
        "axis",
        "far",
        "near",
        "body",
        "bridge",
        "gain",
        "input",
        "its gain",
        "accelerometers",
    ]);
    for (number, axis) in wiring.axes.iter().enumerate() {
        let gain = |channel: Signed| {
            let gain = wiring.converter.gain_log2.get(usize::from(channel.place));
            gain.map_or(String::new(), |gain| (1_u32 << gain).to_string())
        };
        let directions = directions(axis);
        table.row(vec![
            number.to_string(),
            signed(Some(axis.far)),
            signed(axis.near),
            signed(axis.body),
            signed(Some(axis.force)),
            gain(axis.force),
            signed(axis.input),
            axis.input.map_or("–".into(), gain),
            if directions.is_empty() {
                "–".into()
            } else {
                directions.join(" ")
            },
        ]);
    }
    table
}

/// The cumulative sums of an axis with their names and the worth of one unit: octaves of power, or
/// per cent of the force.
fn sums(axis: &AxisLimits) -> [(&'static str, Cusum, f64, &'static str); SIDES] {
    let [gone, unexpected] = axis.gross_sums();
    let (octave, percent) = (1.0 / f64::from(OCTAVE), 100.0 / f64::from(SHARE));
    [
        ("error", axis.error, octave, "octaves"),
        ("stiffer", axis.stiffness.more, percent, "% of force"),
        ("softer", axis.stiffness.less, percent, "% of force"),
        ("more friction", axis.friction.more, percent, "% of force"),
        ("less friction", axis.friction.less, percent, "% of force"),
        ("force gone", gone, octave, "octaves"),
        ("force not expected", unexpected, octave, "octaves"),
    ]
}

fn limits_in_words(limits: &Limits, sample_rate_hz: f64) -> String {
    let mut table = Table::new(&["axis", "sum", "drift", "alarm at", "unit"]);
    for (number, axis) in limits.axes.iter().enumerate() {
        for (name, side, worth, unit) in sums(axis) {
            table.row(vec![
                number.to_string(),
                name.into(),
                format!("{:.2}", f64::from(side.drift) * worth),
                format!("{:.2}", f64::from(side.threshold) * worth),
                unit.into(),
            ]);
        }
    }
    format!(
        "\nLimits of the monitor for the model with checksum {:08x}, set to one false alarm in {} days; blocks of {:.0} ms; suspect \
         outside the training range from {:.0} % of the time on:\n{table}",
        limits.model_checksum,
        limits.false_alarm_hours / 24,
        1e3 * f64::from(limits.block) / sample_rate_hz,
        f64::from(limits.outside_permille) / 10.0,
    )
}

fn limits_as_json(limits: &Limits, sample_rate_hz: f64) -> serde_json::Value {
    let axes = limits.axes.iter().map(|axis| {
        let sums = sums(axis).map(|(name, side, worth, unit)| {
            serde_json::json!({
                "sum": name,
                "drift": f64::from(side.drift) * worth,
                "threshold": f64::from(side.threshold) * worth,
                "unit": unit,
            })
        });
        serde_json::json!({ "sums": sums, "moving_counts": axis.moving_counts })
    });
    serde_json::json!({
        "model_checksum": format!("{:08x}", limits.model_checksum),
        "false_alarm_hours": limits.false_alarm_hours,
        "block_s": f64::from(limits.block) / sample_rate_hz,
        "outside_permille": limits.outside_permille,
        "axes": axes.collect::<Vec<_>>(),
    })
}

/// The block as JSON, SI units.
pub fn as_json(rig: &Rig) -> serde_json::Value {
    let wiring = &rig.wiring;
    let axes = rig.axes.iter().zip(&wiring.axes).map(|(axis, wired)| {
        let [displacement, body, acceleration, force, input] = skews_us(axis, rig.sample_rate_hz);
        serde_json::json!({
            "displacement_step": axis.displacement_step,
            "body_step": axis.body_step,
            "acceleration_step": axis.acceleration_step,
            "force_step": axis.force_step,
            "input_step": axis.input_step,
            "input_zero": axis.input_zero,
            "inertia": axis.inertia,
            "restoring_force": if axis.inertia_minus_force { "inertia_minus_force" } else { "force_minus_inertia" },
            "ground_stiffness": axis.ground_stiffness,
            "ground_damping": axis.ground_damping,
            "force_cross": axis.force_cross,
            "hum": (!axis.hum.is_none()).then(|| serde_json::json!({
                "frequency_hz": axis.hum.frequency_hz,
                "amplitude": axis.hum.amplitude,
            })),
            "skew_us": { "displacement": displacement, "body": body, "acceleration": acceleration, "force": force, "input": input },
            "far": signed(Some(wired.far)),
            "near": wired.near.map(|s| signed(Some(s))),
            "body": wired.body.map(|s| signed(Some(s))),
            "bridge": signed(Some(wired.force)),
            "input": wired.input.map(|s| signed(Some(s))),
            "acceleration": directions(wired),
            "pair_distance_m": wired.pair_distance_m,
        })
    });
    serde_json::json!({
        "rig_block": rig_block::RIG_BLOCK_VERSION,
        "model_checksum": rig.model_checksum,
        "sample_rate_hz": rig.sample_rate_hz,
        "derivative_taps": rig.velocity.taps.len(),
        "band_taps": rig.band.taps.len(),
        "band_every": 1_u32 << rig.band_every_log2,
        "gains": wiring.converter.gain_log2.map(|gain| 1_u32 << gain),
        "oversampling": 128_u32 << wiring.converter.oversampling,
        "limits": rig.limits.as_ref().map(|limits| limits_as_json(limits, rig.sample_rate_hz)),
        "axes": axes.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::selftest::chain::{SHORT_TAPS, reference_rig};
    use jointwatch_shared::selftest::network::reference_network;
    use jointwatch_shared::selftest::reference_model;

    #[test]
    fn a_block_that_is_not_for_the_model_is_refused_with_the_reason() {
        let model = reference_model();
        let blob = blob::encode(model);
        let mut rig = reference_rig(SHORT_TAPS).unwrap();
        rig.model_checksum = blob::checksum_of(model);
        let bytes = encode(&rig).unwrap();
        assert_eq!(check_pair(&blob, &bytes), Ok(()));
        let said = |model: &[u8], rig: &[u8]| check_pair(model, rig).unwrap_err().sentence;
        let other = blob::encode(reference_network());
        assert!(said(&other, &bytes).contains("another one"));
        let mut damaged = bytes;
        damaged[100] ^= 1;
        assert!(said(&blob, &damaged).contains("cannot go with this model"));
        assert!(said(&blob, &bytes[..100]).contains("cannot go with this model"));
    }
}
