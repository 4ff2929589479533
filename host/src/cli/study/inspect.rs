//! `jointwatch inspect`: what a log, a model file or a blob holds.

use super::survey;
use crate::cli::console::Console;
use crate::device::export;
use crate::device::rig_block;
use crate::device::signing::SignedModel;
use crate::model::corrections;
use crate::model::file::{Base, HistoryEntry, ModelFile};
use crate::model::{ModelEffect, values};
use crate::study::AxisKind;
use crate::study::survey::{Survey, is_a_log, is_long};
use crate::text::error::{Error, Result};
use crate::text::input;
use crate::text::table::{Table, hertz, percent, sample_rate, significant};
use clap::Args;
use jointwatch_shared::base::axis::{Convention, InputRange};
use jointwatch_shared::base::{Base as DeviceBase, Model};
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::slot::SLOT_LEN;
use std::path::PathBuf;

/// Options of `jointwatch inspect`.
#[derive(Args)]
pub(crate) struct Inspect {
    /// A log in any format that can be read (`-`: from standard input), a model.json that
    /// `identify` wrote, a blob or a rig block that `export` wrote, or a signed model.
    pub(super) file: PathBuf,
}

impl Inspect {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        let long = is_long(&self.file);
        let bytes = match long {
            true => Vec::new(),
            false => input::read(&self.file).map_err(|e| {
                Error::data(format!(
                    "{} could not be read ({e}); give the path of a log, of a model.json, or of a blob that this tool wrote",
                    self.file.display()
                ))
            })?,
        };
        if long || (!rig_block::begins_like_one(&bytes) && is_a_log(&bytes)) {
            let log = Survey::of(&self.file)?;
            console.say(survey::in_words(&log, true))?;
            return console.json(&survey::as_json(&log));
        }
        // A model file is JSON, so it begins with a brace; a blob never does, and says itself what
        // is wrong with it.
        if bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{') {
            let model = ModelFile::read(&self.file)?;
            console.say(model_in_words(&model))?;
            console.json(&model)
        } else if rig_block::begins_like_one(&bytes) {
            let block = rig_block::decode(&self.file, &bytes)?;
            console.say(rig_block::in_words(&block))?;
            console.json(&rig_block::as_json(&block))
        } else if bytes.len() == SLOT_LEN {
            let signed = SignedModel::read(&self.file)?;
            let model = signed.model()?;
            console.say(format!(
                "{}\n{}",
                signed_in_words(&signed),
                blob_in_words(&model)
            ))?;
            let mut json = blob_as_json(&model);
            json["signed"] = serde_json::json!({
                "release": signed.header().release,
                "class": signed.class(),
                "rig_bytes": signed.rig_len(),
                "signature": signed.signature().is_some(),
            });
            console.json(&json)
        } else {
            let model = export::read_blob(&self.file)?;
            console.say(blob_in_words(&model))?;
            console.json(&blob_as_json(&model))
        }
    }
}

/// What goes with a signed model.
fn signed_in_words(signed: &SignedModel) -> String {
    let class = match signed.class() {
        class if class.is_empty() => "for firmware without a class".to_owned(),
        class => format!("for the class {class:?}"),
    };
    let rig = match signed.rig_len() {
        0 => "no rig block, so that the device reports raw counts only".to_owned(),
        bytes => format!("a rig block of {bytes} bytes"),
    };
    let signature = match signed.signature() {
        Some(_) => {
            "signed; whether the signature is good only the device can say, which has the key"
        }
        None => "not signed",
    };
    format!(
        "Release {}, {class}, with {rig}; {signature}.",
        signed.header().release
    )
}

