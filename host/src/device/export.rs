//! From a model in newtons to the blob that the device evaluates, and back.

use crate::model::Network;
use crate::model::corrections::{Corrections, of_the_joint};
use crate::model::file::{Base, ModelFile, followed};
use crate::signal::filters::Filters;
use crate::study::Convention;
use crate::text::error::{Error, Result};
use crate::text::input;
use jointwatch_shared::base::axis::{self, Axis, Name};
use jointwatch_shared::base::network_quantise::Weights;
use jointwatch_shared::base::terms::{EffectValues, Memory};
use jointwatch_shared::base::{Header, Model};
use jointwatch_shared::effect::Subsystem;
use jointwatch_shared::scalar::fixed::q31_to_f64;
use jointwatch_shared::selftest::{CORNER_POINTS, Points, corner};
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use serde::Serialize;
use std::path::Path;

/// The largest part of an axis's RMS training force that fixed point may cost, unless `--budget`
/// says otherwise.
///
/// The bounds of a network are larger than those of a polynomial: its neurons cancel, and what each
/// of them may be off by goes with its output weight, which a fit can make a thousand times the
/// force. One part in a thousand is still a tenth of what a good network itself misses.
pub fn default_budget(base: &Base) -> f64 {
    match base {
        Base::Polynomial(_) | Base::None(_) => 1e-5,
        Base::Network(_) => 1e-3,
    }
}

/// Seed of the random inputs at which export measures the quantisation error.
const SEED: u64 = 0x6a6f_696e;
/// How many of them, besides the corner and centre points.
const POINTS: u32 = 100_000;

/// What fixed point costs one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisExport {
    /// Name of the axis.
    pub axis: String,
    /// N or N·m per unit of the device's 32-bit force.
    pub force_per_lsb: f64,
    /// Proven bound of |device − f64| over all inputs inside the training range, N or N·m.
    pub error_bound: f64,
    /// Largest |device − f64| seen over random, corner and centre points, N or N·m.
    pub largest_error: f64,
    /// The bound as a part of the axis's RMS training force.
    pub bound_relative: f64,
}

/// A model ready for the device.
pub struct Exported {
    /// The model in fixed point.
    pub model: Model,
    /// The model blob, as the device reads it.
    pub blob: [u8; BLOB_LEN],
    /// What fixed point costs, per axis.
    pub axes: Vec<AxisExport>,
}

impl Exported {
    /// What `export --json` says; `blob` is where it was written, if it was.
    pub fn as_json(&self, blob: Option<&Path>) -> serde_json::Value {
        serde_json::json!({ "blob": blob, "bytes": self.blob.len(), "axes": self.axes })
    }
}

/// Brings a model to fixed point and measures what that costs.
///
/// `budget` is the largest error bound allowed, as a part of each axis's RMS training force;
/// [`default_budget`] when there is none.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] naming the coefficient or the neuron when the model cannot be
/// held within the budget, and the number of neurons when the device has not as many.
pub fn export(file: &ModelFile, budget: Option<f64>) -> Result<Exported> {
    let budget = budget.unwrap_or_else(|| default_budget(&file.base));
    let refuse = |e: jointwatch_shared::fault::Error| {
        Error::data(format!("this model cannot be exported: {e}"))
    };
    let budgets: Vec<f64> = file
        .fits
        .iter()
        .map(|fit| budget * fit.training_force_rms)
        .collect();
    let effects = of_the_joint(&file.effects_in_si()?);
    let corrections = file.corrections()?;
    check_inputs(file, &effects)?;
    let header = header(file, &effects).map_err(refuse)?;
    check_exportable(file, &header, &effects, &corrections)?;
    let model = match &file.base {
        Base::Polynomial(polynomial) => {
            let coefficients: Vec<&[f64]> =
                polynomial.coefficients.iter().map(Vec::as_slice).collect();
            Model::from_polynomial(header, &polynomial.orders, &coefficients, &budgets)
                .and_then(|model| model.adding_effects(&effects, &budgets))
        }
        Base::Network(network) => from_network(header, network, &budgets)
            .and_then(|model| model.adding_effects(&effects, &budgets)),
        Base::None(_) => Model::from_effects(header, &effects, &budgets),
    };
    let model = model
        .and_then(|model| model.correcting(corrections.of_channels()))
        .map_err(refuse)?;

    let largest = largest_errors(file, &model)?;
    let axes = file
        .axes
        .iter()
        .zip(model.outputs())
        .zip(largest)
        .zip(&file.fits);
    let axes = axes.map(|(((mine, output), largest_error), fit)| AxisExport {
        axis: mine.name.clone(),
        force_per_lsb: output.force_per_lsb,
        error_bound: output.error_bound,
        largest_error,
        bound_relative: output.error_bound / fit.training_force_rms,
    });
    Ok(Exported {
        axes: axes.collect(),
        blob: blob::encode(&model),
        model,
    })
}

