//! Fitting the paper's network of tanh neurons (Eqs. 14 and 15) to training records.
//!
//! The output layer is solved exactly for whatever the hidden layer is (`projection`); the hidden
//! layer is found by Levenberg–Marquardt (`levenberg_marquardt`) with Bayesian regularisation
//! (`evidence`), on ever more of the rows (`stages`), from several random starts (`restarts`). The
//! paper's Sections 2.4 and 3.2.2 train with the same regularisation and restarts, by steps over
//! all weights.

mod evidence;
mod hidden_layer;
mod levenberg_marquardt;
mod options;
mod outcome;
mod projection;
mod restarts;
mod rows;
mod size;
mod stages;
mod start;
#[cfg(test)]
mod tests;

pub use options::{MAX_NEURONS, NetworkOptions, Neurons};
pub use outcome::{
    BadInput, Converged, GaveUp, LeftOut, NetworkFit, NetworkProgress, Restart, SizeCurve,
    SizeError, Stop, TracePoint, TrainingObserver,
};

use super::coverage::training_warnings;
use super::inertia::inertias;
use super::polynomial::{check_records, input_ranges};
use crate::model::InputRange;
use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::study::series::extent;
use crate::text::error::{Error, Result};
use crate::text::table::short;
use options::parameters;
use rows::{Piece, Rows};
use std::borrow::Cow;

/// Rows per weight below which the rows are worth a word: neighbours in a record are nearly the
/// same row.
const ROWS_PER_PARAMETER: usize = 20;

/// A force whose range is below this share of its size counts as constant: the rest is rounding.
const CONSTANT: f64 = 1e-12;

/// The middle and half the width of each axis's restoring force over all records together.
fn output_ranges(axes: &[Axis], pieces: &[Piece<'_>]) -> Result<Vec<InputRange>> {
    let range = |(index, axis): (usize, &Axis)| {
        let values = pieces.iter().flat_map(|piece| piece.forces[index]);
        let [low, high] = extent(values.copied());
        let range = InputRange::of([low, high]);
        let size = low.abs().max(high.abs());
        if range.half_range <= CONSTANT * size {
            return Err(Error::data(format!(
                "the restoring force of axis {} is {} {} at every training row, so there is nothing to learn: check its force \
                 column in study.toml, or drive that axis",
                axis.name,
                short(range.center),
                axis.kind.force_unit()
            )));
        }
        if !range.is_sound() {
            return Err(Error::data(format!(
                "the restoring force of axis {} reaches {size:.1e} {}, too far to compute with: check the units of its force and \
                 acceleration in study.toml",
                axis.name,
                axis.kind.force_unit()
            )));
        }
        Ok(range)
    };
    axes.iter().enumerate().map(range).collect()
}

/// What to be wary of in a training on so many rows of a network with so many weights.
fn warnings(
    axes: &[Axis],
    motions: &[&Motion],
    trained: &restarts::Restarts,
    rows: usize,
    weights: usize,
) -> Vec<String> {
    // No number of parameters: the words for too few rows differ from the polynomial's.
    let mut warnings = training_warnings(axes, motions, 0);
    if rows < ROWS_PER_PARAMETER * weights {
        warnings.push(format!(
            "{rows} training rows are few for {} weights: record longer, or give fewer --neurons",
            weights
        ));
    }
    if trained.interrupted {
        warnings.push(format!(
            "training was interrupted; these are the best weights so far, of {} restarts that had begun",
            trained.done.len()
        ));
    }
    warnings
}

/// Trains a network on the restoring force of every axis of the training records `motions`.
///
/// `low_pass` are the taps of the study's symmetric low-pass; it is needed where an inertia is to
/// be identified, and sets the guard between stretches when the size is chosen from one record.
/// `watch` is told after every step and can end the training; the best weights so far are kept
/// then.
///
/// # Errors
/// One sentence: options out of range, no training record, records that do not fit the axes or are
/// too short for the number of weights, a force that is the same everywhere, an identified inertia
/// that is not positive, values that are not finite from every random start, an end by `watch`
/// before there were weights.
pub fn fit_network(
    axes: &[Axis],
    motions: &[&Motion],
    low_pass: &[f64],
    options: &NetworkOptions,
    watch: &TrainingObserver<'_>,
) -> Result<NetworkFit> {
    options.check()?;
    check_records(axes, motions)?;
    let input = options.input.as_deref();
    let inputs = input_ranges(motions, input);
    let inertia = inertias(axes, motions, (&inputs, input), low_pass)?;
    let moving: Vec<Cow<'_, Motion>> = motions.iter().map(|m| m.moving()).collect();
    let forces: Vec<Vec<Vec<f64>>> = moving
        .iter()
        .map(|motion| {
            let axes = axes.iter().zip(&inertia).enumerate();
            axes.map(|(i, (axis, inertia))| {
                motion.restoring_force(i, inertia.value, axis.restoring_force)
            })
            .collect()
        })
        .collect();
    let records: Vec<Piece<'_>> = moving
        .iter()
        .zip(&forces)
        .map(|(motion, forces)| Piece {
            states: motion.base_states(input),
            forces: forces.iter().map(Vec::as_slice).collect(),
        })
        .collect();
    let outputs = output_ranges(axes, &records)?;
    let ranges: [&[InputRange]; 2] = [&inputs, &outputs];
    let rows: usize = records.iter().map(Piece::rows).sum();
    let weights = |neurons| parameters(inputs.len(), neurons, outputs.len());
    let (neurons, size_curve) = match options.neurons {
        Neurons::Fixed(neurons) => (neurons, None),
        Neurons::Auto => {
            // A tenth of a second: more than a cycle of the slowest motions that matter, beside
            // what the filters smear.
            let guard = (0.1 * motions[0].sample_rate_hz) as usize + low_pass.len();
            let (neurons, curve) = size::choose(&records, ranges, guard, options, watch)?;
            (neurons, Some(curve))
        }
    };
    if rows < weights(neurons) {
        return Err(Error::data(format!(
            "{rows} training rows cannot determine the {} weights of {neurons} neurons: record longer, or give fewer --neurons",
            weights(neurons)
        )));
    }
    let ordered = Rows::new(&records, &inputs, &outputs, 2 * weights(neurons));
    let trained = restarts::run(
        &ordered,
        ranges,
        neurons,
        options.restarts,
        options.seed,
        options.limits(),
        watch,
    )?;
    let warnings = warnings(axes, motions, &trained, rows, weights(neurons));
    Ok(NetworkFit {
        network: trained.done[trained.best].network.clone(),
        best: trained.best,
        restarts: trained.done,
        begun_anew: trained.begun_anew,
        interrupted: trained.interrupted,
        size_curve,
        inertia,
        rows,
        warnings,
    })
}