fn model_in_words(model: &ModelFile) -> String {
    let size = match &model.base {
        Base::Polynomial(polynomial) => format!("orders {:?}", polynomial.orders),
        Base::Network(network) => format!("{} neurons", network.neurons()),
        Base::None(_) => format!("{} effects", model.effects.len()),
    };
    let mut text = format!(
        "Model of study '{}': {}, {} fit, {size}; records at {}, compared up to {}.\n",
        model.study,
        model.base.name(),
        model.fit,
        sample_rate(model.filters.sample_rate_hz),
        hertz(model.filters.band_hz)
    );
    text.push_str(&axes_of_model(model).to_string());
    for input in &model.followed {
        let is_state = model.state_input.as_ref() == Some(&input.name);
        let range = [input.range.center, input.range.half_range];
        text.push_str(&input_in_words(&input.name, range, is_state));
    }
    if !model.effects.is_empty() {
        text.push_str(&format!("\n{}", values::table(&model.effects)));
    }
    for sentence in corrections::in_words(&model.effects) {
        text.push_str(&format!("\nCorrected: {sentence}."));
    }
    for entry in &model.history {
        text.push_str(&step_in_words(entry));
    }
    for warning in &model.warnings {
        text.push_str(&format!("\nWarning: {warning}."));
    }
    text
}

/// The axes of a model with their ranges and errors.
fn axes_of_model(model: &ModelFile) -> Table {
    let mut table = Table::new(&[
        "axis",
        "terms",
        "inertia",
        "displacement range",
        "velocity range",
        "validation NMSE",
    ]);
    for (index, (axis, fit)) in model.axes.iter().zip(&model.fits).enumerate() {
        let range = |input: usize, unit: &str| {
            let range = &model.base.inputs()[input];
            format!("{:.3e} ± {:.3e} {unit}", range.center, range.half_range)
        };
        let validation = model.validation.iter().find(|v| v.axis == axis.name);
        table.row(vec![
            axis.name.clone(),
            fit.terms.to_string(),
            format!("{} {}", significant(axis.inertia), axis.kind.inertia_unit()),
            range(2 * index, axis.kind.displacement_unit()),
            range(2 * index + 1, axis.kind.velocity_unit()),
            validation.map_or("none".into(), |v| percent(v.nmse_percent)),
        ]);
    }
    table
}

/// A step of a model's history.
fn step_in_words(entry: &HistoryEntry) -> String {
    let errors: Vec<String> = entry
        .validation
        .iter()
        .map(|e| format!("{} {}", e.axis, percent(e.nmse_percent)))
        .collect();
    let errors = if errors.is_empty() {
        "no validation records".into()
    } else {
        errors.join(", ")
    };
    let day = entry.date.as_ref().map(|day| format!("{day}, "));
    let mut text = format!(
        "\nHistory: {}{} (validation NMSE: {errors}).",
        day.unwrap_or_default(),
        entry.what
    );
    if let Some(change) = &entry.change {
        let axes = change.before.iter().zip(&change.after);
        let axes: Vec<String> = axes
            .map(|(before, after)| {
                format!(
                    "{} {:.4} to {:.4}",
                    before.axis, before.relative_error, after.relative_error
                )
            })
            .collect();
        text.push_str(&format!(
            "\n  Relative error on the {}, before and after: {}.",
            change.judged_on.words(),
            axes.join("; ")
        ));
    }
    text
}

/// An input that a force follows, with the middle of its training range and half its width.
fn input_in_words(name: &str, [center, half_range]: [f64; 2], is_state: bool) -> String {
    let state = if is_state { ", the third state" } else { "" };
    format!("\nInput {name}: {center:.3e} ± {half_range:.3e}{state}.")
}

fn in_range(range: &InputRange, unit: &str) -> String {
    format!("{:.3e} ± {:.3e} {unit}", range.center, range.half_range)
}