/// Refuses a model that a device cannot evaluate, with what to do instead.
fn check_exportable(
    file: &ModelFile,
    header: &Header,
    effects: &[EffectValues],
    corrections: &Corrections,
) -> Result<()> {
    if file.filters.quasi_static {
        return Err(Error::data(
            "this model was learnt without time (time = \"none\"), and a device judges a joint in time: learn one from records with \
             time for export",
        ));
    }
    let of_device =
        Filters::for_bands(header.sample_rate_hz, header.band_hz, header.state_band_hz)?;
    if [&of_device.velocity, &of_device.band].map(Vec::len)
        != [&file.filters.velocity, &file.filters.band].map(Vec::len)
    {
        return Err(Error::data(
            "this model was learnt behind filters that were shortened for a short record, and a device's are longer: learn one from longer \
             records for export",
        ));
    }
    if let Some(term) = effects
        .iter()
        .find(|t| t.entry.subsystem == Subsystem::TimeVaryingPlant)
    {
        return Err(Error::data(format!(
            "{} depends on the time since a record began, and a device that never stops does not know when that was: learn a \
             model without it for export",
            term.entry.about.name
        )));
    }
    if let Some(zero) = corrections.per_record.iter().find(|t| !t.entry.is_line()) {
        return Err(Error::data(format!(
            "{} is another one in every record, and a device that never stops has no records: tare the force channel before it starts, after it has warmed up, and \
             learn a model with preload in its place for export",
            zero.entry.about.name
        )));
    }
    Ok(())
}