fn blob_in_words(model: &Model) -> String {
    let header = model.header();
    let base = match model.base() {
        DeviceBase::Polynomial(polynomial) => {
            let states = 2 * model.axes() + usize::from(polynomial.follows());
            let orders = &polynomial.orders()[..states];
            format!("polynomial, orders {orders:?}")
        }
        DeviceBase::Network(network) => format!("network, {} neurons", network.neurons().len()),
        DeviceBase::None { .. } => "base none, the force is that of the effects alone".into(),
        _ => "a kind of base that this version cannot show".into(),
    };
    let mut text = format!(
        "Blob: {base}; samples at {}, residual judged up to {}, states to {}; checksum {:08x}.\n",
        sample_rate(header.sample_rate_hz),
        hertz(header.band_hz),
        hertz(header.state_band_hz),
        blob::checksum_of(model)
    );
    let mut table = Table::new(&[
        "axis",
        "inertia",
        "restoring force",
        "displacement range",
        "velocity range",
        "force unit",
        "error bound",
        "validation NMSE",
    ]);
    for (axis, output) in header.axes.iter().zip(model.outputs()) {
        let kind = AxisKind::from(axis.kind);
        let force = kind.force_unit();
        table.row(vec![
            axis.name.as_str().into(),
            format!("{} {}", significant(axis.inertia), kind.inertia_unit()),
            match axis.convention {
                Convention::ForceMinusInertia => "force − inertia".into(),
                Convention::InertiaMinusForce => "inertia − force".into(),
            },
            in_range(&axis.displacement, kind.displacement_unit()),
            in_range(&axis.velocity, kind.velocity_unit()),
            format!("{:.3e} {force}", output.force_per_lsb),
            format!("{:.2e} {force}", output.error_bound),
            axis.validation
                .map_or("none".into(), |v| percent(v.nmse_percent.into())),
        ]);
    }
    text.push_str(&table.to_string());
    for input in header.axes.iter().filter_map(|axis| axis.input.as_ref()) {
        let range = [input.range.center, input.range.half_range];
        let is_state = model.base().follows();
        text.push_str(&input_in_words(input.name.as_str(), range, is_state));
    }
    if !model.terms().list().is_empty() {
        let effects = values::table(&ModelEffect::of_device(model));
        text.push_str(&format!("\n{effects}"));
    }
    for sentence in corrections::in_words(&corrections::of_device(model)) {
        text.push_str(&format!("\nCorrected: {sentence}."));
    }
    text
}

fn blob_as_json(model: &Model) -> serde_json::Value {
    let header = model.header();
    let axes: Vec<_> = header
        .axes
        .iter()
        .zip(model.outputs())
        .map(|(axis, output)| {
            let range = |r: &InputRange| {
                serde_json::json!({ "center": r.center, "half_range": r.half_range })
            };
            serde_json::json!({
                "name": axis.name.as_str(),
                "kind": AxisKind::from(axis.kind).name(),
                "inertia": axis.inertia,
                "input": axis.input.as_ref().map(|input| serde_json::json!({
                    "name": input.name.as_str(),
                    "range": range(&input.range),
                })),
                "restoring_force": match axis.convention {
                    Convention::ForceMinusInertia => "force_minus_inertia",
                    Convention::InertiaMinusForce => "inertia_minus_force",
                },
                "displacement": range(&axis.displacement),
                "velocity": range(&axis.velocity),
                "force_per_lsb": output.force_per_lsb,
                "error_bound": output.error_bound,
                "validation_nmse_percent": axis.validation.map(|v| v.nmse_percent),
                "validation_relative_error": axis.validation.map(|v| v.relative_error),
            })
        })
        .collect();
    let mut json = serde_json::json!({
        "base": "unknown",
        "checksum": blob::checksum_of(model),
        "sample_rate_hz": header.sample_rate_hz,
        "band_hz": header.band_hz,
        "state_band_hz": header.state_band_hz,
        "axes": axes,
        "effects": ModelEffect::of_device(model),
        "corrections": corrections::of_device(model),
    });
    match model.base() {
        DeviceBase::Polynomial(_) => json["base"] = "polynomial".into(),
        DeviceBase::None { .. } => json["base"] = "none".into(),
        DeviceBase::Network(network) => {
            json["base"] = "network".into();
            json["neurons"] = network.neurons().len().into();
        }
        _ => {}
    }
    json
}