/// The inputs that the force of an axis follows, each once.
fn followed_on<'a>(file: &'a ModelFile, effects: &'a [EffectValues], axis: usize) -> Vec<&'a str> {
    let own = effects.iter().filter(|e| usize::from(e.axis) == axis);
    // A base that follows one has one axis.
    let mut names: Vec<&str> = followed(own).chain(file.state_input.as_deref()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Refuses inputs that a device cannot follow: it has one channel an axis, and has to know the
/// range.
fn check_inputs(file: &ModelFile, effects: &[EffectValues]) -> Result<()> {
    for (index, axis) in file.axes.iter().enumerate() {
        let name = match followed_on(file, effects, index)[..] {
            [] => continue,
            [name] => name,
            [first, second, ..] => {
                return Err(Error::data(format!(
                    "the force of axis {} follows {first:?} and {second:?}, and the device has one input channel an axis: learn a model that \
                     follows one of them for export",
                    axis.name
                )));
            }
        };
        if name.len() > axis::NAME_LEN {
            return Err(Error::data(format!(
                "the name of the input {name:?} is longer than {} bytes: shorten it in study.toml, and learn the model again for export",
                axis::NAME_LEN
            )));
        }
        if file.followed.iter().all(|input| input.name != name) {
            return Err(Error::data(format!(
                "model.json does not say between which values the input {name:?} lay: learn the model again, from records in which it changes"
            )));
        }
    }
    Ok(())
}

/// What the blob says of the model beside its numbers.
fn header(
    file: &ModelFile,
    effects: &[EffectValues],
) -> std::result::Result<Header, jointwatch_shared::fault::Error> {
    let mut axes = heapless::Vec::new();
    for (index, (mine, ranges)) in file
        .axes
        .iter()
        .zip(file.base.inputs().chunks_exact(2))
        .enumerate()
    {
        let validation = file.validation.iter().find(|v| v.axis == mine.name);
        let range = |r: &crate::model::InputRange| axis::InputRange {
            center: r.center,
            half_range: r.half_range,
        };
        let name = followed_on(file, effects, index).first().copied();
        let known = file
            .followed
            .iter()
            .find(|known| Some(known.name.as_str()) == name);
        let input = known.map(|known| {
            Ok(axis::Input {
                name: Name::new(index as u8, &known.name)?,
                range: range(&known.range),
            })
        });
        let axis = Axis {
            input: input.transpose()?,
            name: Name::new(index as u8, &mine.name)?,
            kind: mine.kind.into(),
            convention: match mine.restoring_force {
                Convention::ForceMinusInertia => axis::Convention::ForceMinusInertia,
                Convention::InertiaMinusForce => axis::Convention::InertiaMinusForce,
            },
            inertia: mine.inertia,
            displacement: range(&ranges[0]),
            velocity: range(&ranges[1]),
            validation: validation.map(|v| axis::Validation {
                // A figure beyond f32 stays finite: the blob holds no infinities.
                nmse_percent: v.nmse_percent.min(f64::from(f32::MAX)) as f32,
                relative_error: v.relative_error.min(f64::from(f32::MAX)) as f32,
            }),
        };
        // ModelFile::check allows two axes at most.
        let _ = axes.push(axis);
    }
    Ok(Header {
        sample_rate_hz: file.filters.sample_rate_hz,
        band_hz: file.filters.band_hz,
        state_band_hz: file.filters.state_band_hz,
        axes,
    })
}

/// Brings a network to fixed point, with the scale of its outputs folded into their weights.
fn from_network(
    header: Header,
    network: &Network,
    budgets: &[f64],
) -> std::result::Result<Model, jointwatch_shared::fault::Error> {
    let outputs = network.outputs.iter();
    let output: Vec<Vec<f64>> = outputs
        .clone()
        .zip(&network.output_weights)
        .map(|(range, row)| row.iter().map(|w| range.half_range * w).collect())
        .collect();
    let output_bias: Vec<f64> = outputs
        .zip(&network.output_bias)
        .map(|(range, bias)| range.center + range.half_range * bias)
        .collect();
    let weights = Weights {
        hidden: &network.hidden_weights.concat(),
        hidden_bias: &network.hidden_bias,
        output: &output.iter().map(Vec::as_slice).collect::<Vec<_>>(),
        output_bias: &output_bias,
    };
    Model::from_network(header, &weights, budgets)
}

/// Largest |device − f64| per axis over random, corner and centre points of the training range.
fn largest_errors(file: &ModelFile, model: &Model) -> Result<Vec<f64>> {
    let mut points = Points::new(SEED);
    let inputs = (0..CORNER_POINTS)
        .map(corner)
        .chain((0..POINTS).map(|_| points.next_point()));
    let inputs: Vec<[i32; 4]> = inputs.collect();
    // The f64 model is asked at the very numbers that the integers stand for, and at 1 where Q31
    // has only its neighbour: that difference is part of what fixed point costs.
    let real = |value: i32| {
        if value == i32::MAX {
            1.0
        } else {
            q31_to_f64(value)
        }
    };
    let states: Vec<Vec<f64>> = file
        .base
        .motion_ranges()
        .iter()
        .enumerate()
        .map(|(input, range)| {
            inputs
                .iter()
                .map(|u| range.center + range.half_range * real(u[input]))
                .collect()
        })
        .collect();
    let states: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
    // An input takes the numbers of a state of the other axis, or of the one that is not there.
    const OTHER: [usize; 2] = [2, 1];
    let header = model.header().axes.iter().zip(OTHER);
    let followed = header.filter_map(|(axis, other)| {
        let input = axis.input.as_ref()?;
        let (name, range) = (input.name.as_str().to_owned(), &input.range);
        let value = |u: &[i32; 4]| range.center + range.half_range * real(u[other]);
        Some((name, inputs.iter().map(value).collect()))
    });
    let wanted = file.predict_with(&states, &followed.collect::<Vec<_>>())?;
    let mut largest = vec![0.0; file.axes.len()];
    // The points count as one motion on both sides, for the sake of effects with memory.
    let mut memory = Memory::default();
    for (at, u) in inputs.iter().enumerate() {
        memory.follow(OTHER.map(|other| u[other]));
        for (axis, raw) in model
            .step(&mut memory, u)
            .into_iter()
            .enumerate()
            .take(largest.len())
        {
            let seen = f64::from(raw) * model.outputs()[axis].force_per_lsb;
            largest[axis] = f64::max(largest[axis], (seen - wanted[axis][at]).abs());
        }
    }
    Ok(largest)
}

/// Reads and checks a blob.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] with the file and the reason for which the device would
/// refuse it too.
pub fn read_blob(path: &Path) -> Result<Model> {
    let bytes = input::read(path).map_err(|e| {
        Error::data(format!(
            "{}: the blob could not be read ({e}); give the file that `jointwatch export` wrote",
            path.display()
        ))
    })?;
    blob::decode(&bytes).map_err(|e| Error::data(format!("{}: {e}", path.display())))
}
